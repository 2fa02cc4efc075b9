"""The sheet of `irsim show`."""

from __future__ import annotations

from irsim.cli.figures import name_position, zoom_corner
from irsim.types import Box

SIZE = (200, 100)  # the enlarged part is 30 px wide and high


def test_enlarged_part_is_far_from_its_target() -> None:
    assert zoom_corner(Box(20, 20, 5, 5), [], SIZE) == (0.85, 0.0)
    assert zoom_corner(Box(180, 80, 5, 5), [], SIZE) == (0.0, 0.7)


def test_names_avoid_other_names() -> None:
    box, extent = Box(60, 50, 10, 10), (30.0, 8.0)
    above, below = Box.from_edges(50, 36, 90, 44), Box.from_edges(50, 56, 90, 64)
    assert name_position(box, extent, SIZE) == (55, 44)
    assert name_position(box, extent, SIZE, [above]) == (55, 64)
    assert name_position(box, extent, SIZE, [above, below]) == (66, 54)
    everywhere = [Box(100, 50, 200, 100)]
    assert name_position(box, extent, SIZE, everywhere) == (55, 44)
