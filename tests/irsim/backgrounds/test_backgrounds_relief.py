"""Rows of trees and buildings on uneven ground: how far their feet rise and fall."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from country import context, view_direction

from irsim.backgrounds.panorama import PanoramaGrid
from irsim.backgrounds.structures import STAGGERED, Buildings, Canvas, Structure, Trees
from irsim.types import Floats

SCENE = context(size=(640, 240))
PX_PER_M = 1 / (1000 * 0.5e-3)
"""Of a row 1000 m away, as the stage of these tests sees it."""


def lowest(row: Structure, seed: int) -> Floats:
    """The lowest covered row of each column that has one; those that see eaves alone are left out."""
    placed = replace(SCENE, seed=seed)
    layer = row.paint(PanoramaGrid.of(placed.geometry), 10.0, 290.0, placed)  # type: ignore[attr-defined]
    covered = np.asarray(layer.light(view_direction(placed))[0]) < 0.5
    rows = np.asarray(len(covered) - 1 - np.argmax(covered[::-1], axis=0))[covered.any(axis=0)]
    return np.asarray(rows[rows > np.median(rows) - 20])


ROWS: list[tuple[type[Structure], dict[str, Any]]] = [
    (Trees, {"range_m": 1000.0, "spacing_m": 8.0, "undergrowth": 0.3, "leaves": 1.0}),
    (Buildings, {"range_m": 1000.0, "spacing_m": 25.0, "height_m": (25.0, 30.0)}),
]


@pytest.mark.sampled
@pytest.mark.parametrize(("kind", "keys"), ROWS)
def test_feet_rise_and_fall_by_the_relief_and_not_without_one(kind: type[Structure], keys: dict[str, Any]) -> None:
    level = lowest(kind(**keys), 0)
    assert np.ptp(level) <= 2
    rows = np.concatenate([lowest(kind(**keys, relief_m=3.0), seed) for seed in range(5)])
    # Within 320 m the ground's waves show most of their height.
    assert rows.std() == pytest.approx(3.0 * PX_PER_M, rel=0.3)
    assert rows.mean() == pytest.approx(level.mean(), abs=3.0 * PX_PER_M)


def test_feet_follow_the_ground_and_differ_a_little_from_one_to_the_next() -> None:
    sheet, columns = PanoramaGrid.of(SCENE.geometry), np.linspace(-500, 500, 4001)
    row = Trees(range_m=1000.0, relief_m=2.0)
    whole = np.concatenate([row.feet(sheet, 50.0, replace(SCENE, seed=seed), "trees")(columns) for seed in range(20)])
    assert whole.mean() == pytest.approx(50.0, abs=1.5)
    assert np.diff(whole).std() == pytest.approx(np.sqrt(2) * STAGGERED * 2.0 * PX_PER_M, rel=0.05)


def test_nearer_trees_stand_before_farther_ones() -> None:
    places = np.array([-30.0, 10.0, 50.0, 90.0])
    sheet = PanoramaGrid.of(SCENE.geometry)
    feet = [foot for _, foot in Trees(range_m=1000.0, relief_m=2.0)._standing(sheet, 50.0, places, SCENE, "trees")]
    assert feet == sorted(feet)
    assert len(set(feet)) == 4
    as_they_come = Trees(range_m=1000.0)._standing(sheet, 50.0, places, SCENE, "trees")
    assert as_they_come == [(x, 50.0) for x in places]


def test_nearer_buildings_are_drawn_over_farther_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    lowest_rows: list[float] = []
    monkeypatch.setattr(Canvas, "polygon", lambda _, points, kelvin: lowest_rows.append(float(np.max(points[:, 1]))))
    rows = Buildings(range_m=1000.0, relief_m=2.0, height_m=(5.0, 5.0), width_m=(2.0, 2.0))  # too narrow for windows
    rows.paint(PanoramaGrid.of(SCENE.geometry), 10.0, 290.0, SCENE)
    feet = lowest_rows[1::2]  # of each a roof, then its wall
    assert len(set(feet)) > 10
    assert feet == sorted(feet)
