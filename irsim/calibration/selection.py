"""Selection of the data for noise measurements: frames of a source, pixels outside target boxes, flat windows."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import chain
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from irsim.calibration.statistics import (
    LEAST_SIDE,
    Values,
    check_frames,
    check_mask,
    check_positive,
    clipped,
    evenly,
)
from irsim.config.yaml_text import parse_yaml
from irsim.errors import InputError, as_int
from irsim.types import Bools, Box, Floats, Source

Progress = Callable[[int, int], None]
"""Callback with the number of frames read and the number of frames to read."""
EIGHT_BITS = (
    "8 bits: unless these are a detector's own counts, figures are those of a picture after gain control, not of a "
    "sensor"
)
BOX_MARGIN_PX = 4
"""Margin around a target's box that its blur and motion blur may reach, px."""
WINDOW_SIDE = 64
_WINDOW_FRAMES = 24
_WINDOWS = 8
_LEAST_HALF = 16
_CLIPPED_SHARE = 0.02
_ALIKE_ERRORS = 4.0
"""Standard errors up to which variances of windows count as equal."""


class Region(NamedTuple):
    """Rectangle of the whole pixels x .. x+w-1, y .. y+h-1."""

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
        """Return the region's part of frames (..., rows, columns)."""
        return frames[..., self.rows, self.columns]

    def __str__(self) -> str:
        return f"{self.x},{self.y},{self.w},{self.h}"


Boxes = tuple[tuple[Region, ...], ...]
"""Boxes of targets with a margin, for each frame. They may reach beyond the picture."""


class TimedFrames(NamedTuple):
    """Counts (T, rows, columns), uint8 or uint16, and frame times (T,), s."""

    counts: npt.NDArray[np.integer]
    times: Floats


def parse_region(text: str, size: tuple[int, int]) -> Region:
    """Return the region 'x,y,w,h' of a picture of `size` (columns, rows). Raises InputError for other text."""
    words = text.split(",")
    if len(words) != 4 or not all(word.strip().isdecimal() for word in words):
        raise InputError(f"region {text!r}: is no region; {_allowed_region(size)}")
    return _checked_region(Region(*map(int, words)), repr(text), size)


def as_region(given: object, frames: Values) -> Region:
    """Return the region given as four whole numbers. Raises InputError where it is not inside the frames."""
    rows, columns = frames.shape[1:]
    try:
        if not (isinstance(given, tuple | list) and len(given) == 4):
            raise TypeError
        region = Region(*map(as_int, given))
    except TypeError:
        raise InputError(f"region {reprlib.repr(given)}: allowed: four whole numbers (x, y, w, h), px") from None
    return _checked_region(region, str(tuple(region)), (columns, rows))


def _checked_region(region: Region, shown: str, size: tuple[int, int]) -> Region:
    columns, rows = size
    inside = 0 <= region.x <= columns - region.w and 0 <= region.y <= rows - region.h
    if not inside or min(region.w, region.h) < LEAST_SIDE:
        raise InputError(f"region {shown}: does not fit; {_allowed_region(size)}")
    return region


def _allowed_region(size: tuple[int, int]) -> str:
    return f"allowed: x,y,w,h in whole px inside {size[0]}x{size[1]}, at least {LEAST_SIDE}x{LEAST_SIDE}"


def read_frames(source: Source, wanted: range, progress: Progress | None = None) -> TimedFrames:
    """Return counts and times of the frames `wanted` of a source. Raises InputError where it has none of them."""
    images, times = [], []
    for frame in source.frames("counts", wanted.start, wanted.stop):
        images.append(frame.image)
        times.append(frame.time)
        if progress is not None:
            progress(len(images), len(wanted))
    if not images:
        span = f"{wanted.start}:{wanted.stop}"
        raise InputError(f"{source.name}: there are no frames {span}; allowed: one or more of its {len(source)}")
    return TimedFrames(np.stack(images), np.array(times, np.float64))


def scenario_keys(source: Source) -> Mapping[str, Any]:
    """Return the unchecked top-level keys of a source's scenario, or {}. InputError for text that is not YAML."""
    text = source.scenario_text
    value = None if text is None else parse_yaml(text, source.name).value
    return value if isinstance(value, dict) else {}


def may_be_pictures(source: Source) -> bool:
    """Return True where frames of 8 bits may be pictures after gain control instead of a detector's counts."""
    if source.bits > 8:
        return False
    keys = scenario_keys(source)
    background = keys.get("background")
    return not keys or (isinstance(background, dict) and background.get("kind") == "recording")


def target_boxes(source: Source, start: int, stop: int) -> Boxes | None:
    """Return the truth's boxes of frames start .. stop-1, with a margin; None without truth."""
    if not source.has_truth:
        return None
    return tuple(tuple(_with_margin(target.box) for target in truth.targets) for truth in source.truths(start, stop))


def _with_margin(box: Box) -> Region:
    left, top = (max(math.floor(edge - BOX_MARGIN_PX), 0) for edge in (box.left, box.top))
    right, bottom = (max(math.ceil(edge + BOX_MARGIN_PX) + 1, 0) for edge in (box.right, box.bottom))
    return Region(left, top, right - left, bottom - top)


def box_mask(boxes: Iterable[Region], shape: tuple[int, ...]) -> Bools:
    """Return the mask (rows, columns) of pixels inside any of the boxes."""
    taken = np.zeros(shape, np.bool_)
    for box in boxes:
        taken[box.rows, box.columns] = True
    return taken


def target_mask(source: Source, start: int, stop: int) -> Bools | None:
    """Return the mask of pixels that lie inside a target's box in any of frames start .. stop-1; None without truth."""
    boxes = target_boxes(source, start, stop)
    return None if boxes is None else box_mask(chain(*boxes), source.size[::-1])


def flattest(frames: Values, top: float, taken: Bools | None = None) -> Region:
    """Return the window with the least variance over pixels and frames (T, rows, columns); see `flat_windows`."""
    check_frames(frames)
    check_positive(top, "top", "the highest possible count")
    check_mask(taken, frames.shape[1:])
    return next(flat_windows(frames, top, taken))


def flat_windows(frames: Values, top: float, taken: Bools | None = None) -> Iterator[Region]:
    """Yield square windows of frames (T, rows, columns), at least one, by increasing variance.

    Windows are 64 px or half of the shorter side wide, then half as wide. Windows of one size do not overlap. Offsets
    of rows, columns and frames are subtracted first. Of windows whose variances differ only by chance the middle one
    comes first, as the least one would bias the fixed pattern. Windows with targets or clipped counts come last.
    """
    rows, columns = frames.shape[1:]
    side = min(WINDOW_SIDE, max(min(rows, columns) // 2, min(rows, columns, LEAST_SIDE)))
    picked = frames[evenly(len(frames), _WINDOW_FRAMES)].astype(np.float64)
    cut = clipped(picked, frames, top).mean(axis=0)
    held = np.zeros((rows, columns)) if taken is None else taken.astype(np.float64)
    level = np.median(picked, axis=0)
    apart = picked - _line_offsets(level, 1)[:, None] - _line_offsets(level, 0)
    apart -= apart.mean(axis=(1, 2), keepdims=True)
    mean, power = apart.mean(axis=0), np.square(apart).mean(axis=0)
    found = False
    for wide in (side, side // 2) if side // 2 >= _LEAST_HALF else (side,):
        cost, error = _window_variance(mean, power, len(picked), wide)
        unfit = (_window_means(cut, wide) > _CLIPPED_SHARE) | (_window_means(held, wide) > 0.5 / wide**2)
        for region in _by_cost(np.where(unfit, np.inf, cost), error, wide):
            found = True
            yield region
    if not found:
        cost, error = _window_variance(mean, power, len(picked), side)
        worse = (_window_means(held, side) > 0.5 / side**2) + 2.0 * (_window_means(cut, side) > _CLIPPED_SHARE)
        yield next(_by_cost(cost + (cost.max() + 1) * worse, error, side))


def _line_offsets(level: Floats, axis: int) -> Floats:
    """Return half of the robust offset of each line from the mean of its neighbours."""
    other = 1 - axis
    around = (np.roll(level, 1, other) + np.roll(level, -1, other)) / 2
    offsets: Floats = np.median(level - around, axis=axis) / 2
    offsets[[0, -1]] = 0
    return offsets


def _window_variance(mean: Floats, power: Floats, frames: int, side: int) -> tuple[Floats, Floats]:
    """Return the variances of windows, and the standard errors of these if pixels are Gaussian."""
    level = _window_means(mean, side) ** 2
    whole, fixed = _window_means(power, side) - level, _window_means(mean**2, side) - level
    return whole, np.sqrt(2) / side * np.hypot(fixed, (whole - fixed) / np.sqrt(frames))


def _window_means(values: Floats, side: int) -> Floats:
    """Return the means over windows an eighth of their side apart, indexed by the windows' top left corners."""
    step = max(side // 8, 1)
    rows, columns = values.shape
    means = cv2.boxFilter(values, -1, (side, side), anchor=(0, 0), borderType=cv2.BORDER_CONSTANT)
    return np.asarray(means[: rows - side + 1 : step, : columns - side + 1 : step])


def _by_cost(cost: Floats, error: Floats, side: int) -> Iterator[Region]:
    step, left = max(side // 8, 1), cost.copy()
    reach = -(-side // step)
    for _ in range(_WINDOWS):
        least = int(np.argmin(left))
        if np.isinf(left.flat[least]):
            return
        alike = np.flatnonzero(left <= left.flat[least] + _ALIKE_ERRORS * error.flat[least])
        middle = alike[np.argsort(left.flat[alike], kind="stable")][(len(alike) - 1) // 2]
        row, column = (int(place) for place in np.unravel_index(middle, left.shape))
        yield Region(column * step, row * step, side, side)
        left[max(row - reach + 1, 0) : row + reach, max(column - reach + 1, 0) : column + reach] = np.inf
