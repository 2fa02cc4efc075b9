"""The sheet of `irsim show`."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.draw import drawn_greys, zoom_corner
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


@pytest.mark.parametrize(
    ("used", "drawn"),
    [([(10, 100), (20, 137)], (10, 137)), ([(10, 100), (20, 138)], (0, 255)), ([(7, 7)], (0, 255))],
)
def test_a_sheet_whose_frames_use_less_than_half_of_the_greys_is_drawn_from_black_to_white(
    used: list[tuple[int, int]], drawn: tuple[int, int]
) -> None:
    """137 - 10 is under 255 / 2, 138 - 10 is not; of one grey there is nothing to stretch."""
    assert drawn_greys([np.array([ends], np.uint8) for ends in used]) == drawn
