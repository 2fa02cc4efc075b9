"""Occluders that are placed by whom they hide: with kinds of one's own, which hold what irsim's own never do."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from pydantic import Field

import irsim
from irsim.occluders.smoke import Smoke
from irsim.scenario.model import Scenario
from irsim.scenario.placement_all import overdone, placed
from irsim.targets.point import Point
from irsim.types import Floats


class Remembering(Point):
    """A point that keeps an array: two of them cannot be compared."""

    @cached_property
    def table(self) -> Floats:
        return np.arange(3.0)


class Noted(Smoke):
    """Smoke with a list, by which it cannot be hashed."""

    notes: list[str] = Field(default_factory=list)


def scene(shape: str, occluder: str) -> Scenario:
    made: Scenario = irsim.loads(
        f"""
frames: 40
camera: {{size: [64, 48]}}
background: {{kind: sky}}
targets:
  - {{id: a, shape: {{kind: "{shape}"}}, path: {{kind: straight, start: [5, 24], speed: 1, range_m: 500}}}}
occluders:
  - {{id: haze, kind: "{occluder}", hides: a, frames: [15, 20], fraction: 0.8, range_m: 100}}
""",
        "own.yaml",
    )
    return made


def test_scenes_whose_parts_cannot_be_compared_are_placed_each_for_itself() -> None:
    first, second = scene(f"{__name__}:Remembering", "smoke"), scene(f"{__name__}:Remembering", "smoke")
    for each in (first, second):
        assert len(each.targets[0].shape.table) == 3  # type: ignore[attr-defined]  # it is ours
    for each in (first, second, first, second):
        assert placed(each) == placed(first)
        assert list(overdone(each)) == list(overdone(first))


def test_an_occluder_that_cannot_be_hashed_is_placed_where_its_like_is() -> None:
    (own,), (like,) = placed(scene("point", f"{__name__}:Noted")), placed(scene("point", "smoke"))
    assert own.model_dump(exclude={"kind", "notes"}) == like.model_dump(exclude={"kind"})
