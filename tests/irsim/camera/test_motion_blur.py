"""Motion blur: streaks, visibility over the exposure, and what stays sharp."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import irsim
from irsim.render.frame import Renderer
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario
from irsim.types import Floats

RATE = 25.0
FRAME = {"time_ms": 1000 / RATE, "steps": 16}
BAR = {"kind": "bar", "center_px": (80.0, 50.0), "size_px": (21.0, 60.0), "range_m": 300.0, "temperature_k": 250.0}
"""Its left edge is that of pixel column 70."""
WALL = {**BAR, "center_px": (20.0, 50.0), "size_px": (80.0, 90.0), "range_m": 500.0, "temperature_k": 300.0}
GROUND = {"kind": "ground", "spread_k": 3.0}
SHORT = {"time_ms": 40.0, "steps": 4}
NEARER = {
    "shape": {"kind": "fighter"},
    "path": {"kind": "straight", "start": (50.0, 52.0), "speed": 9.0, "range_m": 900.0},
}


def scene(
    path: dict[str, Any] | None = None, smear: Any = None, motion: Any = (), detector: Any = None, **other: Any
) -> Scenario:
    way = {"kind": "straight", "start": (60.0, 50.0), "speed": 8.0, "heading_deg": 0.0, "range_m": 3000.0}
    camera = {"size": (160, 100), "netd_mk": 0.0, "rate_hz": RATE, "smear": smear, "motion": motion}
    return Scenario.model_validate(
        {
            "frames": 6,
            "camera": {**camera, "detector": detector or {"kind": "stated"}},
            "background": {"kind": "sky", "horizon_k": 20.0, "zenith_k": 20.0},
            "targets": [{"id": "one", "shape": {"kind": "point", "area_m2": 0.5}, "path": {**way, **(path or {})}}],
            **other,
        }
    )


def pan(deg_s: float) -> list[dict[str, Any]]:
    return [{"kind": "pan", "azimuth_deg_s": deg_s}]


def moments_of(light: Floats) -> tuple[float, float, float, float]:
    """Return centroid and variance of a picture's light, along x and along y."""
    rows, columns = np.indices(light.shape)
    weight = light.astype(np.float64) / light.sum(dtype=np.float64)
    x, y = float((weight * columns).sum()), float((weight * rows).sum())
    return x, y, float((weight * (columns - x) ** 2).sum()), float((weight * (rows - y) ** 2).sum())


def at_offsets(sharp: Scenario, blurred: Scenario) -> list[Renderer]:
    """Return a sharp scene at each of the times of which a frame of the blurred one is the mean."""
    renderers = []
    for instant in Renderer(blurred).trajectories(0).exposure:
        renderer = Renderer(sharp)
        renderer._trajectories = replace(renderer.trajectories(0), now=instant, exposure=(instant,))
        renderers.append(renderer)
    return renderers


def body(size_m: float = 9.0, **path: Any) -> dict[str, Any]:
    way = {"kind": "straight", "start": (50.0, 50.0), "speed": 7.0, "range_m": 1500.0}
    return {"id": "one", "shape": {"kind": "hot_spot", "size_m": (size_m, size_m)}, "path": {**way, **path}}


def visible(scenario: Scenario, frame: int, name: str = "one") -> float:
    target = Renderer(scenario).scene(frame)[1].target(name)
    assert target is not None
    assert target.visible is not None
    return target.visible


# Streaks


@pytest.mark.parametrize("time_ms", [5.0, 40.0])
def test_a_streak_is_as_long_as_speed_times_time(time_ms: float) -> None:
    """A line of length L has the variance L² / 12, n points evenly spread over it (1 - 1/n²) of that."""
    still = moments_of(Renderer(scene()).scene(3)[0])
    x, y, across, down = moments_of(Renderer(scene(smear={"time_ms": time_ms, "steps": 12})).scene(3)[0])
    length = 8.0 * RATE * time_ms * 1e-3
    assert across - still[2] == pytest.approx(length**2 / 12 * (1 - 1 / 144), abs=2e-3)
    assert down == pytest.approx(still[3], abs=1e-4)
    assert (x, y) == pytest.approx((84.0, 50.0), abs=0.01)


@pytest.mark.parametrize("keys", [{"occluders": [WALL]}, {"background": GROUND}], ids=["occluder", "background"])
def test_a_turning_camera_blurs_occluders_and_backgrounds(keys: Any) -> None:
    common: dict[str, Any] = {"targets": [], "motion": pan(6.0), **keys}
    sharp, blurred = (Renderer(scene(smear=smear, **common)).scene(2)[0] for smear in (None, SHORT))
    slopes = [np.diff(light[20:80].astype(np.float64), axis=1).std() for light in (sharp, blurred)]
    assert slopes[1] < 0.7 * slopes[0]
    assert blurred.mean() == pytest.approx(sharp.mean(), rel=0.01)


@pytest.mark.parametrize("smear", [{"time_ms": 0.0}, {"time_ms": 20.0, "steps": 1}])
def test_no_exposure_time_or_one_step_is_sharp(smear: Any) -> None:
    assert np.array_equal(Rendering(scene(smear=smear)).frame(3).image, Rendering(scene()).frame(3).image)


def test_truth_is_that_of_the_middle_of_the_exposure() -> None:
    (sharp,), (blurred,) = (Renderer(scene(smear=each)).scene(3)[1].targets for each in (None, {"time_ms": 30.0}))
    assert (blurred.center, blurred.box, blurred.velocity) == (sharp.center, sharp.box, sharp.velocity)
    assert blurred.contrast_k == pytest.approx(sharp.contrast_k, rel=1e-6)


def test_a_blurred_frame_alone_is_the_one_in_sequence() -> None:
    scenario = scene(smear={"time_ms": 30.0}, motion=[*pan(3.0), {"kind": "jitter"}])
    ordered = [frame.image for frame in Rendering(scenario).frames()]
    assert np.array_equal(Rendering(scenario).frame(4).image, ordered[4])


def test_the_exposure_defaults_to_the_integration_time() -> None:
    electrons = {"kind": "electrons", "integration_ms": 15.0}
    given, own = (scene(smear=smear, detector=electrons) for smear in ({"time_ms": 15.0}, {}))
    assert np.array_equal(Rendering(own).frame(4).image, Rendering(given).frame(4).image)


# Occlusion within the exposure


@pytest.mark.parametrize("speed", [0.0, 8.0])
def test_visibility_behind_an_edge_is_the_mean(speed: float) -> None:
    """Of a point blurred by s, the normal distribution at (edge - x) / s is left of the edge; over a path from x0 to
    x1, with F(u) = u Phi(u) + phi(u), s (F(u0) - F(u1)) / (x1 - x0)."""
    s, edge, middle = 0.6, 69.5, 70.2

    def occluded_scene(steps: int) -> Scenario:
        path = {"kind": "straight", "start": (middle - 3 * speed, 50.0), "speed": speed, "range_m": 3000.0}
        point = {"id": "one", "shape": {"kind": "point", "area_m2": 0.001}, "path": path}
        return scene(smear={**FRAME, "steps": steps}, targets=[point], occluders=[BAR])

    def phi(x: float) -> float:
        return 0.5 * math.erfc((x - edge) / s / math.sqrt(2))

    at = [phi(middle + speed * ((k + 0.5) / 16 - 0.5)) for k in range(16)]
    assert visible(occluded_scene(16), 3) == pytest.approx(np.mean(at), abs=1e-4)
    if speed > 0:
        first, last = ((edge - middle + side * speed / 2) / s for side in (1, -1))
        whole = [
            u * 0.5 * math.erfc(-u / math.sqrt(2)) + math.exp(-(u**2) / 2) / math.sqrt(2 * math.pi)
            for u in (first, last)
        ]
        assert visible(occluded_scene(64), 3) == pytest.approx(s * (whole[0] - whole[1]) / speed, abs=1e-3)


@pytest.mark.parametrize(
    ("deg_s", "targets"), [(0.0, [body()]), (6.0, [body(), {"id": "two", **NEARER}])], ids=["one", "two"]
)
def test_a_frame_is_the_mean_of_its_scenes(deg_s: float, targets: list[dict[str, Any]]) -> None:
    """Also where one moving object occludes another."""
    common: dict[str, Any] = {"targets": targets, "occluders": [BAR], "motion": pan(deg_s) if deg_s else []}
    sharp, blurred = scene(**common), scene(smear={**FRAME, "steps": 6}, **common)
    light, truth = Renderer(blurred).scene(3)
    scenes = [renderer.scene(3) for renderer in at_offsets(sharp, blurred)]
    np.testing.assert_allclose(light, np.mean([each for each, _ in scenes], axis=0), rtol=1e-5)
    for target in truth.targets:
        each = [found.visible for _, at in scenes if (found := at.target(target.id)) is not None]
        assert target.visible == pytest.approx(np.mean(np.array(each, float)), abs=1e-4)
    assert 0.01 < visible(blurred, 3) < 0.99
    assert abs(visible(blurred, 3) - visible(sharp, 3)) > 0.005


def test_masks_are_those_of_the_exposure() -> None:
    scenario = scene(smear=SHORT, targets=[body(), {"id": "two", **NEARER}], occluders=[BAR])
    (found,), (truth,) = irsim.masks(scenario, 3, 4), Rendering(scenario).truths(3, 4)
    for target in truth.targets:
        mask = found[target.id]
        assert mask.visible.sum() / mask.area == pytest.approx(target.visible, abs=1e-9)
        assert np.all(mask.visible <= mask.whole + 1e-12)
        assert mask.whole.sum() / mask.area == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("fraction", [0.5, 1.0])
def test_hides_covers_its_fraction_over_the_exposure(fraction: float) -> None:
    screen = {"kind": "bar", "range_m": 300.0, "hides": "one", "frames": [5, 5], "fraction": fraction}
    target = body(6.0, start=(30.0, 50.0), speed=8.0)
    scenario = scene(smear={**FRAME, "steps": 4}, frames=8, occluders=[screen], targets=[target])
    assert 1 - fraction - 2e-3 <= visible(scenario, 5) < 1 - fraction + 0.15


def test_the_centroid_is_that_of_the_exposure() -> None:
    """Limbs move within the exposure."""
    path = {"kind": "straight", "start": (30.3, 40.2), "speed": 1.7, "range_m": 40.0}
    targets = [{"id": "one", "shape": {"kind": "pedestrian"}, "path": path}]
    (sprite,) = (piece.sprite for piece in Renderer(scene(smear=SHORT, targets=targets)).pieces(3, exactly=True))
    rows, columns = np.indices(sprite.emission.shape)
    total = sprite.emission.sum()
    across = sprite.x0 + (columns * sprite.emission).sum() / total
    down = sprite.y0 + (rows * sprite.emission).sum() / total
    assert sprite.signal_center == pytest.approx((across, down), abs=0.01)
