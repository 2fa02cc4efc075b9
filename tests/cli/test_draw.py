"""The sheet of `irsim show`."""

from __future__ import annotations

import re

import numpy as np
import pytest

from irsim.cli.figures import _draw_zoom, drawn_greys, name_place, shortened, zoom_corner, zoom_side
from irsim.types import Box

SIZE = (200, 100)  # the enlarged part is 30 px wide and high


def test_the_enlarged_part_is_far_from_its_target() -> None:
    assert zoom_corner(Box(20, 20, 5, 5), [], SIZE) == (0.85, 0.0)
    assert zoom_corner(Box(180, 80, 5, 5), [], SIZE) == (0.0, 0.7)


def test_the_enlarged_part_hides_no_other_target_while_a_corner_is_free() -> None:
    followed = Box(20, 20, 5, 5)
    corners = [Box(185, 85, 5, 5), Box(185, 15, 5, 5), Box(15, 85, 5, 5)]
    assert zoom_corner(followed, corners[:1], SIZE) == (0.85, 0.7)
    assert zoom_corner(followed, corners[:2], SIZE) == (0.0, 0.0)
    assert zoom_corner(followed, corners, SIZE) == (0.85, 0.0)
    name = Box.from_edges(130, 88, 175, 98)  # of a target that is to the left of the corner
    assert zoom_corner(followed, [name], SIZE) == (0.85, 0.7)


@pytest.mark.parametrize(
    ("used", "drawn"),
    [([(10, 100), (20, 137)], (10, 137)), ([(10, 100), (20, 138)], (0, 255)), ([(7, 7)], (0, 255))],
)
def test_a_sheet_whose_frames_use_less_than_half_of_the_greys_is_drawn_from_black_to_white(
    used: list[tuple[int, int]], drawn: tuple[int, int]
) -> None:
    """137 - 10 is under 255 / 2, 138 - 10 is not; of one grey there is nothing to stretch."""
    assert drawn_greys([np.array([ends], np.uint8) for ends in used]) == drawn


@pytest.mark.parametrize(
    ("side", "drawn"),
    [(5, 32), (20, 40), (38, 76), (38.6, None), (200, None)],
)
def test_the_enlarged_part_shows_nothing_smaller_than_it_is(side: float, drawn: int | None) -> None:
    """It takes 0.3 of 256 rows, 76.8 px, and shows twice what a target takes."""
    assert zoom_side(Box(150, 120, side, 4), (320, 256)) == drawn


def test_a_small_picture_has_no_part_that_would_be_smaller_there() -> None:
    assert zoom_side(Box(50, 50, 4, 4), SIZE) is None  # 32 px in 30


def test_a_name_begins_within_the_picture_while_its_box_is_in_it() -> None:
    assert name_place(Box(20, 20, 10, 10), (30, 8), SIZE) == (15, 14)
    assert name_place(Box(2, 20, 10, 10), (30, 8), SIZE) == (0, 14)
    assert name_place(Box(-20, 20, 10, 10), (30, 8), SIZE) == (-15, 14)
    assert name_place(Box(195, 20, 10, 10), (30, 8), SIZE) == (170, 14)
    assert name_place(Box(195, 20, 10, 10), (300, 8), SIZE) == (0, 14)


def test_a_name_that_has_no_room_above_its_box_stands_below_it_or_in_it() -> None:
    assert name_place(Box(20, 9, 10, 10), (30, 8), SIZE) == (15, 23)
    assert name_place(Box(20, 50, 10, 98), (30, 8), SIZE) == (15, 10)
    assert name_place(Box(20, -20, 10, 10), (30, 8), SIZE) == (15, -26)


def test_a_name_wider_than_the_picture_lacks_its_middle() -> None:
    name = "a" * 40 + "b" * 40
    short = shortened(name, 100)
    assert re.fullmatch("a+…b+", short)
    assert 10 < len(short) < 40
    assert shortened("jet", 100) == "jet"


def test_a_name_stands_beside_those_that_are_there() -> None:
    box, extent = Box(60, 50, 10, 10), (30.0, 8.0)
    above, below = Box.from_edges(50, 36, 90, 44), Box.from_edges(50, 56, 90, 64)
    assert name_place(box, extent, SIZE) == (55, 44)
    assert name_place(box, extent, SIZE, [above]) == (55, 64)
    assert name_place(box, extent, SIZE, [above, below]) == (66, 54)
    everywhere = [Box(100, 50, 200, 100)]
    assert name_place(box, extent, SIZE, everywhere) == (55, 44)


def test_what_is_enlarged_shows_the_parts_of_a_hot_body() -> None:
    """A body of 40 px of many counts each, which a display may show white all over."""
    from matplotlib.figure import Figure

    image = np.full((120, 160), 1000, np.uint16)
    image[50:54, 60:70] = 3000
    image[51:53, 60:70:2] = 4000
    axes = Figure().subplots()
    _draw_zoom(axes, image, Box(64.5, 51.5, 10, 4), [])
    (shown,) = axes.child_axes[0].images
    assert shown.norm.vmin == 1000
    assert shown.norm.vmax == 4000
    assert set(np.unique(np.asarray(shown.get_array()))) == {1000, 3000, 4000}
