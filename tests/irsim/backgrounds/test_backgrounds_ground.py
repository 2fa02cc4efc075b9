"""What lies on the ground: shares, sizes and counts asked for; day and night; switches."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import ndimage

from irsim.backgrounds import Ground, ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.clutter import Clutter
from irsim.backgrounds.ground_cover import Fields, Roads, Water
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.physics.radiometry import temperature
from irsim.render.stream import Rendering
from irsim.scenario.loader import dumps, loads
from irsim.scenario.model import Scenario

SIDE, PX_PER_MRAD = 512, 2.0


def context(size: tuple[int, int] = (160, 120)) -> SceneContext:
    return SceneContext(1, Geometry(size, 0.5e-3, math.radians(-30.0)), 30.0, "lwir", 0.0)


@pytest.mark.parametrize("share", [0.05, 0.3])
def test_water_covers_its_share(share: float) -> None:
    cover, kelvin = Water(share=share).paint((SIDE, SIDE), PX_PER_MRAD, -8.0, 1)
    assert cover.mean() == pytest.approx(share, abs=0.01)
    assert np.all(kelvin == -8)
    assert np.mean((cover > 0) & (cover < 1)) < 0.1  # shores are thin


def test_fields_are_of_the_size_and_spread_asked_for() -> None:
    sizes, spreads = [], []
    for seed in range(5):
        cover, kelvin = Fields(size_mrad=30, lane_mrad=2.0, lane_k=50.0).paint((SIDE, SIDE), PX_PER_MRAD, 3.0, seed)
        assert np.all(cover == 1)
        labels, count = ndimage.label(kelvin < 20)  # lanes part them
        areas = np.bincount(labels.ravel())[1:]
        sizes += [math.sqrt(area) / PX_PER_MRAD for area in areas if area > 25]
        spreads.append(
            float(np.std([np.median(kelvin[labels == i]) for i in range(1, count + 1) if areas[i - 1] > 25]))
        )
    assert 15 < np.median(sizes) < 45
    assert np.mean(spreads) == pytest.approx(3.0, rel=0.15)


def test_a_road_is_as_wide_as_asked_for() -> None:
    """Cover over length: a road of 8 px crosses the map; where it winds it is longer by a little."""
    cover, kelvin = Roads(count=2, width_mrad=4.0).paint((SIDE, SIDE), PX_PER_MRAD, 6.0, 3)
    assert set(np.unique(kelvin)) == {6.0}
    crossed = cover.sum() / SIDE  # px for each px of the map's side
    assert 8.0 <= crossed < 12.0


@pytest.mark.parametrize("per_mrad2", [0.001, 0.01])
def test_clutter_has_the_density_contrasts_and_share_of_cold_asked_for(per_mrad2: float) -> None:
    counts, covered, covered_by_cold = [], 0, 0
    for seed in range(8):
        cover, kelvin = Clutter(per_mrad2=per_mrad2, size_mrad=(2, 3), contrast_k=(4, 6), cold=0.25).paint(
            (SIDE, SIDE), PX_PER_MRAD, seed
        )
        _, count = ndimage.label(cover > 0.5)
        counts.append(count)
        found = np.abs(kelvin[cover > 0.5])
        assert 4 <= found.min() <= found.max() <= 6
        covered += found.size
        covered_by_cold += int(np.count_nonzero(kelvin[cover > 0.5] < 0))
    expected = per_mrad2 * (SIDE / PX_PER_MRAD) ** 2
    # Poisson over 8 maps; at the higher density some overlap and count as one.
    overlap = per_mrad2 * math.pi * 2.5**2 / 2
    assert np.mean(counts) == pytest.approx(expected, abs=4 * math.sqrt(expected / 8) + overlap * expected)
    # Cold and warm ones are of the same sizes, so cold ones cover their share: binomial over all things.
    assert covered_by_cold / covered == pytest.approx(0.25, abs=4 * math.sqrt(0.25 * 0.75 / (8 * expected)))


def test_clutter_is_as_long_as_asked_for_and_at_least_half_as_wide() -> None:
    """An even ellipse's variance along an axis is a quarter of its half axis squared; what overlaps or is cut by the
    map's edge is no even ellipse of its area, and is left out."""
    axes = []
    for seed in range(12):
        cover, _ = Clutter(per_mrad2=0.0002, size_mrad=(6, 12)).paint((SIDE, SIDE), PX_PER_MRAD, seed)
        labels, count = ndimage.label(cover > 0.5)
        for places in (np.argwhere(labels == number) for number in range(1, count + 1)):
            short, long = 4 * np.sqrt(np.linalg.eigvalsh(np.cov(places.T)))
            inner = places.min() > 0 and places.max() < SIDE - 1
            if inner and len(places) == pytest.approx(math.pi / 4 * short * long, rel=0.02):
                axes.append((short / PX_PER_MRAD, long / PX_PER_MRAD))
    shorts, longs = np.array(axes).T
    assert len(longs) > 100
    # A quarter of a mrad is half a pixel. The mean: evenly from 6 to 12, four standard errors.
    assert 6 - 0.25 < longs.min() < longs.max() < 12 + 0.25
    assert longs.mean() == pytest.approx(9, abs=4 * 6 / math.sqrt(12 * len(longs)))
    assert 0.5 - 0.05 < (shorts / longs).min() < 0.6


def test_no_clutter_where_its_density_is_zero() -> None:
    cover, _ = Clutter(per_mrad2=0).paint((SIDE, SIDE), PX_PER_MRAD, 1)
    assert not cover.any()


def test_day_and_night_change_places() -> None:
    """By day water is colder than the ground, by night warmer; keys that are given stay."""
    contrast = {}
    for hour in ("day", "night"):
        ground = Ground.model_validate({"hour": hour, "water": {"share": 0.2}})
        scene = context()
        terrain, water = ground.layers(scene)
        view_direction = ViewDirection(0.0, Chart.at(scene.geometry, scene.geometry.world_rotation(np.zeros(3))))
        passed, emission = water.light(view_direction)
        assert passed is not None
        contrast[hour] = float(temperature("lwir", emission[passed < 0.01].mean())) - ground.mean_k
        assert terrain.light(view_direction)[0] is None
    assert contrast == {"day": pytest.approx(-11.0, abs=0.1), "night": pytest.approx(5.0, abs=0.1)}
    assert Ground.model_validate({"hour": "day"}).mean_k == 303.0
    assert Ground.model_validate({"hour": "day", "mean_k": 310.0}).mean_k == 310.0
    assert Ground().mean_k == 290.0


def scenario(**keys: object) -> Scenario:
    background = {
        "kind": "ground",
        "hour": "day",
        "fields": {},
        "roads": {},
        "water": {},
        "clutter": {"per_mrad2": 0.01},
    }
    camera = {"size": (160, 120), "elevation_deg": -30.0, "netd_mk": 0.0}
    return Scenario.model_validate({"frames": 1, "camera": camera, "background": background, **keys})


def test_all_that_lies_on_the_ground_can_be_switched_off_by_name() -> None:
    names = ["fields", "water", "roads", "clutter"]
    assert [name for name, _ in scenario().background.names()] == names
    whole = Rendering(scenario()).frame(0).image
    for name in names:
        assert not np.array_equal(Rendering(scenario(without=[name])).frame(0).image, whole)
    bare = Rendering(scenario(without=list(names))).frame(0).image
    plain = scenario(background={"kind": "ground", "hour": "day"})
    assert np.array_equal(bare, Rendering(plain).frame(0).image)


def test_an_hour_survives_being_written_out() -> None:
    assert loads(dumps(scenario())) == scenario()
    assert np.array_equal(Rendering(loads(dumps(scenario()))).frame(0).image, Rendering(scenario()).frame(0).image)
