"""Ground cover: shares, sizes and counts of fields, roads, water and clutter; day and night; switches."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
import pytest
from scipy import ndimage

from irsim.backgrounds import Ground, ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.clutter import Clutter, ClutterObject, FormName, RoughForm
from irsim.backgrounds.ground_cover import Fields, Roads, Water
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.vegetation import LIGHT
from irsim.physics.radiometry import temperature
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario

SIDE, PX_PER_MRAD = 512, 2.0


@pytest.mark.parametrize("share", [0.05, 0.3])
def test_water_covers_its_share(share: float) -> None:
    cover, kelvin = Water(share=share).paint((SIDE, SIDE), PX_PER_MRAD, -8.0, 1)
    assert cover.mean() == pytest.approx(share, abs=0.01)
    assert np.all(kelvin == -8)
    assert np.mean((cover > 0) & (cover < 1)) < 0.1  # shores are thin


def test_fields_have_their_size_and_spread() -> None:
    sizes, spreads = [], []
    for seed in range(3):
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


def test_a_road_has_its_width() -> None:
    """Cover over length: a road of 8 px crosses the map, slightly longer where it winds."""
    cover, kelvin = Roads(count=2, width_mrad=4.0).paint((SIDE, SIDE), PX_PER_MRAD, 6.0, 3)
    assert set(np.unique(kelvin)) == {6.0}
    crossed = cover.sum() / SIDE  # px for each px of the map's side
    assert 8.0 <= crossed < 12.0


def test_clutter_has_its_density_contrast_and_cold_share() -> None:
    per_mrad2 = 0.005
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
    # Cold and warm objects have the same sizes, so cold ones cover their share: binomial over all objects.
    assert covered_by_cold / covered == pytest.approx(0.25, abs=4 * math.sqrt(0.25 * 0.75 / (8 * expected)))


@pytest.mark.parametrize(("hour", "contrast_k"), [("day", -11.0), ("night", 5.0)])
def test_water_is_cold_by_day_and_warm_by_night(hour: str, contrast_k: float) -> None:
    ground = Ground.model_validate({"hour": hour, "water": {"share": 0.2}})
    scene = SceneContext(1, Geometry((160, 120), 0.5e-3, math.radians(-30.0)), 30.0, "lwir", 0.0)
    _, water = ground.layers(scene)
    chart = Chart.at(scene.geometry, scene.geometry.world_rotation(np.zeros(3)))
    transmittance, emission = water.light(ViewDirection(0.0, chart))
    assert transmittance is not None
    kelvin = float(temperature("lwir", emission[transmittance < 0.01].mean()))
    assert kelvin - ground.mean_k == pytest.approx(contrast_k, abs=0.1)
    assert Ground.model_validate({"hour": hour, "mean_k": 310.0}).mean_k == 310.0


def scenario(**keys: object) -> Scenario:
    cover = {"fields": {}, "roads": {}, "water": {}, "clutter": {"per_mrad2": 0.01}}
    camera = {"size": (160, 120), "elevation_deg": -30.0, "netd_mk": 0.0}
    background = {"kind": "ground", "hour": "day", **cover}
    return Scenario.model_validate({"frames": 1, "camera": camera, "background": background, **keys})


def test_ground_cover_is_switched_off_by_name() -> None:
    names = ["fields", "water", "roads", "clutter"]
    assert [name for name, _ in scenario().background.names()] == names
    plain = scenario(background={"kind": "ground", "hour": "day"})
    whole, bare, plain_image = (Rendering(each).frame(0).image for each in (scenario(), scenario(without=names), plain))
    assert np.array_equal(bare, plain_image)
    assert not np.array_equal(whole, bare)


def test_clutter_has_its_mean_overlap() -> None:
    clutter = Clutter(per_mrad2=0.001, size_mrad=(3.0, 12.0))
    covers = np.mean([clutter.paint((SIDE, SIDE), PX_PER_MRAD, seed)[0].mean() for seed in range(8)])
    assert -math.log(1 - covers) == pytest.approx(clutter.deep, rel=0.1)


def test_rough_clutter_covers_as_much_as_ellipses() -> None:
    shares = []
    for seed in range(4):
        ellipses, rough = (
            Clutter(form=form, size_mrad=(5.0, 12.0)).paint((SIDE, SIDE), PX_PER_MRAD, seed)[0]
            for form in get_args(FormName)
        )
        assert np.corrcoef(ellipses.ravel(), rough.ravel())[0, 1] > 0.75
        shares.append((ellipses.mean(), rough.mean()))
    even, ragged = np.mean(shares, axis=0)
    assert ragged == pytest.approx(even, rel=0.05)


@pytest.mark.parametrize("contrast_k", [5.0, -5.0])
def test_rough_clutter_has_its_mean_and_a_lit_side(contrast_k: float) -> None:
    spreads, tilts, form = [], [], RoughForm(7)
    for number in range(20):
        thing = ClutterObject((40.3, 50.6), 0.3 * number, 20.0, 14.0, contrast_k)
        columns, rows, cover, kelvin = form.drawn(thing)
        assert np.average(kelvin, weights=cover) == pytest.approx(contrast_k, abs=1e-5)
        spreads.append(math.sqrt(float(np.average((kelvin - contrast_k) ** 2, weights=cover))))
        side = (columns - 40.3) * LIGHT[0] + (rows - 50.6)[:, None] * LIGHT[1]
        tilts.append(float(np.average(side * (kelvin - contrast_k), weights=cover)))
    assert 0.2 * 5 < np.mean(spreads) < 0.6 * 5
    assert np.mean(tilts) > 0
    assert np.mean(np.array(tilts) > 0) > 0.8
