"""Smoke: it drifts, grows and thins; billows hide as much, tear its edge and roll, and are unevenly warm."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.occluders import OCCLUDERS
from irsim.occluders.smoke import Smoke
from irsim.physics.radiometry import temperature
from irsim.types import Box, Floats

STAGE = SceneContext(0, Geometry((320, 240), 5e-4), 30.0, "lwir", 0.0)
SEEDS = range(5)


def smoke(**keys: Any) -> Smoke:
    """Smooth and even where nothing else is said."""
    given = {"center_px": (160.0, 120.0), "size_px": (90.0, 60.0), "range_m": 300.0, "id": "cloud"}
    given |= {"billows": 0.0, "spread_k": 0.0}
    value = OCCLUDERS.parse({"kind": "smoke", **given, **keys})
    assert isinstance(value, Smoke)
    return value


def drawn(value: Smoke, seed: int = 0, time: float = 0.0) -> Sprite:
    sprite = value.draw(replace(CameraPose.first(replace(STAGE, seed=seed)), time=time))
    assert sprite is not None
    return sprite


def whole(sprite: Sprite, what: Floats) -> Floats:
    """It on the whole frame, (240, 320)."""
    frame = np.zeros((240, 320))
    rows, columns = what.shape
    frame[sprite.y0 : sprite.y0 + rows, sprite.x0 : sprite.x0 + columns] = what
    return frame


ROWS, COLUMNS = np.indices((240, 320))
OFF = np.hypot((COLUMNS - 160) / 45, (ROWS - 120) / 30)
"""1 on the edge of its dense part."""


@pytest.mark.parametrize("seed", SEEDS)
def test_its_dense_part_hides_no_less_than_smooth_smoke(seed: int) -> None:
    even, torn = (whole(sprite := drawn(smoke(billows=billows), seed), sprite.alpha) for billows in (0.0, 1.0))
    assert (torn - even)[OFF < 0.9].min() > -1e-9
    assert torn[OFF < 0.9].min() > 0.9  # the opacity
    assert abs(torn - even).max() > 0.1


def test_its_edge_is_torn_the_more_it_billows() -> None:
    """An outline's length squared over the area: of an ellipse one and a half as long as wide 1.05 times 4 pi."""
    lengths = []
    for billows in (0.0, 0.5, 1.0):
        found = []
        for seed in SEEDS:
            sprite = drawn(smoke(billows=billows), seed)
            contours, _ = cv2.findContours(
                (sprite.alpha > 0.5).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
            )
            largest = max(contours, key=cv2.contourArea)
            found.append(cv2.arcLength(largest, True) ** 2 / cv2.contourArea(largest) / (4 * math.pi))
        lengths.append(np.mean(found))
    assert lengths[0] < lengths[1] < lengths[2]
    assert lengths[2] > 1.5 * lengths[0]


def test_it_rolls_slowly_and_is_the_same_again_at_the_same_time() -> None:
    begin, soon, later, again = (drawn(smoke(billows=1.0), time=time) for time in (2.0, 2.03, 4.0, 2.0))
    assert np.array_equal(begin.alpha, again.alpha)
    assert 0 < np.abs(soon.alpha - begin.alpha).mean() < 0.3 * np.abs(later.alpha - begin.alpha).mean()


@pytest.mark.parametrize("spread_k", [1.0, 3.0])
def test_it_is_warmer_and_colder_from_billow_to_billow(spread_k: float) -> None:
    found = []
    for seed in range(8):
        sprite = drawn(smoke(spread_k=spread_k, size_px=(200.0, 160.0)), seed)
        dense = sprite.alpha > 0.9
        found.append(temperature("lwir", sprite.emission[dense] / sprite.alpha[dense]))
    kelvin = np.concatenate(found)
    assert kelvin.mean() == pytest.approx(288, abs=0.5 * spread_k)
    assert kelvin.std() == pytest.approx(spread_k, rel=0.3)


@pytest.mark.parametrize("window", [Box(150.0, 120.0, 80.0, 10.0), Box(150.0, 120.0, 20.0, 40.0)])
def test_placed_over_a_window_it_rises_and_hides_all_of_it(window: Box) -> None:
    unplaced = smoke(center_px=None, size_px=None, hides="car", frames=(0, 9), billows=1.0)
    placed = unplaced.over(window, 0.9, STAGE)
    assert placed.center_px is not None
    assert placed.size_px is not None
    assert placed.size_px[1] >= 0.5 * placed.size_px[0]
    assert placed.center_px[1] <= window.cy
    sprite = drawn(placed, time=0.1)
    alpha = whole(sprite, sprite.alpha)
    hidden = alpha[round(window.top) : round(window.bottom), round(window.left) : round(window.right)]
    assert hidden.min() > 0.87  # of 0.9: the corners are on the edge of the dense part


@pytest.mark.parametrize(("begins_frame", "drifted_s"), [(None, 2.0), (15.0, 1.0)])
def test_it_drifts_with_the_wind_from_where_it_is_full_grown(begins_frame: float | None, drifted_s: float) -> None:
    """At 2 s, frame 60: without a beginning it stood at its place in frame 0, else 15 frames after it began."""
    keys = {} if begins_frame is None else {"begins_frame": begins_frame}
    box = drawn(smoke(drift_px_s=(20.0, -8.0), grow_frames=15.0, **keys), time=2.0).box
    assert (box.cx, box.cy) == pytest.approx((160 + 20 * drifted_s, 120 - 8 * drifted_s))


@pytest.mark.parametrize(
    ("ages", "size", "share"),
    [
        ({"begins_frame": 20.0, "grow_frames": 20.0}, 0.675, 0.5),  # half-way from 0.35 to all of its size
        ({"begins_frame": -10.0, "grow_frames": 10.0, "lasts_frames": 20.0, "fade_frames": 20.0}, 1.15, 0.5),
    ],
    ids=["grows", "fades"],
)
def test_it_thins_as_it_grows(ages: dict[str, float], size: float, share: float) -> None:
    """Half-way into its growth or its fading in frame 30, its depth is half that of the full one, over the root of how
    much larger it is."""
    full, other = (drawn(smoke(opacity=0.8, **keys), time=1.0) for keys in ({}, ages))
    assert (other.box.w, other.box.h) == pytest.approx((90 * size, 60 * size))
    depth, of_other = (-math.log1p(-whole(sprite, sprite.alpha)[120, 160]) for sprite in (full, other))
    assert of_other / depth == pytest.approx(share / math.sqrt(size))


def test_where_nothing_is_said_it_billows_and_is_uneven() -> None:
    """Smooth and even, it looked like an oval of cardboard."""
    plain = OCCLUDERS.parse({"kind": "smoke", "range_m": 300.0, "center_px": (80.0, 60.0), "size_px": (60.0, 40.0)})
    assert isinstance(plain, Smoke)
    assert plain.billows > 0.5
    assert plain.spread_k > 0
