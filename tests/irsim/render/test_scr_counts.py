"""Requested SCR of points against SCR in counts, and the noise terms in it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from irsim.camera.noise_base import FrameContext, Noise, NoiseVariance
from irsim.render.contrast import scr
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.types import Box

WANTED = 10.0
SEEDS = 3
APART_PX = 60.0
"""No target lies in another one's ring."""


def scene(camera: dict[str, Any], ground_k: float, seed: int = 0, **keys: Any) -> Scenario:
    """Still points on quiet ground, each at another place within its pixel."""
    targets = [
        {
            "id": f"p{row}{column}",
            "shape": {"kind": "point", "area_m2": 0.05, "scr": WANTED},
            "path": {
                "kind": "straight",
                "start": (32 + APART_PX * column + 0.37 * row, 32 + APART_PX * row + 0.61 * column),
                "speed": 0.0,
                "range_m": 1500.0,
            },
        }
        for row in range(5)
        for column in range(6)
    ]
    ground = {"kind": "ground", "mean_k": ground_k, "spread_k": 0.0}
    camera = {"size": (380, 304), **camera}
    return Scenario.model_validate(
        {"frames": 3001, "seed": seed, "camera": camera, "background": ground, "targets": targets, **keys}
    )


def measured(camera: dict[str, Any], ground_k: float, index: int) -> tuple[float, float]:
    """Return the mean of the SCR in counts and its error, three sigma; without bad pixels."""
    found = []
    for seed in range(SEEDS):
        off = ("bad_pixels",) if "preset" in camera else ()
        renderer = Renderer(scene(camera, ground_k, seed, frames=index + 1, without=off))
        frame, truth = renderer.frame(index)
        counts = frame.image.astype(np.float64)
        found += [scr(counts, target.box) for target in truth.targets]
    return float(np.mean(found)), 3 * float(np.std(found)) / math.sqrt(len(found))


@pytest.mark.parametrize(
    ("preset", "ground_k"), [("cooled_mwir", 220.0), ("cooled_lwir", 280.0), ("uncooled_lwir", 300.0)]
)
def test_requested_scr_is_that_of_the_counts(preset: str, ground_k: float) -> None:
    """At 220 K the signal of electrons is not linear."""
    found, sure = measured({"preset": preset}, ground_k, 0)
    assert sure < 0.035 * WANTED
    assert abs(found - WANTED) + sure <= 0.05 * WANTED, f"{found:.2f} +- {sure:.2f}"


@pytest.mark.parametrize(
    "noise",
    [
        [{"kind": "noise_3d", "t": 3.0, "v": 1.0, "h": 1.0, "tv": 0.5, "th": 0.5, "vh": 0.8, "tvh": 1.2}],
        [{"kind": "ar1", "over": "column", "time_constant_s": 1.0}, {"kind": "white"}],
    ],
)
def test_scr_includes_every_noise_term(noise: list[dict[str, Any]]) -> None:
    """Rows and columns vary along the ring; offsets of a frame shift target and ring alike."""
    found, sure = measured({"noise": noise, "bits": 16, "range_k": (250.0, 350.0)}, 300.0, 5)
    assert abs(found - WANTED) <= 0.05 * WANTED + sure, f"{found:.2f} +- {sure:.2f}"


def test_vignetting_raises_noise_equivalent_radiance() -> None:
    camera = {"netd_mk": 40.0, "bits": 16, "falloff": {"vignetting": 0.6}}
    noise = Renderer(scene(camera, 300.0)).noise(0)
    middle, corner = (noise(5.0, Box(x, y, 1, 1)) for x, y in ((189.5, 151.5), (0.0, 0.0)))
    assert corner / middle == pytest.approx(1 / 0.4, rel=0.05)  # cos^4 of 0.12 rad is another 3 %
    beyond = noise(5.0, Box(-50, 9000, 1, 1))
    assert math.isfinite(beyond)


@pytest.mark.parametrize("preset", ["cooled_mwir", "cooled_lwir", "uncooled_lwir"])
def test_noise_equivalent_radiance_raises_signal_by_sigma(preset: str) -> None:
    sensor, box = Renderer(scene({"preset": preset}, 300.0)).sensor, Box(189.5, 151.5, 1, 1)
    equivalent, response = sensor.noise_equivalent(0), sensor.response
    passed = 1.0 if sensor.vignetting is None else float(sensor.vignetting(0)[152, 190])
    for light in (0.0, 1e-9, 1e-3, 5.0):
        before, after = (response.at(passed * of) for of in (light, light + equivalent(light, box)))
        assert (after - before) ** 2 == pytest.approx(equivalent.variance.within_frame(before, response), rel=1e-6)
    assert equivalent(0.0, box) == pytest.approx(equivalent(1e-12, box), rel=1e-3)


def hot(camera: dict[str, Any], index: int = 0, ground_k: float = 290.0, **keys: Any) -> float:
    """Truth's SCR of a point that has a temperature, not an SCR."""
    scenario = scene(camera, ground_k, **keys).model_dump()
    scenario["targets"] = scenario["targets"][:1]
    scenario["targets"][0]["shape"].update(scr=None, temperature_k=310.0)
    (first,) = Renderer(Scenario.model_validate(scenario)).scene(index)[1].targets
    assert first.scr is not None
    return first.scr


def test_scr_excludes_noise_that_is_switched_off() -> None:
    camera = {"noise": [{"kind": "white"}, {"kind": "fixed_pattern", "pixel": math.sqrt(3), "column": 0, "row": 0}]}
    assert hot(camera, without=("fixed_pattern",)) == pytest.approx(2 * hot(camera), rel=1e-6)


def test_scr_excludes_bad_pixels_and_frame_offsets() -> None:
    white = [{"kind": "white"}]
    more = [*white, {"kind": "bad_pixels"}, {"kind": "ar1", "over": "frame", "ratio": 5.0, "rho": 0.5}]
    assert hot({"noise": more}) == pytest.approx(hot({"noise": white}), rel=1e-9)


def test_scr_includes_drift_since_the_last_correction() -> None:
    drift = {"kind": "drift", "pixel": 3.0, "column": 0.0, "row": 0.0, "time_constant_s": 30.0}
    camera = {"noise": [{"kind": "white"}, drift], "correction": {"frames": [2000]}}
    alone = hot({"noise": [{"kind": "white"}]})
    for index, age_s in ((0, 0.0), (900, 30.0), (2000, 0.0), (2900, 30.0)):
        grown = 9 * (1 - math.exp(-2 * age_s / 30))
        assert hot(camera, index) == pytest.approx(alone / math.sqrt(1 + grown), rel=1e-6)


def test_scr_of_a_frozen_frame_is_that_of_the_frame_shown() -> None:
    drift = {"kind": "drift", "pixel": 3.0, "column": 0.0, "row": 0.0, "time_constant_s": 30.0}
    camera = {"noise": [{"kind": "white"}, drift], "correction": {"frames": [2000], "freeze_frames": 10}}
    assert hot(camera, 2009) == pytest.approx(hot(camera, 1999), rel=1e-9)
    assert hot(camera, 2010) > 2 * hot(camera, 2009)


class Warming(Noise):
    """Noise of a user: its variance grows by that of one NETD a frame."""

    def variance_terms(self, frame_context: FrameContext, fixed: bool) -> NoiseVariance:
        return NoiseVariance(pixel=float(frame_context.index))


def test_scr_includes_noise_of_own_kinds_frame_by_frame() -> None:
    camera = {"noise": [{"kind": f"{__name__}:Warming"}]}
    assert hot(camera, 4) == pytest.approx(3 * hot(camera, 36), rel=1e-9)
