"""Air before targets and occluders, for a moving camera."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from carried import scene

from irsim.physics.radiometry import radiance, temperature
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario

TROPICAL = {"preset": "tropical"}
HOT = {"kind": "hot_spot", "size_m": (400.0, 400.0), "temperature_k": 400.0, "emissivity": 1.0}
MIDDLE = (60, 80)
"""Row and column where all things of these tests are."""


def hot(start_m: tuple[float, float, float], velocity_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Any:
    path = {"kind": "straight_m", "axes": "world", "start_m": start_m, "velocity_m_s": velocity_m_s}
    return {"id": "hot", "shape": HOT, "path": path}


def level(velocity_m_s: tuple[float, float, float], altitude_m: float = 100.0, **changes: Any) -> Scenario:
    """The camera looks level, in the air of the tropics."""
    air = {**TROPICAL, "altitude_m": altitude_m}
    return scene(
        {"kind": "sky"}, velocity_m_s, camera={"elevation_deg": 0.0, "band": "lwir"}, atmosphere=air, **changes
    )


def kelvin(scenario: Scenario, frame: int = 60) -> float:
    """Apparent temperature in the middle of the picture."""
    return float(temperature("lwir", Renderer(scenario).scene(frame)[0][MIDDLE]))


@pytest.mark.parametrize("height_gain_m", [6000.0, -90.0])
def test_targets_have_the_air_at_the_camera_s_height(height_gain_m: float) -> None:
    """8 km away and level with it after two seconds of climb, as from a camera that always stood that high."""
    carried = level((0.0, 0.0, height_gain_m / 2), targets=[hot((0.0, 8000.0, height_gain_m))])
    standing = level((0.0, 0.0, 0.0), altitude_m=100.0 + height_gain_m, targets=[hot((0.0, 8000.0, 0.0))])
    assert kelvin(carried) == pytest.approx(kelvin(standing), abs=0.01)
    below = level((0.0, 0.0, 0.0), targets=[hot((0.0, 8000.0, 0.0))])
    assert abs(kelvin(carried) - kelvin(below)) > 0.05
    (truth,) = Renderer(carried).scene(60)[1].targets
    assert truth.range_m == pytest.approx(8000.0)


THINGS: dict[str, dict[str, Any]] = {
    "bar": {"center_px": (80, 60), "size_px": (20, 20), "temperature_k": 400.0, "emissivity": 1.0},
    "pole": {"foot_px": (80, 70), "height_px": 20.0, "width_px": 20.0, "temperature_k": 400.0, "emissivity": 1.0},
    "building": {
        "foot_px": (80, 70), "size_px": (20, 20), "windows": (0, 0), "temperature_k": 400.0, "emissivity": 1.0
    },
    "tree": {
        "foot_px": (80, 70), "height_px": 20.0, "crown_px": (18, 18), "temperature_k": 400.0, "spread_k": 0.0,
        "leaves": 1.0, "emissivity": 1.0,
    },
    "smoke": {"center_px": (80, 60), "size_px": (40, 40), "temperature_k": 400.0, "opacity": 0.999, "spread_k": 0.0},
}  # fmt: skip


@pytest.mark.parametrize("kind", THINGS)
def test_occluders_have_the_air_of_their_present_range(kind: str) -> None:
    """2 km away at first, 100 m after two seconds: as through 100 m of air."""
    thing = {"kind": kind, "range_m": 2000.0, **THINGS[kind]}
    near = level((0.0, 950.0, 0.0), occluders=[thing])
    tau, path = near.context.air.path("lwir", 100.0)
    expected = float(temperature("lwir", tau * radiance("lwir", 400.0) + path))
    assert expected == pytest.approx(395.7, abs=0.1)
    assert kelvin(near) == pytest.approx(expected, abs=0.1)
    assert kelvin(near, 0) == pytest.approx(353.7, abs=0.2)


def test_occluders_keep_their_order_of_first_ranges() -> None:
    """One 2 km and one 2.4 km from the first place, the farther drawn first, wherever the camera is."""
    bars = [
        {"kind": "bar", "id": f"at_{range_m:g}", "range_m": range_m, **THINGS["bar"], "temperature_k": kelvin_of}
        for range_m, kelvin_of in ((2000.0, 400.0), (2400.0, 250.0))
    ]
    passing = level((0.0, 800.0, 0.0), occluders=bars)
    assert kelvin(passing) > 380.0
    pieces = {piece.name: piece for piece in Renderer(passing).pieces(60)}
    assert [pieces[name].range_m for name in ("at_2000", "at_2400")] == [2000.0, 2400.0]
    assert [pieces[name].sprite.range_m for name in ("at_2000", "at_2400")] == pytest.approx([400.0, 800.0])


def test_a_platform_at_rest_changes_no_bit() -> None:
    """By a platform that does not carry it, and by none."""
    things = [{"kind": kind, "range_m": 2000.0, **keys} for kind, keys in THINGS.items()]
    carried = level((0.0, 0.0, 0.0), occluders=things, targets=[hot((0.0, 8000.0, 0.0))])
    camera = carried.camera.model_copy(update={"motion": ()})
    standing = carried.model_copy(update={"camera": camera})
    for frame in (0, 60):
        np.testing.assert_array_equal(Renderer(carried).scene(frame)[0], Renderer(standing).scene(frame)[0])
