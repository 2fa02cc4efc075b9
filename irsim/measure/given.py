"""What callers give to be measured: checked before anything is worked out of it."""

from __future__ import annotations

import math
import reprlib
from typing import Any

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError, is_number

Values = npt.NDArray[np.floating] | npt.NDArray[np.integer] | npt.NDArray[np.integer | np.floating]
"""Counts as they come, or in any unit."""

_NUMBERS = "iuf"
"""Sorts of arrays that hold numbers: whole ones with and without a sign, and floats."""
_FLOATS = (np.float32, np.float64)
"""Those that counts may come in: sums of float16 are soon infinite, and what is longer linear algebra does not take."""
_ALLOWED = "allowed: an array of whole numbers, float32 or float64, (frames, rows, columns)"


def check_given(frames: object, rate_hz: object, top: object, taken: object, times: object) -> None:
    """InputError for frames that are no array (T, rows, columns) of finite numbers, for a rate or a highest count that
    is no number above 0, for `taken` that is no mask of their size, and for times that do not go on."""
    count, *size = check_frames(frames).shape
    check_above(rate_hz, "rate_hz", "frames a second")
    check_above(top, "top", "the highest count that there can be")
    check_taken(taken, tuple(size))
    if times is not None and not (
        isinstance(times, np.ndarray)
        and times.dtype.kind in _NUMBERS
        and times.shape == (count,)
        and np.isfinite(times).all()
        and (times[1:] >= times[:-1]).all()  # differences of whole numbers may wrap
    ):
        raise InputError(
            f"times: {_kind(times)}; allowed: None, or an array of numbers of shape ({count},) that do not fall, s"
        )


def check_frames(frames: object) -> npt.NDArray[Any]:
    """The frames as they are; InputError for what is no array (T, rows, columns) of finite numbers, or holds none."""
    if isinstance(frames, np.ma.MaskedArray):
        raise InputError(f"frames: a masked array, whose mask would be lost; {_ALLOWED}, such as frames.filled(...)")
    if not (isinstance(frames, np.ndarray) and frames.ndim == 3 and _holds_counts(frames.dtype)):
        raise InputError(f"frames: {_kind(frames)}; {_ALLOWED}")
    if frames.size == 0:
        raise InputError(f"frames: {_kind(frames)}; allowed: one or more frames of one or more pixels")
    if frames.dtype.kind == "f":
        wrong = [number for number, frame in enumerate(frames) if not np.isfinite(frame).all()]
        if wrong:
            raise InputError(
                f"frames: {len(wrong)} of {len(frames)} hold values that are not finite, frame {wrong[0]} first; "
                "allowed: finite numbers"
            )
    return frames


def _holds_counts(kind: np.dtype[Any]) -> bool:
    return kind.kind in "iu" or kind.type in _FLOATS


def check_taken(taken: object, size: tuple[int, ...]) -> None:
    """InputError for what is neither None nor a mask of that size (rows, columns)."""
    if taken is not None and not (isinstance(taken, np.ndarray) and taken.dtype == np.bool_ and taken.shape == size):
        raise InputError(f"taken: {_kind(taken)}; allowed: None, or an array of bool of shape {size} (rows, columns)")


def check_above(given: Any, name: str, what: str, highest: float = math.nextafter(math.inf, 0)) -> None:
    """InputError for what is no number above 0, up to the `highest`: any finite one."""
    if not (is_number(given) and 0 < float(given) <= highest):
        raise InputError(f"{name} {reprlib.repr(given)}: allowed: a number above 0, {what}")


def as_number(given: object, count: int) -> npt.NDArray[np.intp]:
    """(T,) when each of `count` frames was taken, in frames of the camera: as given, or each after the other.

    InputError for what does not rise from frame to frame, or lets none follow the one before.
    """
    if given is None:
        return np.arange(count)
    if not (
        isinstance(given, np.ndarray)
        and given.dtype.kind in "iu"
        and given.shape == (count,)
        and (given[1:] > given[:-1]).all()
        and (np.diff(given) == 1).any()
    ):
        raise InputError(
            f"number: {_kind(given)}; allowed: None, or an array of whole numbers of shape ({count},) that rise, "
            "somewhere by 1"
        )
    return given.astype(np.intp)


def _kind(given: object) -> str:
    """What a value is, for people: 'a list', 'an array of float64 of shape (32, 32)'."""
    if isinstance(given, np.ndarray):
        return f"an array of {given.dtype} of shape {given.shape}"
    return f"a {type(given).__name__}"
