"""A part of a picture, in whole pixels: where noise is read."""

from __future__ import annotations

import reprlib
from typing import NamedTuple

from irsim.errors import InputError, as_int
from irsim.measure.given import Values

LEAST_REGION_SIDE = 4
"""Of smaller regions, px, noise is not told."""


class Region(NamedTuple):
    """Whole pixels x .. x+w-1, y .. y+h-1."""

    x: int
    y: int
    w: int
    h: int

    @property
    def rows(self) -> slice:
        return slice(self.y, self.y + self.h)

    @property
    def columns(self) -> slice:
        return slice(self.x, self.x + self.w)

    def of(self, frames: Values) -> Values:
        """That part of frames (..., rows, columns)."""
        return frames[..., self.rows, self.columns]

    def __str__(self) -> str:
        return f"{self.x},{self.y},{self.w},{self.h}"


def parse_region(text: str, size: tuple[int, int]) -> Region:
    """'x,y,w,h' within a picture of size (columns, rows); InputError where it is not."""
    words = text.split(",")
    if len(words) != 4 or not all(word.strip().isdecimal() for word in words):
        raise InputError(f"region {text!r}: is no region; {_allowed(size)}")
    region = Region(*(int(word) for word in words))
    check_region(region, repr(text), size)
    return region


def check_region(region: Region, shown: str, size: tuple[int, int]) -> None:
    """InputError for a region, `shown` as it was given, that is not within a picture of size (columns, rows) or is
    smaller than can be measured."""
    columns, rows = size
    inside = 0 <= region.x <= columns - region.w and 0 <= region.y <= rows - region.h
    if not inside or min(region.w, region.h) < LEAST_REGION_SIDE:
        raise InputError(f"region {shown}: does not fit; {_allowed(size)}")


def as_region(given: object, frames: Values) -> Region:
    """The region that a caller gave as four whole numbers; InputError where it is none within the frames."""
    rows, columns = frames.shape[1:]
    try:
        if not (isinstance(given, tuple | list) and len(given) == 4):
            raise TypeError
        region = Region(*map(as_int, given))
    except TypeError:
        raise InputError(f"region {reprlib.repr(given)}: allowed: four whole numbers (x, y, w, h), px") from None
    check_region(region, str(tuple(region)), (columns, rows))
    return region


def _allowed(size: tuple[int, int]) -> str:
    return f"allowed: x,y,w,h in whole px inside {size[0]}x{size[1]}, at least {LEAST_REGION_SIDE}x{LEAST_REGION_SIDE}"
