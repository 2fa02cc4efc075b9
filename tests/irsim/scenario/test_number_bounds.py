"""Every number of a scenario has bounds, and nothing overflows within them."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import get_args

import annotated_types as at
import pytest

import irsim
from irsim.config.base import Part
from irsim.config.schema import Slot
from irsim.errors import InputError
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario

TEXT = """\
frames: 3
camera: {size: [64, 48], ifov_mrad: 0.3}
background: {kind: ground}
targets:
  - id: drone
    shape: {kind: point, temperature_k: 320, area_m2: 0.3}
    path: {kind: straight, start: [30, 20], speed: 1.5, range_m: 1200}
occluders:
  - {kind: bar, id: pole, center_px: [40, 20], size_px: [9, 40], range_m: 300}
"""

CHECKED_TOGETHER = {"camera.band"}
"""Limits of a band are checked as a pair, against the tables of radiometry."""


def unbounded(slot: Slot, place: str, seen: set[type[Part]]) -> Iterator[str]:
    """Yield the places of numbers without a lower or an upper bound."""
    if len(slot.choices) > 1:
        for choice in slot.choices:
            yield from unbounded(choice, place, seen)
    elif slot.family is not None:
        for name, kind in slot.family:
            yield from unbounded_in(kind, f"{place}.{name}", seen)
    elif (part := slot.part(None)) is not None:
        yield from unbounded_in(part, place, seen)
    elif slot.is_table:
        yield from unbounded(Slot.of(get_args(slot.annotation)[1]), place, seen)
    elif slot.is_list:
        for item in get_args(slot.annotation):
            if item is not Ellipsis:
                yield from unbounded(Slot.of(item), place, seen)
    elif slot.annotation in (int, float):
        kinds = {type(each) for each in slot.metadata}
        if not (kinds & {at.Ge, at.Gt} and kinds & {at.Le, at.Lt}):
            yield place


def unbounded_in(part: type[Part], place: str, seen: set[type[Part]]) -> Iterator[str]:
    if part not in seen:
        seen.add(part)
        for name, field in part.model_fields.items():
            yield from unbounded(Slot.of(field.annotation, field.metadata), f"{place}.{name}".lstrip("."), seen)


def test_every_number_of_a_scenario_is_bounded() -> None:
    assert set(unbounded_in(Scenario, "", set())) == CHECKED_TOGETHER


DRONE = "targets.drone"
FAR_OUT = [
    f"{DRONE}.path.range_m=1e-300",
    f"{DRONE}.path.range_m=1e300",
    f"{DRONE}.path.speed=1e300",
    f"{DRONE}.path.closing_m_s=1e300",
    f"{DRONE}.path.start=[1e308, 0]",
    f"{DRONE}.shape.area_m2=1e300",
    f"{DRONE}.shape.contrast_k=1e300",
    "occluders.pole.center_px=[1e308, 0]",
    "camera.ifov_mrad=1e-300",
    "camera.rate_hz=1e-300",
    "camera.rate_hz=1e-12",
    "camera.range_k=[1, 200]",
    "background.spread_k=1e300",
]


@pytest.mark.parametrize("override", FAR_OUT)
def test_implausible_values_are_refused(override: str) -> None:
    with pytest.raises(InputError, match="is out of range; allowed: a number, from "):
        loads(TEXT, overrides=[override])


AT_THE_EDGE = [
    f"{DRONE}.path.range_m=0.001",
    f"{DRONE}.path.range_m=1e6",
    f"{DRONE}.path.speed=1e7",
    f"{DRONE}.path.closing_m_s=1e7",
    f"{DRONE}.path.closing_m_s=-1e7",
    f"{DRONE}.path.start=[1e7, -1e7]",
    f"{DRONE}.shape.area_m2=1e7",
    f"{DRONE}.shape.contrast_k=6000",
    f"{DRONE}.shape.scr=-1e7",
    f"{DRONE}.shape.temperature_k=1",
    "occluders.pole.size_px=[1e7, 1e7]",
    "occluders.pole.size_px=[1e-6, 1e-6]",
    "camera.ifov_mrad=0.001",
    "camera.ifov_mrad=20",
    "camera.rate_hz=0.001",
    "camera.range_k=[100, 101]",
    "background.spread_k=1000",
    "background.correlation_mrad=1e-6",
]


@pytest.mark.parametrize("override", AT_THE_EDGE)
def test_extreme_values_render_without_a_warning(override: str) -> None:
    scenario = loads(TEXT, overrides=[override])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(list(irsim.frames(scenario))) == 3
