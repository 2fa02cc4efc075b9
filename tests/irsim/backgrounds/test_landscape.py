"""Landscapes: the horizon, occlusion by trees and buildings, relief and parallax."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from country import context, view_direction

from irsim.backgrounds import Landscape
from irsim.backgrounds.panorama import PanoramaGrid
from irsim.backgrounds.structures import Buildings, Structure
from irsim.backgrounds.trees import Trees
from irsim.physics.radiometry import temperature
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario
from irsim.types import Floats


def test_above_the_horizon_is_sky_and_below_it_ground() -> None:
    """At 0.5 mrad a px and 1 degree up, the horizon lies 34.9 px below the middle row 60."""
    scene = context()
    country = Landscape(hills_mrad=0, ground_k=300, spread_k=0, horizon_k=280, zenith_k=280).layers(scene)[0]
    kelvin = temperature("lwir", country.light(view_direction(scene))[1][:, 80])
    row = 60 + math.radians(1.0) / 0.5e-3
    assert kelvin[: int(row)] == pytest.approx(280, abs=0.01)
    assert kelvin[int(row) + 3 :] == pytest.approx(300, abs=0.01)


def test_the_ground_hides_clouds_and_trees_hide_both() -> None:
    clouds = ({"id": "low", "coverage": 0.999, "depth": 100.0, "temperature_k": 260.0, "range_m": 3000.0},)
    trees = ({"id": "wood", "range_m": 400.0, "leaves": 1.0, "spacing_m": 2.0},)
    land = Landscape.model_validate({"clouds": clouds, "trees": trees, "hills_mrad": 0.0, "ground_k": 300.0})
    scene = context()
    country, cloud, wood = land.layers(scene)
    assert [name for name, _ in land.names()] == ["low", "wood"]
    assert cloud.range_m > wood.range_m
    seen = view_direction(scene)
    country.light(seen)
    passed, emission = cloud.light(seen)
    assert passed is not None
    assert passed[98:].min() == 1  # below the horizon at row 94.9
    assert emission[98:].max() == 0
    assert passed[:93].mean() < 0.1
    wooded, _ = wood.light(seen)
    assert wooded is not None
    # 14 m at 400 m is 70 px; the foot is 10 m below the eye, 50 px below the horizon.
    assert wooded[:20].min() == 1
    assert wooded[100:118].mean() < 0.1


def test_a_row_of_trees_has_its_height_and_foot() -> None:
    scene = context(size=(320, 240))
    layer = Trees(range_m=1000, height_m=20, spacing_m=3, leaves=1, undergrowth=0.3).paint(
        PanoramaGrid.of(scene.geometry), 10.0, 290.0, scene
    )
    passed, emission = layer.light(view_direction(scene))
    foot = 119.5 + (math.radians(1.0) + math.atan(10 / 1000)) / 0.5e-3
    covered = np.flatnonzero((1 - passed).mean(axis=1) > 0.02)
    assert covered[-1] == pytest.approx(foot, abs=1.5)
    # 20 m is 40 px; of many trees, sd 25 %, the highest are about 1.6 times that.
    assert 40 < foot - covered[0] < 68
    solid = passed < 0.01
    kelvin = temperature("lwir", emission[solid])
    assert kelvin.mean() == pytest.approx(290, abs=1.5)
    assert 0.3 < kelvin.std() < 2.5


def test_buildings_have_walls_and_warm_windows() -> None:
    scene = context(size=(320, 240))
    layer = Buildings(range_m=500, spread_k=0, windows_k=5, spacing_m=30).paint(
        PanoramaGrid.of(scene.geometry), 10, 290.0, scene
    )
    passed, emission = layer.light(view_direction(scene))
    kelvin = temperature("lwir", emission[passed < 1e-6])
    assert np.median(kelvin) == pytest.approx(290, abs=0.2)
    assert kelvin.max() > 293
    assert kelvin.min() < 287  # roofs


def test_near_trees_have_more_parallax() -> None:
    """1 m to the right at 500 m is 4 px to the left at 0.5 mrad; at 2000 m, 1 px."""
    scene = context(size=(320, 240))
    for range_m, shift in ((500.0, 4), (2000.0, 1)):
        layer = Trees(range_m=range_m).paint(PanoramaGrid.of(scene.geometry), 10.0, 290.0, scene)
        still, moved = layer.light(view_direction(scene))[0], layer.light(view_direction(scene, (1.0, 0.0, 0.0)))[0]
        np.testing.assert_allclose(moved[:, 40:-40], still[:, 40 + shift : -40 + shift], rtol=0, atol=0.05)


def test_ground_moves_with_its_distance() -> None:
    """From 10 m up, the ground 20 mrad below the horizon is 500 m away: 1 m to the right moves it by 4 px."""
    scene = context(elevation_deg=0.0, size=(321, 121))
    land = Landscape(hills_mrad=0, correlation_mrad=20, spread_k=5, camera_height_m=10)
    country = land.layers(scene)[0]
    still, moved = (country.light(view_direction(scene, (x, 0.0, 0.0)))[1] for x in (0.0, 1.0))
    row = 60 + round(math.tan(0.02) / 0.5e-3)
    best = min(range(-12, 13), key=lambda s: np.abs(moved[row, 40:-40] - np.roll(still[row], -s)[40:-40]).sum())
    assert best == 4
    assert np.allclose(moved[:55], still[:55])


def test_truth_names_the_trees_that_occlude_a_target() -> None:
    targets = [
        {
            "id": name,
            "shape": {"kind": "point", "area_m2": 1.0},
            "path": {"kind": "straight", "start": (80.0, 85.0), "speed": 0.0, "range_m": range_m},
        }
        for name, range_m in (("near", 300.0), ("far", 2000.0))
    ]
    land = {"kind": "landscape", "trees": [{"id": "wood", "range_m": 600.0, "leaves": 1.0, "spacing_m": 1.0}]}
    camera = {"size": (160, 120), "elevation_deg": 0.5}
    scene = Scenario.model_validate({"frames": 1, "camera": camera, "background": land, "targets": targets})
    near, far = next(iter(Rendering(scene).truths())).targets
    assert near.visible == pytest.approx(1, abs=1e-6)
    assert far.visible == pytest.approx(0, abs=0.05)
    assert far.occluders == ("wood", "near")


SCENE = context(size=(640, 240))
PX_PER_M = 1 / (1000 * 0.5e-3)
"""Of a row 1000 m away."""


def lowest(row: Structure, seed: int) -> Floats:
    """Return the lowest covered row of each column, without columns that contain eaves only."""
    placed = replace(SCENE, seed=seed)
    layer = row.paint(PanoramaGrid.of(placed.geometry), 10.0, 290.0, placed)  # type: ignore[attr-defined]
    covered = np.asarray(layer.light(view_direction(placed))[0]) < 0.5
    rows = np.asarray(len(covered) - 1 - np.argmax(covered[::-1], axis=0))[covered.any(axis=0)]
    return np.asarray(rows[rows > np.median(rows) - 20])


ROWS: list[tuple[type[Structure], dict[str, Any]]] = [
    (Trees, {"range_m": 1000.0, "spacing_m": 8.0, "undergrowth": 0.3, "leaves": 1.0}),
    (Buildings, {"range_m": 1000.0, "spacing_m": 25.0, "height_m": (25.0, 30.0)}),
]


@pytest.mark.parametrize(("kind", "keys"), ROWS)
def test_feet_have_the_standard_deviation_of_the_relief(kind: type[Structure], keys: dict[str, Any]) -> None:
    level = lowest(kind(**keys), 0)
    assert np.ptp(level) <= 2
    rows = np.concatenate([lowest(kind(**keys, relief_m=3.0), seed) for seed in range(2)])
    # Within 320 m the ground's waves show most of their height.
    assert rows.std() == pytest.approx(3.0 * PX_PER_M, rel=0.3)
    assert rows.mean() == pytest.approx(level.mean(), abs=3.0 * PX_PER_M)
