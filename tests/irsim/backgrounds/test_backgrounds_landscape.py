"""Landscapes: the horizon, what hides what, parallax, switches."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from country import context, view_direction

from irsim.backgrounds import Landscape
from irsim.backgrounds.panorama import Cylinder, PanoramaGrid, seen_from
from irsim.backgrounds.structures import Buildings
from irsim.backgrounds.trees import Trees
from irsim.geometry.projection import Geometry
from irsim.geometry.random_fields import profile
from irsim.physics.radiometry import radiance, temperature
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario


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


def test_a_tree_row_is_as_high_as_its_trees_and_stands_on_the_ground() -> None:
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


def test_a_tree_that_is_far_larger_than_the_picture_fills_it() -> None:
    """At 2 m each px is 1 mm: trees of 14 m stand 14000 px high, and the picture shows the middle of a crown."""
    scene = context(size=(320, 240))
    trees = Trees(range_m=2, leaves=1, spacing_m=0.5, conifers=0)
    passed, _ = trees.paint(PanoramaGrid.of(scene.geometry), 7.0, 290.0, scene).light(view_direction(scene))
    assert passed.mean() < 0.05


def test_a_wood_has_crowns_of_unequal_height() -> None:
    """Trees 4 m apart and 18 m high, 0.5 mrad a px at 600 m: of 60 px, 13 px apart. Their tops rise and fall by a
    quarter; one dome over all would not."""
    scene = context(size=(512, 240))
    for seed in range(4):
        placed = replace(scene, seed=seed)
        layer = Trees(range_m=600, height_m=18, spacing_m=4).paint(PanoramaGrid.of(scene.geometry), 4.0, 290.0, placed)
        solid = layer.light(view_direction(scene))[0] < 0.5
        top = np.argmax(solid, axis=0)[solid.any(axis=0)]
        level = cv2.blur(top.astype(np.float32)[None], (9, 1))[0]
        peaks = np.flatnonzero((level[1:-1] < level[:-2]) & (level[1:-1] <= level[2:]))
        assert len(peaks) >= 512 / 60
        assert level.std() > 0.12 * 60


def test_bare_trees_let_more_through_than_leafy_ones() -> None:
    scene = context(size=(320, 240))
    sheet = PanoramaGrid.of(scene.geometry)
    shares = [
        Trees(leaves=leaves, undergrowth=0).paint(sheet, 10.0, 290.0, scene).light(view_direction(scene))[0].mean()
        for leaves in (1.0, 0.7, 0.3)
    ]
    assert shares[0] < shares[1] < shares[2]


def test_without_undergrowth_only_trunks_meet_the_ground() -> None:
    scene = context(size=(320, 240))
    trees = Trees(range_m=300, spacing_m=40, leaves=1, undergrowth=0)
    passed, _ = trees.paint(PanoramaGrid.of(scene.geometry), 10.0, 290.0, scene).light(view_direction(scene))
    foot = round(119.5 + (math.radians(1.0) + math.atan(10 / 300)) / 0.5e-3)
    assert (1 - passed[foot - 3 : foot + 2]).mean() < 0.1


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "near",
    [
        Trees(range_m=0.001, height_m=1000, conifers=1),
        Trees(range_m=0.001, height_m=1e6),
        Buildings(range_m=0.001, width_m=(100, 100), height_m=(100, 100)),
    ],
)
def test_what_is_far_larger_than_it_is_far_away_fills_the_picture(near: Trees | Buildings) -> None:
    """Up to 2e12 px high, of one temperature but for its grain, before a country of another."""
    scene = context()
    passed, emission = near.paint(PanoramaGrid.of(scene.geometry), 10.0, 310.0, scene).light(view_direction(scene))
    assert passed is not None
    assert np.asarray(passed).max() < 1e-6
    assert np.asarray(emission).mean() == pytest.approx(float(radiance("lwir", 310.0)), rel=0.1)


def test_buildings_stand_no_nearer_to_each_other_than_is_seen() -> None:
    """20 km away a quarter of a pixel, 1 mrad wide, is 5 m."""
    scene = replace(context(), geometry=Geometry((161, 121), 1e-3, math.radians(-0.2)))
    nearest, nearer = (
        Buildings(range_m=20e3, spacing_m=spacing_m, width_m=(4, 4), height_m=(20, 20))  # too narrow for windows
        .paint(PanoramaGrid.of(scene.geometry), 50.0, 290.0, scene)
        .light(view_direction(scene))
        for spacing_m in (5, 1)
    )
    for one, other in zip(nearest, nearer, strict=True):
        np.testing.assert_array_equal(one, other)
    assert np.asarray(nearest[0]).min() < 0.5  # there they are


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


@pytest.mark.parametrize("place", [(30.0, 0.0, 0.0), (0.0, -5.0, 0.0), (0.0, 0.0, 200.0), (-12.0, 3.0, 90.0)])
def test_parallax_is_that_of_points_at_the_range(place: tuple[float, float, float]) -> None:
    """A point of the cylinder, seen from both places by plain geometry."""
    scene, range_m = context(elevation_deg=2.0), 800.0
    moved = seen_from(view_direction(scene, place), Cylinder(range_m)).chart
    first = view_direction(scene).chart
    unit, squeeze = 0.5e-3, math.cos(math.radians(2.0))
    for row, column in ((0, 0), (5, 3), (7, 7)):
        azimuth, height = (
            moved.u[row, column] * unit / squeeze,
            range_m * math.tan(moved.elevation_rad(moved.v[row, column])),
        )
        point = np.array([range_m * math.sin(azimuth), -height, range_m * math.cos(azimuth)]) - place
        assert math.atan2(point[0], point[2]) == pytest.approx(first.u[row, column] * unit / squeeze, abs=1e-9)
        seen = math.atan2(-point[1], math.hypot(point[0], point[2]))
        assert seen == pytest.approx(float(first.elevation_rad(first.v[row, column])), abs=1e-9)


def test_a_moved_camera_sees_near_things_pass_far_ones() -> None:
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


def test_turning_right_moves_all_to_the_left() -> None:
    scene = context(size=(321, 121))
    land = Landscape.model_validate({"trees": [{"range_m": 500.0}], "fields": {}})
    for layer in land.layers(scene):
        still, turned = (layer.light(view_direction(scene, turn=(angle, 0, 0)))[1] for angle in (0.0, 4e-3))
        assert np.abs(turned[:, 20:-28] - still[:, 28:-20]).max() < 0.15 * np.ptp(still)


def scenario(**keys: Any) -> Scenario:
    land = {
        "kind": "landscape", "hour": "night", "fields": {}, "clutter": {"per_mrad2": 0.02},
        "roads": {"count": 9}, "water": {"share": 0.4},
        "clouds": [{"coverage": 0.6, "evolve_s": 10.0}], "trees": [{}], "buildings": [{}],
    }  # fmt: skip
    camera = {"size": (160, 120), "elevation_deg": 0.5, "netd_mk": 0.0}
    return Scenario.model_validate({"frames": 3, "camera": camera, "background": land, **keys})


def test_all_but_the_country_can_be_switched_off_by_name() -> None:
    """And is gone then: see test_switches.py."""
    names = ["fields", "water", "roads", "clutter", "clouds", "trees", "buildings"]
    assert [name for name, _ in scenario().background.names()] == names


def test_a_target_behind_the_trees_is_hidden_and_truth_says_by_whom() -> None:
    targets = [
        {
            "id": name,
            "shape": {"kind": "point", "area_m2": 1.0},
            "path": {"kind": "straight", "start": (80.0, 85.0), "speed": 0.0, "range_m": range_m},
        }
        for name, range_m in (("near", 300.0), ("far", 2000.0))
    ]
    land = {"kind": "landscape", "trees": [{"id": "wood", "range_m": 600.0, "leaves": 1.0, "spacing_m": 1.0}]}
    truth = next(iter(Rendering(scenario(background=land, targets=targets)).truths()))
    near, far = truth.target("near"), truth.target("far")
    assert near is not None
    assert far is not None
    assert near.visible == pytest.approx(1, abs=1e-6)
    assert far.visible == pytest.approx(0, abs=0.05)
    assert far.occluders == ("wood", "near")  # both lie before it


def test_a_profile_has_the_slope_of_a_cut_through_a_field() -> None:
    """The cut through a 2-D spectrum f^-beta has the slope beta - 1."""
    power = np.mean([np.abs(np.fft.rfft(profile(1024, 3.0, 1e6, s, "t"))) ** 2 for s in range(40)], axis=0)
    f = np.arange(513) / 1024
    kept = (f > 4 / 1024) & (f < 0.2)
    assert np.polyfit(np.log(f[kept]), np.log(power[kept]), 1)[0] == pytest.approx(-2.0, abs=0.1)


def test_without_a_move_nothing_is_moved() -> None:
    scene = context()
    here = view_direction(scene)
    assert seen_from(here, Cylinder(500.0)) is here
    keyed = replace(here, key=view_direction(scene))
    assert seen_from(keyed, Cylinder(500.0)) is keyed
