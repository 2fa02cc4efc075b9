"""Attributes of frames, and the table by attribute."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from traces import trace_at

from irsim.types import Box, TargetTruth, Truth
from irtrack.metrics import ATTRIBUTES, Reference, by_attribute

NAMES = list(ATTRIBUTES)
STILL = TargetTruth(
    "a", (50.0, 50.0), Box(50, 50, 6, 8), velocity=(1.0, 0.0), attitude=(0.0, 0.0, 0.0), visible=1.0, crossing=False,
    in_view=True,
)  # fmt: skip


def marked(*targets: TargetTruth | None, others: tuple[TargetTruth, ...] = ()) -> list[set[str]]:
    """The attributes of each frame of a target."""
    truths = [Truth(k, k / 10, (*([one] if one else []), *others)) for k, one in enumerate(targets)]
    return [{NAMES[i] for i in np.flatnonzero(row)} for row in Reference.of(truths, "a").marks]


def test_easy_frame_has_no_attribute() -> None:
    assert marked(STILL, STILL) == [set(), set()]


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"visible": 0.49}, {"hidden"}),
        ({"visible": 0.5}, set()),
        ({"crossing": True}, {"crossing"}),
        ({"velocity": (1.3, 0.4)}, {"manoeuvring"}),
        ({"velocity": (1.3, 0.39)}, set()),
        ({"attitude": (358.0, 0.0, 0.0)}, {"deforming"}),  # two degrees back, not 358 on
        ({"box": Box(50, 50, 6.2, 8)}, {"deforming"}),
        ({"scr": 2.9}, {"low SCR"}),
        ({"scr": 3.0}, set()),
        ({"in_view": False}, {"out of view"}),
    ],
)
def test_attributes_of_a_change(change: dict[str, Any], found: set[str]) -> None:
    assert marked(STILL, replace(STILL, **change))[1] == found


def test_absent_frames_and_near_targets() -> None:
    assert marked(STILL, None, STILL)[1] == {"out of view"}
    near, far = replace(STILL, id="b", center=(79.9, 50.0)), replace(STILL, id="c", center=(80.1, 50.0))
    assert marked(STILL, others=(near,)) == [{"clutter"}]  # the diagonal is 10
    assert marked(STILL, others=(far,)) == [set()]


def test_the_table_by_hand() -> None:
    """Thirty frames, a hiding in 5..9, off from 12 on: the loss is dated to 12, within ten frames of the hiding."""
    n = 30
    marks = np.zeros((n, len(ATTRIBUTES)), bool)
    marks[5:10, NAMES.index("hidden")] = True
    marks[10:14, NAMES.index("clutter")] = True
    offsets = np.zeros((n, 2))
    offsets[8] = [3.0, 4.0]
    offsets[12:] = [30.0, 40.0]
    visible = np.ones(n)
    visible[5:10] = 0.2
    trace = trace_at(offsets, (6.0, 6.0), visible=visible, marks=marks)
    rows = {row.attribute: row for row in by_attribute([trace, trace])}
    hidden = rows["hidden"]
    assert (hidden.frames, hidden.counted, hidden.off_share, hidden.losses, hidden.tracks) == (10, 0, None, 2, 2)
    assert hidden.error == pytest.approx(1.0)
    clutter = rows["clutter"]
    assert (clutter.frames, clutter.counted, clutter.off_share, clutter.error) == (8, 8, 0.5, 0.0)
    assert (rows["crossing"].frames, rows["crossing"].error, rows["crossing"].losses) == (0, None, 0)
