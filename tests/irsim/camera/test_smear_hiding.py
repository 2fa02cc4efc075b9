"""What is hidden while a frame is exposed: truth, pictures, masks and intents over the whole exposure."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from test_smear import RATE, at_instants, scene

import irsim
from irsim.render.frame import Renderer
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario

FRAME = {"time_ms": 1000 / RATE, "steps": 16}
BAR = {"kind": "bar", "center_px": (80.0, 50.0), "size_px": (21.0, 60.0), "range_m": 300.0, "temperature_k": 250.0}
"""Its left edge is that of pixel column 70."""
NEARER = {
    "shape": {"kind": "fighter"},
    "path": {"kind": "straight", "start": (50.0, 52.0), "speed": 9.0, "range_m": 900.0},
}


def body(size_m: float = 9.0, **path: Any) -> dict[str, Any]:
    way = {"kind": "straight", "start": (50.0, 50.0), "speed": 7.0, "range_m": 1500.0}
    return {"id": "one", "shape": {"kind": "hot_spot", "size_m": (size_m, size_m)}, "path": {**way, **path}}


def visible(scenario: Scenario, frame: int, name: str = "one") -> float:
    target = Renderer(scenario).scene(frame)[1].target(name)
    assert target is not None
    assert target.visible is not None
    return target.visible


@pytest.mark.parametrize("speed", [0.0, 3.0, 8.0])
def test_a_point_that_goes_behind_an_edge_is_as_visible_as_the_mean_over_its_way(speed: float) -> None:
    """Of a point blurred by s, the normal distribution at (edge - x) / s is left of the edge, at each instant; over a
    way from x0 to x1, with F(u) = u Phi(u) + phi(u), s (F(u0) - F(u1)) / (x1 - x0)."""
    s, edge, middle = 0.6, 69.5, 70.2

    def hidden_scene(steps: int) -> Scenario:
        path = {"kind": "straight", "start": (middle - 3 * speed, 50.0), "speed": speed, "range_m": 3000.0}
        point = {"id": "one", "shape": {"kind": "point", "area_m2": 0.001}, "path": path}
        return scene(smear={**FRAME, "steps": steps}, targets=[point], occluders=[BAR])

    def phi(x: float) -> float:
        return 0.5 * math.erfc((x - edge) / s / math.sqrt(2))

    steps = 16
    at = [phi(middle + speed * ((k + 0.5) / steps - 0.5)) for k in range(steps)]
    assert visible(hidden_scene(steps), 3) == pytest.approx(np.mean(at), abs=1e-4)
    if speed > 0:
        first, last = ((edge - middle + side * speed / 2) / s for side in (1, -1))
        whole = [
            u * 0.5 * math.erfc(-u / math.sqrt(2)) + math.exp(-(u**2) / 2) / math.sqrt(2 * math.pi)
            for u in (first, last)
        ]
        assert visible(hidden_scene(64), 3) == pytest.approx(s * (whole[0] - whole[1]) / speed, abs=1e-3)


def test_what_stays_behind_an_edge_while_the_camera_turns_is_hidden_as_if_it_stood() -> None:
    """Target and bar move by 6 px together: it stays hidden, and no light of it leaks past the streak of the bar."""
    pan = [{"kind": "pan", "azimuth_deg_s": 3 * RATE * 1e-3 * 180 / math.pi}]
    path = {"start": (80.5, 50.0), "speed": 0.0}

    def found(**given: Any) -> Scenario:
        return scene(smear=FRAME, motion=pan, occluders=[BAR], **given)

    assert visible(found(targets=[body(4.0, **path)]), 0) < 1e-6
    behind, empty = (Renderer(found(targets=each)).scene(0)[0] for each in ([body(4.0, **path)], []))
    np.testing.assert_allclose(behind, empty, rtol=1e-5)


@pytest.mark.parametrize("pan_deg_s", [0.0, 6.0])
@pytest.mark.parametrize("targets", [[body()], [body(), {"id": "two", **NEARER}]])
def test_a_frame_is_the_mean_of_its_scenes_also_where_one_moving_thing_hides_another(
    pan_deg_s: float, targets: list[dict[str, Any]]
) -> None:
    common: dict[str, Any] = {"targets": targets, "occluders": [BAR]}
    common["motion"] = [{"kind": "pan", "azimuth_deg_s": pan_deg_s}] if pan_deg_s else []
    sharp, smeared = scene(**common), scene(smear=FRAME, **common)
    light, truth = Renderer(smeared).scene(3)
    scenes = [way.scene(3) for way in at_instants(sharp, smeared)]
    np.testing.assert_allclose(light, np.mean([each for each, _ in scenes], axis=0), rtol=1e-5)
    for target in truth.targets:
        each = [found.visible for _, at in scenes if (found := at.target(target.id)) is not None]
        assert target.visible == pytest.approx(np.mean(np.array(each, float)), abs=1e-4)
    assert 0.01 < visible(smeared, 3) < 0.99
    assert abs(visible(smeared, 3) - visible(sharp, 3)) > 0.005


def test_clouds_before_a_target_hide_it_over_the_whole_exposure() -> None:
    sky = {"kind": "sky", "clouds": [{"range_m": 900.0, "coverage": 0.5, "depth": 2.0}]}
    common: dict[str, Any] = {
        "targets": [body()],
        "background": sky,
        "motion": [{"kind": "pan", "azimuth_deg_s": 12.0}],
    }
    sharp, smeared = scene(**common), scene(smear={**FRAME, "steps": 3}, **common)
    each = [way.scene(3)[1].targets[0].visible for way in at_instants(sharp, smeared)]
    assert np.ptp(np.array(each, float)) > 0.005
    assert visible(smeared, 3) == pytest.approx(np.mean(np.array(each, float)), abs=1e-5)


def test_masks_of_an_exposure_are_those_of_its_truth() -> None:
    scenario = scene(smear=FRAME, targets=[body(), {"id": "two", **NEARER}], occluders=[BAR])
    (found,), (truth,) = irsim.masks(scenario, 3, 4), Rendering(scenario).truths(3, 4)
    for target in truth.targets:
        mask = found[target.id]
        assert mask.visible.sum() / mask.area == pytest.approx(target.visible, abs=1e-9)
        assert np.all(mask.visible <= mask.whole + 1e-12)
        assert mask.whole.sum() / mask.area == pytest.approx(1, abs=1e-6)
    columns = np.flatnonzero(found["one"].whole.sum(axis=0) > 1e-3)
    sharp = next(irsim.masks(scene(targets=[body()]), 3, 4))["one"]
    still = np.flatnonzero(sharp.whole.sum(axis=0) > 1e-3)
    assert np.ptp(columns) - np.ptp(still) == pytest.approx(7 * 15 / 16, abs=1.1)


@pytest.mark.sampled
@pytest.mark.parametrize("motion", [[], [{"kind": "pan", "azimuth_deg_s": 2.0}]])
@pytest.mark.parametrize("kind", ["bar", "tree"])
def test_an_intent_hides_as_much_as_it_asks_over_the_whole_exposure(kind: str, motion: list[dict[str, Any]]) -> None:
    def shares(fraction: float) -> list[float]:
        screen = {"kind": kind, "range_m": 300.0, "hides": "one", "frames": [5, 6], "fraction": fraction}
        scenario = scene(
            smear={**FRAME, "steps": 4},
            motion=motion,
            frames=12,
            occluders=[screen],
            targets=[body(6.0, start=(30.0, 50.0), speed=8.0)],
        )
        return [visible(scenario, frame) for frame in (5, 6)]

    assert max(shares(1.0)) < 2e-3
    half = shares(0.5)
    assert max(half) <= 0.5 + 2e-3
    assert max(half) > 0.35


@pytest.mark.parametrize("kind", ["bird", "pedestrian", "quadrotor"])
def test_the_centroid_of_light_is_that_of_the_whole_exposure(kind: str) -> None:
    """Limbs that move and rotors that turn meanwhile do not keep it where it is in the middle."""
    path = {"kind": "straight", "start": (30.3, 40.2), "speed": 1.7, "range_m": 40.0}
    target = {"id": "one", "shape": {"kind": kind}, "path": path}
    renderer = Renderer(scene(smear=FRAME, targets=[target]))
    for frame in range(2, 6):
        (sprite,) = (piece.sprite for piece in renderer.pieces(frame, exactly=True) if piece.name == "one")
        rows, columns = np.indices(sprite.emission.shape)
        total = sprite.emission.sum()
        across = sprite.x0 + (columns * sprite.emission).sum() / total
        down = sprite.y0 + (rows * sprite.emission).sum() / total
        assert sprite.signal_center == pytest.approx((across, down), abs=0.01)
