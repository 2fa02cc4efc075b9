"""Woods along the horizon of a landscape, behind its rows of trees."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from country import context, view_direction

from irsim.backgrounds import Landscape
from irsim.backgrounds.landscape import TerrainLayer
from irsim.physics.radiometry import temperature
from irsim.scenario.model import Scenario
from irsim.types import Floats

SCENE = context(size=(640, 240))
PX_PER_MRAD = 2.0
"""As the stage of these tests sees it."""
FEW: dict[str, Any] = {"trees": [{"range_m": 600.0, "spacing_m": 40.0, "undergrowth": 0.0, "temperature_k": 285.0}]}


def country(seed: int, **keys: Any) -> tuple[Floats, Floats]:
    """The farthest layer of a landscape, (rows, cols): the share that is sky, and temperature."""
    placed = replace(SCENE, seed=seed)
    layer = Landscape.model_validate({"ground_k": 300.0, "spread_k": 0.0, "horizon_k": 270.0, **keys}).layers(placed)[0]
    assert isinstance(layer, TerrainLayer)
    seen = view_direction(placed)
    light = np.asarray(layer.light(seen)[1])
    return np.asarray(layer.sky_share(seen)), np.asarray(temperature("lwir", light))


def edge(sky: Floats) -> Floats:
    """(cols,): how many rows from the top are sky."""
    return np.asarray(sky.sum(axis=0))


def unruly(line: Floats) -> Floats:
    """Of each 20 px of an edge, as wide as a gap of a tree line: how far, rms, it leaves the straight line nearest."""
    blocks = line.reshape(-1, 20).T
    columns = np.arange(20.0)
    slope, level = np.polyfit(columns, blocks, 1)
    return np.asarray((blocks - (level + columns[:, None] * slope)).std(axis=0))


def test_behind_rows_of_trees_the_ground_ends_in_no_straight_line() -> None:
    """Whatever the seed: a bare horizon is straight within a fifth of a pixel in most places."""
    for seed in range(5):
        bare, grown = (edge(country(seed, **FEW, **keys)[0]) for keys in ({"far_woods_mrad": 0.0}, {}))
        assert np.median(unruly(bare)) < 0.2
        assert np.median(unruly(grown)) > 0.4
        assert unruly(grown).min() > 0.1
        assert (bare - grown).min() > -1e-3  # they stand on it


def test_they_are_as_high_on_the_mean_as_they_are_said_to_be() -> None:
    high = np.mean([edge(country(seed)[0]) - edge(country(seed, far_woods_mrad=4.0)[0]) for seed in range(20)])
    assert high == pytest.approx(4.0 * PX_PER_MRAD, rel=0.2)


def test_they_are_as_warm_as_the_trees_before_them_and_the_ground_below_is_not() -> None:
    sky, kelvin = country(1, **{**FEW, "trees": [{**FEW["trees"][0], "spread_k": 0.0}]}, far_woods_mrad=4.0)
    bare, _ = country(1, **FEW, far_woods_mrad=0.0)
    woods = (bare > 0.999) & (sky < 1e-3)  # before what else were sky
    assert woods.sum() > 500
    np.testing.assert_allclose(kelvin[woods], 285.0, atol=0.2)
    rows = np.arange(len(sky))[:, None] - edge(bare)
    np.testing.assert_allclose(kelvin[rows > 20], 300.0, atol=0.05)


def test_without_rows_of_trees_and_switched_off_the_horizon_is_bare() -> None:
    assert Landscape().far_woods_mrad == 0
    assert Landscape.model_validate(FEW).far_woods_mrad == 1.5
    scene = {"frames": 1, "background": {"kind": "landscape", **FEW}}
    off = Scenario.model_validate({**scene, "without": ["far_woods"]})
    assert off.shown.background == Landscape.model_validate({**FEW, "far_woods_mrad": 0.0})


def test_what_lies_on_the_ground_does_not_lie_on_them() -> None:
    """Warm fields end where woods begin."""
    keys = {"fields": {"spread_k": 0.0, "lane_k": 30.0, "lane_mrad": 50.0}, "far_woods_mrad": 6.0}
    placed = replace(SCENE, seed=3)
    land = Landscape.model_validate({"hills_mrad": 0.0, **keys})
    fields = land.layers(placed)[1]
    bare = land.model_copy(update={"far_woods_mrad": 0.0}).layers(placed)[1]
    seen = view_direction(placed)
    passed, unhidden = (np.asarray(layer.light(seen)[0]) for layer in (fields, bare))
    horizon = int(np.argmax(unhidden[:, 100] < 0.5))
    assert passed[horizon + 1].mean() > 0.8
    assert unhidden[horizon + 1].mean() < 0.1
    assert passed[horizon + 40].max() < 1e-3


def test_the_bare_ground_of_a_landscape_has_none() -> None:
    """That which warnings ask for (`Background.land`)."""
    placed = replace(SCENE, seed=1)
    land = Landscape.model_validate({**FEW, "ground_k": 300.0, "spread_k": 0.0}).land(placed)
    np.testing.assert_allclose(temperature("lwir", land(view_direction(placed))), 300.0, atol=0.05)
