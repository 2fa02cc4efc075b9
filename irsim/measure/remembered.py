"""What the noise of an even region is made of, once it is known which of its parts are not drawn anew in each frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

from irsim.measure.interval import Measured, root
from irsim.measure.level import Level, fit_level
from irsim.measure.line_memory import level_remembers, remembering
from irsim.measure.memory import Memory, Temporal, temporal, time_freedom
from irsim.measure.noise_3d import Noise3dTerms, noise_3d
from irsim.types import Floats, Indices

_AS_MUCH = 4.0
"""By so much the variance of a level that remembers is more than what lines or pixels leave in it by chance: it is seen
but a few times anew."""
_STAYS = {"tv": "v", "th": "h"}


@dataclass(frozen=True)
class Remembered:
    """3-D noise terms, whole sigmas where they remember; the memory of pixels, of lines (those of tv and th that have
    one) and of the level."""

    terms: Noise3dTerms
    temporal: Temporal
    lines: dict[str, Memory]
    level: Level


def remembered(flat: Floats, number: Indices, rate_hz: float, moving: bool) -> Remembered:
    """Of the noise of frames (T, rows, columns) of an even region, taken at `number` (T,) at `rate_hz`.

    moving  whether something moves there: then sigmas are bounds, and nothing is told of lines that remember
    """
    flow = temporal(flat, rate_hz, number)
    plain = noise_3d(flat, time_freedom(flow.memory, number), moving)
    if flow.memory is not None:
        white = _bounded(flow.memory.white, flow.pair, moving)
        flow = replace(flow, memory=replace(flow.memory, white=white))
    terms = _pixels(plain, flow.memory, moving)
    lines = {} if moving else remembering(flat, number, rate_hz, terms)
    if lines:  # the level is their mean, too, and scatters from frame to frame as seldom anew as they do
        terms = replace(terms, t=noise_3d(flat, min(time_freedom(memory, number) for memory in lines.values())).t)
    level = fit_level(flat.mean(axis=(1, 2)), _finer(terms, flat), number)
    level = _own(level, lines, flow.memory, flat, float(number[-1] - number[0]) / rate_hz)
    if not moving and level.time_frames is not None and level_remembers(flat, number, terms.t):
        terms = replace(terms, t=level.sigma)
    return Remembered(_lines(terms, lines), flow, lines, level)


def _pixels(terms: Noise3dTerms, memory: Memory | None, moving: bool) -> Noise3dTerms:
    """Terms of pixels as their memory tells them."""
    if memory is None:
        return terms
    fixed, total = _bounded(memory.fixed, terms.vh, moving), _bounded(memory.total, terms.tvh, moving)
    return replace(terms, vh=fixed, tvh=total)


def _lines(terms: Noise3dTerms, lines: dict[str, Memory]) -> Noise3dTerms:
    """Terms of rows and columns as the memory of those that have one tells them."""
    whole = {term: memory.total for term, memory in lines.items()}
    stays = {_STAYS[term]: memory.fixed for term, memory in lines.items()}
    return replace(terms, **whole, **stays)


def _own(level: Level, lines: dict[str, Memory], pixels: Memory | None, flat: Floats, seconds: float) -> Level:
    """A level of so many seconds, but none that remembers where the mean of lines or pixels that do may be all of it;
    and of a white one at least what their mean, which may scatter by chance by as much again, does not make up.

    A walk of unit variance a second scatters about its mean over T seconds by T / 6 in variance.
    """
    rows, columns = flat.shape[1:]
    means = [(lines.get("tv"), rows), (lines.get("th"), columns), (pixels, rows * columns)]
    theirs = sum(
        (memory.total.value**2 + memory.walk.value**2 * seconds / 6) / count
        for memory, count in means
        if memory is not None
    )
    if level.time_frames is None:
        return replace(level, sigma=replace(level.sigma, low=root(level.sigma.low**2 - theirs)))
    if level.sigma.value**2 > _AS_MUCH * theirs:
        return level
    return Level(Measured(0.0, 0.0, level.sigma.high), None)


def _finer(terms: Noise3dTerms, flat: Floats) -> float:
    """Variance of the mean of a frame's region by the noise of its pixels, rows and columns."""
    rows, columns = flat.shape[1:]
    pixel, row, column = (getattr(terms, term).value ** 2 for term in ("tvh", "tv", "th"))
    return float(pixel / (rows * columns) + row / rows + column / columns)


def _bounded(sigma: Measured, whole: Measured, moving: bool) -> Measured:
    """A sigma as its memory tells it; where something moves, or nothing is left of it, it may be up to the whole."""
    return Measured(sigma.value, 0.0, max(sigma.high, whole.high)) if moving or sigma.high == 0 else sigma
