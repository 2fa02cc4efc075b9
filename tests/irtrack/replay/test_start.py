"""The target, the first frame and the box of a track."""

from __future__ import annotations

import math

import pytest
from bench_fakes import Strip, Walker

import irtrack
from irsim.types import Box, TargetTruth, Truth
from irtrack.errors import InputError
from irtrack.replay.start import find_start


def test_a_track_starts_where_half_of_the_target_is_visible() -> None:
    strip = Strip(visible=(0.0, 0.4999, 0.5, 1.0))
    assert irtrack.run(Walker(), strip).start == 2
    assert irtrack.run(Walker(), Strip(visible=(None, 1.0))).start == 0  # unknown counts as visible


def test_a_target_out_of_view_does_not_start() -> None:
    inside = TargetTruth("a", (9.0, 9.0), Box(9.0, 9.0, 4.0, 4.0), visible=0.6, in_view=True)
    outside = TargetTruth("a", (-0.6, 9.0), Box(-0.6, 9.0, 4.0, 4.0), visible=0.6, in_view=False)
    truths = [Truth(0, 0.0, (outside,)), Truth(1, 0.1, (inside,))]
    assert find_start(Strip(), truths).frame == 1


def test_a_given_box_needs_no_target() -> None:
    track = irtrack.run(Walker(), Strip(has_truth=False), init=(Box(30.0, 20.0, 9.0, 2.0), 4))
    assert (track.start, track.start_box, track.target) == (4, Box(30.0, 20.0, 9.0, 5.0), None)
    assert track.indices.tolist() == list(range(4, 20))
    assert irtrack.run(Walker(), Strip(), target="a", init=(Box(30.0, 20.0, 9.0, 9.0), 4)).target == "a"


@pytest.mark.parametrize(
    ("keywords", "needles"),
    [
        ({"target": "b"}, ["no target 'b'", "allowed: a"]),
        ({"target": "aa"}, ["did you mean 'a'?"]),
        ({"init": (Box(80.0, 20.0, 9.0, 9.0), 0)}, ["outside the frame of 64x48 px"]),
        ({"init": (Box(-2.9, 20.0, 5.0, 5.0), 0)}, ["outside"]),  # ends at -0.4: no pixel's centre inside
        ({"init": (Box(20.0, 20.0, 0.0, 9.0), 0)}, ["width and height above 0"]),
        ({"init": (Box(math.nan, 20.0, 9.0, 9.0), 0)}, ["finite"]),
        ({"init": (Box(20.0, 20.0, 65.0, 9.0), 0)}, ["65x9 px", "larger than the frame", "allowed: at most 64x48 px"]),
        ({"frames": 2.5}, ["frames 2.5: allowed: a whole number, 1 or more"]),
        ({"seed": "x"}, ["seed 'x': allowed: a whole number, 0 or more"]),
        ({"init": 5}, ["init 5", "allowed: (irsim.Box(cx, cy, w, h), frame)"]),
        ({"init": (Box(20.0, 20.0, 9.0, 9.0), 1.5)}, ["start frame 1.5", "a whole number, 0 or more"]),
        ({"init": (Box(20.0, 20.0, 9.0, 9.0), 20)}, ["start frame 20", "allowed: 0 to 19"]),
        ({"init": (Box(20.0, 20.0, 9.0, 9.0), 3), "target": "b"}, ["no target 'b'"]),
    ],
)
def test_bad_starts_are_one_line(keywords: dict[str, object], needles: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        irtrack.run(Walker(), Strip(), **keywords)
    assert "\n" not in str(caught.value)
    assert all(needle in str(caught.value) for needle in needles)


def test_boxes_at_the_limits_are_accepted() -> None:
    """As large as the frame; with a pixel's centre on its edge."""
    whole = Box.from_pixels(0, 0, 64, 48)
    assert irtrack.run(Walker(), Strip(), init=(whole, 0)).start_box == whole
    assert irtrack.run(Walker(), Strip(), init=(Box(-2.5, 20.0, 5.0, 5.0), 0)).start == 0


def test_a_start_without_a_visible_target_is_an_error() -> None:
    with pytest.raises(InputError, match=r"strip has no truth.*init=BOX"):
        irtrack.run(Walker(), Strip(has_truth=False))
    with pytest.raises(InputError, match="never shows"):
        irtrack.run(Walker(), Strip(visible=(0.1, 0.2)))
    with pytest.raises(InputError, match="no target in any frame"):
        find_start(Strip(), [Truth(0, 0.0)])
