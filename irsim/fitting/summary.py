"""What was found, in a few lines for people."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.fitting.numbers import interval, plain
from irsim.measure import Figures, Measured


def summary_lines(found: Figures) -> Iterator[tuple[str, str]]:
    """Labels and texts: noise in counts, bad pixels as shares of all, the blur."""
    yield "noise", f"{_told(found.noise)} counts in time, of each pixel"
    if found.memory is not None and found.memory_frames is not None and found.memory.value:
        yield "", f"of it {_told(found.memory)} with a memory of {_told(found.memory_frames)} frames"
    if found.walk is not None:
        yield "", f"drifts from pixel to pixel by {_told(found.walk)} in a frame, as the root of their number"
    for what, lines in (("rows", found.rows), ("columns", found.columns)):
        if lines is not None and lines.correlated.value:
            yield "", f"{what} {_told(lines.correlated)} with a memory of {_told(lines.time_constant_s)} s"
        if lines is not None and lines.told_walk is not None:
            yield "", f"{what} drift by {_told(lines.told_walk)} in a second, as the root of time"
    if found.level is not None and found.level_frames is not None:
        yield "", f"level {_told(found.level)} with a memory of {_told(found.level_frames)} frames"
    level = found.level if found.level_frames is None else None
    rest = (("rows", found.row_noise), ("columns", found.column_noise), ("level", level))
    if anew := _named(rest):
        yield "", f"{anew}, anew in each frame"
    if stays := _named((("pixels", found.pixel), ("rows", found.row), ("columns", found.column))):
        yield "pattern", f"{stays}, fixed"
    if turned := _named(found.turned):
        yield "", f"half of what even ones lie above odd ones: {turned}"
    shares = found.flaws.shares.items()
    told = [f"{name} {_told(share)}" for name, share in shares if share.high < 1]
    told += [f"{name} at least {plain(share.low, 3)}" for name, share in shares if share.high >= 1 and share.low]
    if told:
        yield "bad", f"{', '.join(told)} of all pixels"
    if unknown := [name for name, share in shares if share.high >= 1 and not share.low]:
        yield "" if told else "bad", f"not told how many are {' or '.join(unknown)}"
    yield "psf", f"{_told(found.psf)} px" + ("" if found.blur is not None else ", taken: no point is seen")


def _named(values: tuple[tuple[str, Measured | None], ...]) -> str:
    return ", ".join(f"{name} {_told(value)}" for name, value in values if value is not None)


def _told(value: Measured) -> str:
    return interval(value, 3) if value.bound else f"{plain(value.value, 3)} ({interval(value, 3)})"
