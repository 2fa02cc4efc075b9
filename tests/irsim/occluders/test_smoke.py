"""Smoke: growth, drift and fading; billows that keep its density, tear its edge, roll, and vary its temperature."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from target_views import on_frame

from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.occluders import OCCLUDERS
from irsim.occluders.smoke import Smoke
from irsim.physics.radiometry import temperature
from irsim.types import Floats

SIZE = (320, 240)
CONTEXT = SceneContext(0, Geometry(SIZE, 5e-4), 30.0, "lwir", 0.0)
ROWS, COLUMNS = np.indices((240, 320))
RADIUS = np.hypot((COLUMNS - 160) / 45, (ROWS - 120) / 30)
"""1 on the edge of the dense part."""


def smoke(**keys: Any) -> Smoke:
    """Return smoke that is smooth and even by default."""
    given = {"center_px": (160.0, 120.0), "size_px": (90.0, 60.0), "range_m": 300.0, "id": "cloud"}
    given |= {"billows": 0.0, "spread_k": 0.0}
    value = OCCLUDERS.parse({"kind": "smoke", **given, **keys})
    assert isinstance(value, Smoke)
    return value


def drawn(value: Smoke, seed: int = 0, time: float = 0.0) -> Sprite:
    sprite = value.draw(replace(CameraPose.first(replace(CONTEXT, seed=seed)), time=time))
    assert sprite is not None
    return sprite


def alpha(value: Smoke, seed: int = 0, time: float = 0.0) -> Floats:
    sprite = drawn(value, seed, time)
    return on_frame(sprite, sprite.alpha, SIZE)


@pytest.mark.parametrize("seed", [0, 1])
def test_billows_keep_the_dense_part_opaque(seed: int) -> None:
    smooth, torn = alpha(smoke(), seed), alpha(smoke(billows=1.0), seed)
    assert (torn - smooth)[RADIUS < 0.9].min() > -1e-9
    assert torn[RADIUS < 0.9].min() > 0.9  # the opacity
    assert abs(torn - smooth).max() > 0.1


def test_billows_tear_the_edge() -> None:
    """Squared length of the outline over area grows, in units of a circle's."""
    found = []
    for billows in (0.0, 0.5, 1.0):
        mask = (drawn(smoke(billows=billows), seed=2).alpha > 0.5).astype(np.uint8)
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        largest = max(contours, key=cv2.contourArea)
        found.append(cv2.arcLength(largest, True) ** 2 / cv2.contourArea(largest) / (4 * math.pi))
    assert found == sorted(found)
    assert found[2] > 1.4 * found[0]


def test_it_rolls_slowly_and_reproducibly() -> None:
    begin, soon, later, again = (drawn(smoke(billows=1.0), time=time).alpha for time in (2.0, 2.03, 4.0, 2.0))
    assert np.array_equal(begin, again)
    assert 0 < np.abs(soon - begin).mean() < 0.3 * np.abs(later - begin).mean()


def test_the_temperature_varies_by_its_spread() -> None:
    found = []
    for seed in range(4):
        sprite = drawn(smoke(spread_k=2.0, size_px=(200.0, 160.0)), seed)
        dense = sprite.alpha > 0.9
        found.append(temperature("lwir", sprite.emission[dense] / sprite.alpha[dense]))
    kelvin = np.concatenate(found)
    assert kelvin.mean() == pytest.approx(288, abs=1.0)
    assert kelvin.std() == pytest.approx(2.0, rel=0.3)


@pytest.mark.parametrize(("begins_frame", "drifted_s"), [(None, 2.0), (15.0, 1.0)])
def test_it_drifts_from_its_place_at_full_size(begins_frame: float | None, drifted_s: float) -> None:
    """At 2 s, frame 60: without a beginning it is at its place in frame 0, else 15 frames after it began."""
    keys = {} if begins_frame is None else {"begins_frame": begins_frame}
    box = drawn(smoke(drift_px_s=(20.0, -8.0), grow_frames=15.0, **keys), time=2.0).box
    assert (box.cx, box.cy) == pytest.approx((160 + 20 * drifted_s, 120 - 8 * drifted_s))


@pytest.mark.parametrize(
    ("ages", "size"),
    [
        ({"begins_frame": 20.0, "grow_frames": 20.0}, 0.675),  # half-way from 0.35 to the full size
        ({"begins_frame": -10.0, "grow_frames": 10.0, "lasts_frames": 20.0, "fade_frames": 20.0}, 1.15),
    ],
    ids=["grows", "fades"],
)
def test_it_thins_as_it_grows(ages: dict[str, float], size: float) -> None:
    """Half-way, in frame 30, its depth is half the full one over the root of its relative size."""
    full, other = (smoke(opacity=0.8, **keys) for keys in ({}, ages))
    box = drawn(other, time=1.0).box
    assert (box.w, box.h) == pytest.approx((90 * size, 60 * size))
    depth, of_other = (-math.log1p(-alpha(each, time=1.0)[120, 160]) for each in (full, other))
    assert of_other / depth == pytest.approx(0.5 / math.sqrt(size))
