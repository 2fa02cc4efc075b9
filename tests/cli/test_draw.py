"""The sheet of `irsim show`."""

from __future__ import annotations

import re

import numpy as np
import pytest

from irsim.cli.figures import grey_range, name_position, shortened, zoom_corner, zoom_side
from irsim.types import Box

SIZE = (200, 100)  # the enlarged part is 30 px wide and high


def test_enlarged_part_is_far_from_its_target() -> None:
    assert zoom_corner(Box(20, 20, 5, 5), [], SIZE) == (0.85, 0.0)
    assert zoom_corner(Box(180, 80, 5, 5), [], SIZE) == (0.0, 0.7)


def test_enlarged_part_avoids_other_targets() -> None:
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
def test_fewer_than_half_of_the_greys_are_stretched(used: list[tuple[int, int]], drawn: tuple[int, int]) -> None:
    """137 - 10 is under 255 / 2, 138 - 10 is not; of one grey there is nothing to stretch."""
    assert grey_range([np.array([ends], np.uint8) for ends in used]) == drawn


@pytest.mark.parametrize(
    ("side", "drawn"),
    [(5, 32), (20, 40), (38, 76), (38.6, None), (200, None)],
)
def test_enlarged_part_is_larger_than_in_the_picture(side: float, drawn: int | None) -> None:
    """It takes 0.3 of 256 rows, 76.8 px, and shows twice what a target takes."""
    assert zoom_side(Box(150, 120, side, 4), (320, 256)) == drawn


def test_small_pictures_have_no_enlarged_part() -> None:
    assert zoom_side(Box(50, 50, 4, 4), SIZE) is None  # 32 px in 30


def test_names_begin_inside_the_picture() -> None:
    assert name_position(Box(20, 20, 10, 10), (30, 8), SIZE) == (15, 14)
    assert name_position(Box(2, 20, 10, 10), (30, 8), SIZE) == (0, 14)
    assert name_position(Box(-20, 20, 10, 10), (30, 8), SIZE) == (-15, 14)
    assert name_position(Box(195, 20, 10, 10), (30, 8), SIZE) == (170, 14)
    assert name_position(Box(195, 20, 10, 10), (300, 8), SIZE) == (0, 14)


def test_names_without_room_above_their_box() -> None:
    assert name_position(Box(20, 9, 10, 10), (30, 8), SIZE) == (15, 23)
    assert name_position(Box(20, 50, 10, 98), (30, 8), SIZE) == (15, 10)
    assert name_position(Box(20, -20, 10, 10), (30, 8), SIZE) == (15, -26)


def test_wide_names_are_shortened() -> None:
    name = "a" * 40 + "b" * 40
    short = shortened(name, 100)
    assert re.fullmatch("a+…b+", short)
    assert 10 < len(short) < 40
    assert shortened("jet", 100) == "jet"


def test_names_avoid_other_names() -> None:
    box, extent = Box(60, 50, 10, 10), (30.0, 8.0)
    above, below = Box.from_edges(50, 36, 90, 44), Box.from_edges(50, 56, 90, 64)
    assert name_position(box, extent, SIZE) == (55, 44)
    assert name_position(box, extent, SIZE, [above]) == (55, 64)
    assert name_position(box, extent, SIZE, [above, below]) == (66, 54)
    everywhere = [Box(100, 50, 200, 100)]
    assert name_position(box, extent, SIZE, everywhere) == (55, 44)
