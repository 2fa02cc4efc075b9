"""Smear while a frame is exposed: its length, its centre, and what it leaves alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from irsim.errors import Notice
from irsim.lint import doubts
from irsim.render.frame import Renderer
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario
from irsim.types import Floats

RATE = 25.0


def scene(
    path: dict[str, Any] | None = None, smear: Any = None, motion: Any = (), detector: Any = None, **other: Any
) -> Scenario:
    way = {"kind": "straight", "start": (60.0, 50.0), "speed": 8.0, "heading_deg": 0.0, "range_m": 3000.0}
    return Scenario.model_validate(
        {
            "frames": 6,
            "camera": {
                "size": (160, 100),
                "netd_mk": 0.0,
                "rate_hz": RATE,
                "smear": smear,
                "motion": motion,
                "detector": detector or {"kind": "stated"},
            },
            "background": {"kind": "sky", "horizon_k": 20.0, "zenith_k": 20.0},
            "targets": [{"id": "one", "shape": {"kind": "point", "area_m2": 0.5}, "path": {**way, **(path or {})}}],
            **other,
        }
    )


def spread_of(light: Floats) -> tuple[float, float, float, float]:
    """Centroid and variance of a picture's light, along x and along y."""
    rows, columns = np.indices(light.shape)
    weight = light.astype(np.float64) / light.sum(dtype=np.float64)
    x, y = float((weight * columns).sum()), float((weight * rows).sum())
    return x, y, float((weight * (columns - x) ** 2).sum()), float((weight * (rows - y) ** 2).sum())


def at_instants(sharp: Scenario, smeared: Scenario) -> list[Renderer]:
    """A scene as it is, without any smear, at each of the instants of which a frame of the smeared one is the mean."""
    ways = []
    for instant in Renderer(smeared).exposure:
        way = Renderer(sharp)
        way.now, way.exposure, way.courses = instant, [instant], instant.courses
        ways.append(way)
    return ways


def test_what_turns_may_reach_farthest_in_the_middle_of_the_exposure() -> None:
    """A rotor that lies across the edge of the picture in the middle, and along it at all of the steps."""
    path = {"kind": "straight", "start": (32.0, 24.0), "speed": 0.8, "heading_deg": -170.0, "range_m": 50.0}
    drone = {"id": "one", "shape": {"kind": "quadrotor"}, "path": path}
    camera = {"size": (64, 48), "ifov_mrad": 0.3, "rate_hz": 50.0}
    sharp, exposed = (
        scene(frames=70, targets=[drone], camera={**camera, "smear": smear}) for smear in (None, {"time_ms": 10.0})
    )
    smeared, ways = Renderer(exposed), at_instants(sharp, exposed)
    for frame in range(50, 70):
        (found,), each = (
            smeared.scene(frame)[1].targets,
            [way.scene(frame)[1].targets[0].visible or 0.0 for way in ways],
        )
        assert found.visible == pytest.approx(np.mean(each), abs=3e-4)


@pytest.mark.parametrize("time_ms", [5.0, 20.0, 40.0])
def test_a_streak_is_as_long_as_speed_times_time(time_ms: float) -> None:
    """A line of length L has the variance L^2 / 12, n points evenly spread over it (1 - 1/n^2) of that."""
    still = spread_of(Renderer(scene()).scene(3)[0])
    x, y, across, down = spread_of(Renderer(scene(smear={"time_ms": time_ms, "steps": 12})).scene(3)[0])
    length = 8.0 * RATE * time_ms * 1e-3
    assert across - still[2] == pytest.approx(length**2 / 12 * (1 - 1 / 144), abs=2e-3)
    assert down == pytest.approx(still[3], abs=1e-4)
    assert (x, y) == pytest.approx((84.0, 50.0), abs=0.01)


def test_a_turning_camera_smears_what_stands() -> None:
    """1.5 deg/s past an IFOV of 0.5 mrad: 2.09 px a frame; half of a frame's time is 1.05 px."""
    way = {"speed": 0.0}
    pan = [{"kind": "pan", "azimuth_deg_s": 1.5}]
    sharp = spread_of(Renderer(scene(way, motion=pan)).scene(2)[0])
    found = spread_of(Renderer(scene(way, {"time_ms": 20.0}, pan)).scene(2)[0])
    length = np.radians(1.5) / RATE / 0.5e-3 / 2
    assert found[2] - sharp[2] == pytest.approx(length**2 / 12 * (1 - 1 / 64), rel=0.02)


def test_a_turning_camera_smears_the_background_and_what_stands_before_it() -> None:
    bar = {"kind": "bar", "center_px": (20.0, 50.0), "size_px": (80.0, 90.0), "range_m": 500.0, "temperature_k": 300.0}
    pan = [{"kind": "pan", "azimuth_deg_s": 6.0}]
    common: dict[str, Any] = {"targets": [], "motion": pan}
    ground = {"kind": "ground", "spread_k": 3.0}
    for given in ({"occluders": [bar]}, {"background": ground}):
        sharp, smeared = (
            Renderer(scene(smear=smear, **common, **given)).scene(2)[0] for smear in (None, {"time_ms": 40.0})
        )
        slopes = [np.diff(light[20:80].astype(np.float64), axis=1).std() for light in (sharp, smeared)]
        assert slopes[1] < 0.7 * slopes[0]
        assert smeared.mean() == pytest.approx(sharp.mean(), rel=0.01)


def test_what_stands_before_a_camera_that_stands_is_not_smeared() -> None:
    common: dict[str, Any] = {"path": {"speed": 0.0}, "background": {"kind": "ground", "spread_k": 3.0}}
    sharp, smeared = (Renderer(scene(smear=smear, **common)).scene(2)[0] for smear in (None, {"time_ms": 40.0}))
    np.testing.assert_allclose(smeared, sharp, rtol=1e-6)


@pytest.mark.parametrize("smear", [{"time_ms": 0.0}, {"time_ms": 20.0, "steps": 1}])
def test_benign_values_change_nothing(smear: Any) -> None:
    assert np.array_equal(Rendering(scene(smear=smear)).frame(3).image, Rendering(scene()).frame(3).image)


def test_truth_is_that_of_the_middle_of_the_exposure() -> None:
    (sharp,), (smeared,) = (Renderer(scene(smear=each)).scene(3)[1].targets for each in (None, {"time_ms": 30.0}))
    assert (smeared.center, smeared.box, smeared.velocity) == (sharp.center, sharp.box, sharp.velocity)
    assert smeared.visible == sharp.visible
    assert smeared.contrast_k is not None
    assert sharp.contrast_k is not None
    assert smeared.contrast_k == pytest.approx(sharp.contrast_k, rel=1e-6)


def test_a_frame_alone_is_that_of_the_sequence() -> None:
    scenario = scene(smear={"time_ms": 30.0}, motion=[{"kind": "pan", "azimuth_deg_s": 3.0}, {"kind": "jitter"}])
    ordered = [frame.image for frame in Rendering(scenario).frames()]
    assert np.array_equal(Rendering(scenario).frame(4).image, ordered[4])


def test_an_exposure_longer_than_a_frame_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"41.0 ms do not fit into a frame at 25.0 Hz; allowed: at most 40 ms"):
        scene(smear={"time_ms": 41.0})


def test_the_detector_says_how_long_it_is_exposed() -> None:
    electrons = {"kind": "electrons", "integration_ms": 15.0}
    given, own = (scene(smear=smear, detector=electrons) for smear in ({"time_ms": 15.0}, {}))
    assert np.array_equal(Rendering(own).frame(4).image, Rendering(given).frame(4).image)
    with pytest.raises(ValidationError, match="it is missing; allowed: a time in ms; or a detector of kind electrons"):
        scene(smear={})


@pytest.mark.parametrize(
    ("path", "motion", "who"),
    [
        ({}, [], "one"),
        ({"speed": 0.0}, [{"kind": "pan", "azimuth_deg_s": 8 * RATE * 0.5e-3 * 180 / np.pi}], "the background"),
    ],
)
def test_beads_are_warned_of(path: dict[str, Any], motion: Any, who: str) -> None:
    """8 px a frame, all of it exposed: 2 px from step to step of 4, and 7 steps (8 / 1.2) are enough."""
    smear = {"time_ms": 1000 / RATE, "steps": 4}

    def warned(**changed: Any) -> list[Notice]:
        notices = doubts(scene(path, {**smear, **changed.pop("smear", {})}, motion, **changed))
        return [notice for notice in notices if notice.at == ("camera", "smear", "steps")]

    (told,) = warned()
    assert told.message.endswith("a streak takes steps: 7")
    if who == "one":
        assert "frame 1 one moves by 2.0 px" in told.message
    assert warned(smear={"steps": 7}) == []
    assert warned(without=["smear"]) == []
