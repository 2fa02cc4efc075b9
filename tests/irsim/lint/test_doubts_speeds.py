"""Targets faster than anything of their kind."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest

from irsim.lint.speeds import too_fast
from irsim.scenario.model import Scenario
from irsim.targets import SHAPES, Shape
from irsim.targets.body import Body


def told(shape: str, path: dict[str, Any], **target: Any) -> list[str]:
    camera = target.pop("camera", {})
    whole = {
        "frames": 60,
        "camera": {"size": (160, 120), "ifov_mrad": 0.5, **camera},
        "background": {"kind": "sky", "horizon_k": 285.0, "zenith_k": 285.0},
        "targets": [{"id": "it", "shape": {"kind": shape}, "path": path, **target}],
    }
    notices = list(too_fast(Scenario.model_validate(whole)))
    assert all(notice.at == ("targets", 0, "path") for notice in notices)
    return [notice.message for notice in notices]


def _level(speed_m_s: float) -> dict[str, Any]:
    return {"kind": "straight_m", "start_m": (-50, 0, 4000), "velocity_m_s": (speed_m_s, 0, 0)}


def test_every_body_says_how_fast_its_kind_goes() -> None:
    for word, kind in SHAPES:
        assert issubclass(kind, Shape)
        assert (kind.max_speed_m_s is not None) == issubclass(kind, Body), word


@pytest.mark.parametrize("shape", [kind for _, kind in SHAPES if issubclass(kind, Body)])
@pytest.mark.parametrize(("share", "said"), [(0.99, 0), (1.01, 1)])
def test_a_speed_that_nothing_of_a_kind_has_is_told(shape: type[Body], share: float, said: int) -> None:
    fastest = shape.max_speed_m_s
    assert fastest is not None
    lines = told(shape.kind, _level(share * fastest))
    assert len(lines) == said
    for line in lines:
        found = re.match(r"from frame 0 on it goes at up to ([\d.]+) m/s, and more than ([\d.]+) is hardly meant", line)
        assert found is not None
        assert [float(number) for number in found.groups()] == pytest.approx([share * fastest, fastest], rel=1e-3)
        assert line.endswith(f"of the fastest {shape.kind}: try a lower speed")


@pytest.mark.parametrize(("range_m", "said"), [(6000, True), (2500, False), (1500, False)])
def test_a_range_beside_pixels_may_be_half_as_much_too_far(range_m: float, said: bool) -> None:
    """5 px a frame of 0.5 mrad and 30 frames a second are 75 mrad/s: 450 m/s at 6 km, 188 at 2.5; the record is 133."""
    path = {"kind": "straight", "start": (80, 60), "speed": 5, "range_m": range_m}
    lines = told("quadrotor", path, absent=[(20, 59)])
    assert len(lines) == said
    for line in lines:
        found = re.search(r"up to ([\d.]+) m/s, .* nearer to the camera$", line)
        assert found is not None
        assert float(found[1]) == pytest.approx(2 * 30 * range_m * math.sin(5 * 0.5e-3 / 2), rel=2e-3)


@pytest.mark.parametrize("shape", ["point", "flare", "hot_spot"])
def test_what_may_be_anything_is_not_told(shape: str) -> None:
    assert told(shape, _level(5000)) == []


def test_the_way_is_its_own_and_not_the_cameras() -> None:
    carried = {"motion": [{"kind": "platform", "velocity_m_s": (600, 0, 0)}]}
    assert told("tank", _level(0), camera=carried) == []
    assert len(told("tank", _level(600), camera=carried)) == 1


def test_it_counts_only_while_it_is_there() -> None:
    """A spline through -50, -30 and 70 m at 0, 1 and 2 s is slow at first."""
    path = {"kind": "waypoints_m", "points": [(-50, 0, 4000), (-30, 0, 4000), (70, 0, 4000)], "frames": [0, 30, 60]}
    assert len(told("tank", path)) == 1
    assert told("tank", path, absent=[(20, 59)]) == []
