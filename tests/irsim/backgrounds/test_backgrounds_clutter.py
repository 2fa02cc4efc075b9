"""Forms of clutter: rough things are where ellipses are, as large and as warm in the mean, but ragged and uneven."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import cv2
import numpy as np
import pytest
from country import context, view_direction

from irsim.backgrounds import Landscape
from irsim.backgrounds.clutter import FORMS, Clutter, ClutterObject, FormName, RoughForm
from irsim.geometry.vegetation import LIGHT
from irsim.rng import stream
from irsim.types import Floats

SHAPE, PX_PER_MRAD = (512, 512), 2.0
FORM_NAMES = tuple(FORMS)


def painted(form: FormName, seed: int, per_mrad2: float = 0.002) -> tuple[Floats, Floats]:
    things = Clutter(form=form, per_mrad2=per_mrad2, size_mrad=(5.0, 12.0), contrast_k=(4.0, 6.0), cold=0.25)
    return things.paint(SHAPE, PX_PER_MRAD, seed)


def test_every_form_that_may_be_named_is_in_the_table() -> None:
    assert set(get_args(FormName)) == set(FORMS)


@pytest.mark.parametrize("form", FORM_NAMES)
def test_things_that_are_worked_out_together_are_those_drawn_one_by_one(form: FormName) -> None:
    """From under a pixel to a tenth of the map, over its edges and over one another."""
    clutter = Clutter(form=form, per_mrad2=0.5, size_mrad=(0.2, 16.0), contrast_k=(2.0, 6.0), cold=0.3)
    high, wide = shape = (96, 128)
    draw, drawn = stream(3, "clutter"), FORMS[form](3)
    cover, kelvin = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for _ in range(draw.poisson(0.5 * (high / 2.0 * (wide / 2.0)))):
        x, y, angle = draw.uniform(0, wide), draw.uniform(0, high), draw.uniform(0, np.pi)
        length = draw.uniform(0.2, 16.0) * 2.0 / 2
        width, contrast = length * draw.uniform(0.5, 1), draw.uniform(2.0, 6.0) * (-1 if draw.random() < 0.3 else 1)
        columns, rows, inside, offset = drawn.drawn(ClutterObject((x, y), angle, length, width, contrast))
        patch = np.ix_(rows % high, columns % wide)
        cover[patch], kelvin[patch] = drawn.over((inside, offset), (cover[patch], kelvin[patch]), np.greater)
    for found, expected in zip(clutter.paint(shape, 2.0, 3), (cover, kelvin), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_so_many_things_lie_on_each_place_as_is_said() -> None:
    """So few of them overlap that they cover as much together as each alone."""
    clutter = Clutter(per_mrad2=0.001, size_mrad=(3.0, 12.0))
    covers = np.mean([clutter.paint(SHAPE, PX_PER_MRAD, seed)[0].mean() for seed in range(8)])
    assert -math.log(1 - covers) == pytest.approx(clutter.deep, rel=0.1)


def test_rough_things_lie_where_ellipses_lie_and_cover_as_much() -> None:
    shares = []
    for seed in range(6):
        (ellipses, _), (rough, _) = (painted(form, seed) for form in FORM_NAMES)
        assert np.corrcoef(ellipses.ravel(), rough.ravel())[0, 1] > 0.75
        shares.append((ellipses.mean(), rough.mean()))
    even, ragged = np.mean(shares, axis=0)
    assert ragged == pytest.approx(even, rel=0.04)


def test_the_form_changes_nothing_but_the_things_and_the_seed_decides_them() -> None:
    (cover, kelvin), (again, same), (other, _) = (painted("rough", seed) for seed in (3, 3, 4))
    assert np.array_equal(cover, again)
    assert np.array_equal(kelvin, same)
    assert not np.array_equal(cover, other)
    assert not painted("rough", 1, per_mrad2=0.0)[0].any()


@pytest.mark.parametrize("contrast_k", [5.0, -5.0])
def test_a_rough_thing_is_as_warm_in_the_mean_as_it_is_to_be_and_warmest_where_it_is_lit(contrast_k: float) -> None:
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


def test_outlines_are_ragged_and_edges_from_sharp_to_soft() -> None:
    """An outline's length squared over the area is 4 pi for a disc; an edge of a pixel is a rim of one px."""
    thing, lengths, rims = ClutterObject((60.0, 60.0), 0.4, 30.0, 30.0, 5.0), [], []
    form = RoughForm(2)
    for _ in range(30):
        cover = form.drawn(thing)[2]
        contours, _ = cv2.findContours((cover > 0.5).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        largest = max(contours, key=cv2.contourArea)
        lengths.append(cv2.arcLength(largest, True) ** 2 / cv2.contourArea(largest) / (4 * math.pi))
        rims.append(float(np.mean((cover > 0.05) & (cover < 0.95)) * cover.size / (2 * math.pi * 30)))
    disc = FORMS["ellipse"](2).drawn(thing)[2]
    assert np.sum((disc > 0.05) & (disc < 0.95)) < 1.3 * 2 * math.pi * 30
    assert min(lengths) > 1.3
    assert max(rims) > 3 * min(rims)


def test_a_thing_before_another_is_mixed_with_it_by_cover() -> None:
    """Half of one of 8 K before all of one of 4 K: all is covered, and of 6 K; before nothing it stays itself."""
    whole, half, nothing = np.ones((1, 1)), np.full((1, 1), 0.5), np.zeros((1, 1))
    form = FORMS["rough"](1)
    for cover, expected in ((whole, (1.0, 6.0)), (nothing, (0.5, 8.0))):
        both = form.over((half, 8 * whole), (cover, 4 * cover), np.greater)
        assert [float(part[0, 0]) for part in both] == pytest.approx(expected)


def test_rough_things_on_a_landscape_grow_with_nearness_as_ellipses_do() -> None:
    """What they cover together in bands of distance, over seeds; none of it is above the horizon."""
    scene = context(elevation_deg=-5.0, size=(321, 301))
    horizon = 150 - math.radians(5.0) / 0.5e-3
    sums: dict[str, list[Floats]] = {form: [] for form in FORM_NAMES}
    for form, found in sums.items():
        for seed in range(4):
            keys = {"form": form, "per_mrad2": 0.006, "size_mrad": [4.0, 4.0], "contrast_k": [5.0, 5.0]}
            land = Landscape.model_validate({"hills_mrad": 0.0, "spread_k": 0.0, "clutter": keys})
            passed = land.layers(replace(scene, seed=seed))[1].light(view_direction(scene))[0]
            assert passed is not None
            assert (1 - passed[: max(round(horizon) - 2, 0)]).max(initial=0) < 1e-6
            found.append(np.asarray(1 - passed).sum(axis=1))
    ellipse, rough = (np.mean(found, axis=0) for found in sums.values())
    for top, bottom in ((10, 80), (80, 250)):
        band = slice(round(horizon) + top, round(horizon) + bottom)
        assert rough[band].sum() == pytest.approx(ellipse[band].sum(), rel=0.08)
