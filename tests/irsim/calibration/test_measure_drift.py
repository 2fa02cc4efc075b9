"""Non-uniformity that drifts, for longer than it is seen or from a correction on: told, and made again by a fit."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from intervals import held

import irsim
from irsim.fitting import fit
from irsim.measure import NoiseReport, measure_noise
from irsim.types import Floats

RATE = 30.0


def written(frames: int, drift: str) -> str:
    """A scenario of a camera whose NETD is 2.232 counts."""
    return (
        f"{{frames: {frames}, camera: {{size: [96, 72], netd_mk: 60, noise: [{{kind: white, ratio: 1}}, "
        f"{{kind: drift, {drift}}}]}}, background: {{kind: ground, spread_k: 0}}}}"
    )


def seen(scene: irsim.Scenario) -> Floats:
    return np.stack([frame.image for frame in irsim.Rendering(scene).frames()]).astype(float)


SEEDS = 6


def reports(frames: int, drift: str) -> tuple[list[NoiseReport], float]:
    scenes = [irsim.loads(written(frames, drift), overrides=[f"seed={seed}"]) for seed in range(SEEDS)]
    return [measure_noise(seen(scene), RATE) for scene in scenes], scenes[0].camera.response().noise


def test_columns_that_drift_for_longer_than_they_are_seen_are_told_to() -> None:
    """Stationary, sigma 10 NETD, ten seconds to forget, four seen: its change is told, as a walk or as slow memory."""
    found, netd = reports(120, "pixel: 20, column: 10, row: 5, time_constant_s: 10, age_s: 100")
    for term, sigma in (("th", 10 * netd), ("tv", 5 * netd)):
        of_lines = [report.lines[term] for report in found]
        changes = sigma * math.sqrt(2 / 10)
        for memory in of_lines:
            lasting = 2 * memory.correlated.value**2 / memory.time_constant_s.value
            assert 0.6 < math.sqrt(lasting + memory.walk.value**2) / changes < 1.6
        drifts = [memory.told_walk for memory in of_lines if memory.correlated.value == 0]
        assert drifts
        assert all(drift is not None for drift in drifts)
        held([drift for drift in drifts if drift is not None], changes, widest=0.4)
        held([memory.correlated for memory in of_lines], sigma, widest=3)


@pytest.mark.sampled
@pytest.mark.parametrize(("since_s", "column"), [(0, 3), (1, 1), (20, 1)])
def test_what_grows_since_a_correction_lies_in_its_intervals(since_s: int, column: int) -> None:
    """Five seconds are seen of what takes two to forget, and begins at the first frame, before it, or long before.

    Of columns the correction itself is seldom told: the sigma that they tend to, and the time, are all the same.
    """
    found, netd = reports(150, f"pixel: 2, column: {column}, row: 0, time_constant_s: 2, age_s: {since_s}")
    for sigma, widest, widest_s, memories in (
        (2 * netd, 0.4, 0.7, [report.temporal.memory for report in found]),
        (column * netd, 1.4, 2.8, [report.lines.get("th") for report in found]),
    ):
        told = [memory for memory in memories if memory is not None]
        assert len(told) == len(found)
        held([memory.correlated for memory in told], sigma, widest=widest)
        held([memory.time_constant_s for memory in told], 2.0, widest=widest_s)


def test_what_grows_for_twice_as_long_as_it_is_seen_is_not_told_too_small() -> None:
    found, netd = reports(120, "pixel: 5, column: 0, row: 0, time_constant_s: 10")
    told = [report.temporal.memory for report in found if report.temporal.memory is not None]
    assert len(told) == len(found)
    held([memory.correlated for memory in told], 5 * netd, widest=1.1)
    held([memory.time_constant_s for memory in told], 10.0, widest=1.4)


def test_white_noise_beside_slow_drift_is_told_closely() -> None:
    """Noise that forgets within a frame is white: it does not take the place of it."""
    found, netd = reports(120, "pixel: 3, column: 0, row: 0, time_constant_s: 120")
    told = [report.temporal.memory for report in found if report.temporal.memory is not None]
    assert len(told) == len(found)
    held([memory.white for memory in told], netd, widest=0.05)
    assert all(memory.white.low > 0.8 * netd for memory in told)


def test_a_fit_writes_no_memory_where_pixels_only_drift() -> None:
    """In one of two such recordings a pixel that goes the farthest is told to blink: that is not what is asked here."""
    found = fit(irsim.loads(written(120, "pixel: 40, column: 0, row: 0, time_constant_s: 600")))
    assert found.figures.memory is not None
    assert found.figures.memory.value == 0
    kinds = [noise.kind for noise in found.scenario.camera.noise if noise.kind != "bad_pixels"]
    assert kinds == ["noise_3d", "drift"]
    assert not [text for _, text in found.summary() if "with a memory of" in text]
    json.dumps(found.as_json(), allow_nan=False)


def test_a_fit_writes_noise_that_grows_since_a_correction_as_such() -> None:
    """Of 5 NETD in 10 s, 4 of which are seen: what stays in the mean of the frames is no more than that."""
    scene = irsim.loads(written(120, "pixel: 5, column: 0, row: 0, time_constant_s: 10"))
    first = fit(scene)
    assert first.figures.memory_age_s < 1
    pixels = [noise for noise in first.scenario.camera.noise if noise.id == "pixels"]
    assert [noise.kind for noise in pixels] == ["drift"]
    again = dict(fit(first.scenario).figures.measured())
    for name, value in first.figures.measured():
        assert name not in again or (again[name].low <= value.high and value.low <= again[name].high), name


def test_a_fit_makes_drift_of_columns_again() -> None:
    """By as much in a second as went in, and as the fit of what the fit renders tells."""
    scene = irsim.loads(written(150, "pixel: 5, column: 4, row: 2, time_constant_s: 60"))
    fitted = fit(scene)
    first = fitted.figures.columns
    assert first is not None
    assert first.correlated.value == 0
    changes = 4 * scene.camera.response().noise * math.sqrt(2 / 60)
    assert first.walk.low <= changes <= first.walk.high
    json.dumps(fitted.as_json(), allow_nan=False)
    again = fit(fitted.scenario).figures.columns
    assert again is not None
    assert again.walk.low <= first.walk.high
    assert first.walk.low <= again.walk.high
