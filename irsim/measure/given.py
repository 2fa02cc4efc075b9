"""What callers give to be measured: checked before anything is worked out of it."""

from __future__ import annotations

import math
import reprlib
from typing import Any

import numpy as np

from irsim.errors import InputError, as_whole
from irsim.measure.region import Region, Values, check_region

_NUMBERS = "iuf"
"""Sorts of arrays that hold counts: whole numbers with and without a sign, and floats."""


def check_given(frames: object, rate_hz: object, top: object, taken: object, times: object) -> None:
    """InputError for frames that are no array (T, rows, columns) of finite numbers, for a rate or a highest count that
    is no number above 0, for `taken` that is no mask of their size, and for times that do not go on."""
    count, *sides = _checked(frames).shape
    size = tuple(sides)
    _check_above(rate_hz, "rate_hz", "frames a second")
    _check_above(top, "top", "the highest count that there can be")
    if taken is not None and not (isinstance(taken, np.ndarray) and taken.dtype == np.bool_ and taken.shape == size):
        raise InputError(f"taken: {_kind(taken)}; allowed: None, or an array of bool of shape {size} (rows, columns)")
    if times is not None and not (
        isinstance(times, np.ndarray)
        and times.dtype.kind in _NUMBERS
        and times.shape == (count,)
        and np.isfinite(times).all()
        and (np.diff(times) >= 0).all()
    ):
        raise InputError(
            f"times: {_kind(times)}; allowed: None, or an array of numbers of shape ({count},) that do not fall, s"
        )


def _checked(frames: object) -> Values:
    """The frames as they are; InputError for what is no array (T, rows, columns) of finite numbers."""
    if not (isinstance(frames, np.ndarray) and frames.ndim == 3 and frames.dtype.kind in _NUMBERS):
        raise InputError(f"frames: {_kind(frames)}; allowed: an array of numbers, (frames, rows, columns)")
    if frames.dtype.kind == "f":
        wrong = [number for number, frame in enumerate(frames) if not np.isfinite(frame).all()]
        if wrong:
            raise InputError(
                f"frames: {len(wrong)} of {len(frames)} hold values that are not finite, frame {wrong[0]} first; "
                "allowed: finite numbers"
            )
    return frames


def as_region(given: object, frames: Values) -> Region:
    """The region that a caller gave as four whole numbers; InputError where it is none within the frames."""
    rows, columns = frames.shape[1:]
    try:
        if not (isinstance(given, tuple | list) and len(given) == 4):
            raise TypeError
        region = Region(*map(as_whole, given))
    except TypeError:
        raise InputError(f"region {reprlib.repr(given)}: allowed: four whole numbers (x, y, w, h), px") from None
    check_region(region, str(tuple(region)), (columns, rows))
    return region


def _check_above(given: Any, name: str, what: str) -> None:
    number = isinstance(given, int | float | np.integer | np.floating) and not isinstance(given, bool)
    if not (number and 0 < given < math.inf):
        raise InputError(f"{name} {reprlib.repr(given)}: allowed: a number above 0, {what}")


def _kind(given: object) -> str:
    """What a value is, for people: 'a list', 'an array of float64 of shape (32, 32)'."""
    if isinstance(given, np.ndarray):
        return f"an array of {given.dtype} of shape {given.shape}"
    return f"a {type(given).__name__}"
