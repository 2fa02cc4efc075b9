"""Every number of a scenario has bounds, and nothing overflows within them."""

from __future__ import annotations

import warnings

import annotated_types as at
import pytest
from part_tree import slots

import irsim
from irsim.errors import InputError
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario

TEXT = """\
frames: 2
camera: {size: [32, 24], ifov_mrad: 0.3}
background: {kind: ground}
targets:
  - id: drone
    shape: {kind: point, temperature_k: 320, area_m2: 0.3}
    path: {kind: straight, start: [15, 10], speed: 1.5, range_m: 1200}
occluders:
  - {kind: bar, id: pole, center_px: [20, 10], size_px: [9, 20], range_m: 300}
"""


def test_every_number_of_a_scenario_is_bounded() -> None:
    """Limits of a band are checked as a pair, against the tables of radiometry."""
    unbounded = {
        place
        for place, slot in slots(Scenario)
        if slot.annotation in (int, float)
        and not ({at.Ge, at.Gt} & {*map(type, slot.metadata)} and {at.Le, at.Lt} & {*map(type, slot.metadata)})
    }
    assert unbounded == {"camera.band"}


DRONE = "targets.drone"


@pytest.mark.parametrize(
    "override",
    [
        f"{DRONE}.path.range_m=1e-300",
        f"{DRONE}.path.speed=1e300",
        f"{DRONE}.path.start=[1e308, 0]",
        f"{DRONE}.shape.area_m2=1e300",
        "occluders.pole.center_px=[1e308, 0]",
        "camera.ifov_mrad=1e-300",
        "camera.range_k=[1, 200]",
        "background.spread_k=1e300",
    ],
)
def test_implausible_values_are_errors(override: str) -> None:
    with pytest.raises(InputError, match="is out of range; allowed: a number, from "):
        loads(TEXT, overrides=[override])


def test_extreme_values_render_without_a_warning() -> None:
    for override in (
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
    ):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert len(list(irsim.frames(loads(TEXT, overrides=[override])))) == 2, override
