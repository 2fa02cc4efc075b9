"""Noise of a recording, read on one flat region: the seven terms of 3-D noise, memory, level, drift, bad pixels.

J. A. D'Agostino and C. M. Webb, "Three-dimensional analysis framework and measurement methodology for imaging system
noise", Proc. SPIE 1488 (1991). Their directional averages leave a part of each finer term in the coarser ones. Here it
is removed by the expected mean squares of a three-way layout with one observation a cell (H. Scheffe, "The Analysis of
Variance", 1959, section 7.4): unbiased in variance. t is time, v row to row, h column to column.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from irsim.calibration.bad_pixels import BadPixels, find_bad_pixels, patch, unstable_pixels
from irsim.calibration.selection import Region, as_region, flat_windows, motion, scene_slides, scene_terms
from irsim.calibration.statistics import (
    LEVEL,
    ROUNDED,
    Estimate,
    Values,
    check_frames,
    check_measurable,
    check_size,
    clipped,
    root,
    whole_counts,
)
from irsim.calibration.stretch import Breaks, Stretch, jumps, longest_stretch, new_frames, pattern_steps
from irsim.calibration.temporal import (
    LEAST_MEMORY_FRAMES,
    LINE_CORRELATION,
    Level,
    Memory,
    Temporal,
    fit_level,
    line_memories,
    temporal_noise,
    time_freedom,
)
from irsim.rng import stream
from irsim.types import Bools, Floats, Indices

TERMS = ("t", "v", "h", "tv", "th", "vh", "tvh")
OVER_TIME = ("pair", "lags", "memory", "drift")
_DRAWS = 4000


@dataclass(frozen=True, slots=True)
class Noise3dTerms:
    """Sigmas in the units of the frames."""

    t: Estimate
    v: Estimate
    h: Estimate
    tv: Estimate
    th: Estimate
    vh: Estimate
    tvh: Estimate


@dataclass(frozen=True)
class NoiseReport:
    """Noise figures in counts.

    stretch     measured frames, and reasons for the others
    frames      their number
    terms       3-D noise; for noise with memory, tvh is the whole sigma, and vh is without the noise left in the mean
    temporal    pair difference, correlations, memory
    lines       memory of tv and th if correlated over time; the term is then the whole sigma
    level       sigma and memory of the mean of frames; with memory, t is its sigma
    fine        temporal sigma of noise that is white in time and space; an upper bound with motion
    together    whether neighbours in the region change together: there is motion, or the camera smooths its noise
    moving      whether motion there is certain
    doubtful    names of figures that may contain the scene
    slides      whether the whole scene moves past the camera
    crossed     whether a target of the ground truth crosses the region
    drift       sigma of the means of frames
    slope_per_s of the means of frames, by least squares
    dead, hot, blinking     bad pixels of the whole picture, off targets of the ground truth
    pixels      number of pixels that were judged
    clipped     share of the region's counts at an end of their range
    rounded     whether noise is so small that rounding to whole counts hides it
    frozen_from least number of frames after which a pixel that never changes is dead; None where most never change
    """

    region: Region
    stretch: Stretch
    frames: int
    rate_hz: float
    mean: float
    terms: Noise3dTerms
    temporal: Temporal
    fine: float
    together: bool
    moving: bool
    doubtful: tuple[str, ...]
    lines: dict[str, Memory]
    level: Level
    slides: bool
    crossed: bool
    drift: float
    slope_per_s: float
    dead: int
    hot: int
    blinking: int
    pixels: int
    clipped: float
    rounded: bool
    frozen_from: int | None

    @property
    def pixel_sigma(self) -> float:
        """Temporal sigma of a pixel; with motion, that of sharp noise alone."""
        return self.fine if self.moving or self.slides else self.terms.tvh.value

    def as_json(self) -> dict[str, Any]:
        """Return plain values, ready for json.dumps; None for an infinite end."""
        stretch = self.stretch
        used: dict[str, Any] = {"repeats": stretch.repeats, "lost": stretch.lost, "rate_hz": stretch.rate_hz}
        used |= {**asdict(stretch.breaks), "used": list(stretch.index)}
        values = asdict(self, dict_factory=lambda pairs: {k: None if v == math.inf else v for k, v in pairs})
        return {**values, "region": list(self.region), "stretch": used}


def measure_noise(
    frames: Values,
    rate_hz: float,
    region: Region | tuple[int, int, int, int] | None = None,
    top: float = 65535.0,
    taken: Bools | None = None,
    times: Floats | None = None,
    start: int = 0,
) -> NoiseReport:
    """Return the noise of frames (T, rows, columns) in counts, on `region` or in the flattest still window.

    region  x, y, w, h, px
    top     highest possible count
    taken   (rows, columns) mask of targets in any frame, left out
    times   (T,) s; whole periods without a frame count as lost frames
    start   number of the first frame, for messages

    Raise InputError for frames that are too few, too small or not finite, and for arguments of a wrong type.
    """
    return noise_and_bad_pixels(frames, rate_hz, region, top, taken, times, start)[0]


def noise_and_bad_pixels(
    frames: Values,
    rate_hz: float,
    region: Region | tuple[int, int, int, int] | None,
    top: float,
    taken: Bools | None,
    times: Floats | None,
    start: int,
) -> tuple[NoiseReport, BadPixels]:
    """Return the noise report, and the bad pixels of the measured frames, under targets as well."""
    check_measurable(frames, rate_hz, top, taken, times)
    check_size(frames)
    given = None if region is None else as_region(region, frames)
    window = _select(frames, float(rate_hz), given, top, taken, times, start)
    return _report(window, float(rate_hz), top, taken), window.bad


@dataclass(frozen=True, eq=False)
class _Window:
    """Frames (T, rows, columns) of the stretch, their bad pixels, and the region without bad pixels."""

    stretch: Stretch
    frames: Values
    bad: BadPixels
    region: Region
    flat: Floats


def _select(
    frames: Values,
    rate_hz: float,
    given: Region | None,
    top: float,
    taken: Bools | None,
    times: Floats | None,
    start: int,
) -> _Window:
    """Select the longest stretch without a break; each visible step of the fixed pattern cuts it further."""
    new = new_frames(frames, rate_hz, times)
    cut = jumps([frames[k] for k in new.index])
    breaks = Breaks(pauses=new.pauses, jumps=tuple(new.index[cut].tolist()))
    window = _window(frames, longest_stretch(new, breaks, len(frames), start), given, top, taken)
    while steps := pattern_steps(window.flat):
        known = {*breaks.steps, *(window.stretch.index[step] for step in steps)}
        breaks = replace(breaks, steps=tuple(sorted(known)))
        window = _window(frames, longest_stretch(new, breaks, len(frames), start), given, top, taken)
    return window


def _window(frames: Values, stretch: Stretch, given: Region | None, top: float, taken: Bools | None) -> _Window:
    used = stretch.of(frames)
    bad = find_bad_pixels(used, top)
    region = _still_region(used, bad.all, top, taken) if given is None else given
    flat = patch(region.of(used), bad.all[region.rows, region.columns])
    check_size(flat)
    return _Window(stretch, used, bad, region, patch(flat, unstable_pixels(flat)).astype(np.float64))


def _still_region(frames: Values, bad: Bools, top: float, taken: Bools | None) -> Region:
    """Return the flattest window without motion and texture; else the flattest still one; else the flattest."""
    offered: list[Region] = []
    textured: Region | None = None
    for region in flat_windows(frames, top, taken):
        offered.append(region)
        flat = patch(region.of(frames), bad[region.rows, region.columns]).astype(np.float64)
        if motion(flat).together:
            continue
        if "vh" not in scene_terms(flat.mean(axis=0)):
            return region
        textured = textured or region
    return textured or offered[0]


def _report(window: _Window, rate_hz: float, top: float, taken: Bools | None) -> NoiseReport:
    stretch, frames, region, flat = window.stretch, window.frames, window.region, window.flat
    number = np.array(stretch.number) - stretch.number[0]
    moved = motion(flat)
    terms, over_time, lines, level = _decompose(flat, number, stretch.rate_hz, moved.moving)
    means = flat.mean(axis=(1, 2))
    slides = scene_slides(patch(frames, window.bad.all))
    judged = window.bad.without(taken)
    sigma = moved.fine if moved.moving or slides else terms.tvh.value
    return NoiseReport(
        region=region,
        stretch=stretch,
        frames=len(frames),
        rate_hz=rate_hz,
        mean=float(flat.mean()),
        terms=terms,
        temporal=over_time,
        fine=moved.fine,
        together=moved.together,
        moving=moved.moving,
        doubtful=(*TERMS, *OVER_TIME) if moved.together else scene_terms(flat.mean(axis=0)),
        lines=lines,
        level=level,
        slides=slides,
        crossed=taken is not None and bool(taken[region.rows, region.columns].any()),
        drift=float(means.std(ddof=1)),
        slope_per_s=float(np.polyfit(number / stretch.rate_hz, means - means.mean(), 1)[0]),
        dead=int(judged.dead.sum()),
        hot=int(judged.hot.sum()),
        blinking=int(judged.blinking.sum()),
        pixels=int(judged.judged.sum()),
        clipped=float(clipped(flat, frames, top).mean()),
        rounded=whole_counts(frames) and sigma < ROUNDED,
        frozen_from=window.bad.frozen_from,
    )


def _decompose(
    flat: Floats, number: Indices, rate_hz: float, moving: bool
) -> tuple[Noise3dTerms, Temporal, dict[str, Memory], Level]:
    """Return terms, memory of pixels, memory of lines and the level; whole sigmas of terms that have memory."""
    over_time = temporal_noise(flat, rate_hz, number)
    memory = over_time.memory
    terms = noise_3d(flat, time_freedom(memory, number), moving)
    if memory is not None:
        whole, fixed = _bounded(memory.total, terms.tvh, moving), _bounded(memory.fixed, terms.vh, moving)
        terms = replace(terms, tvh=whole, vh=fixed)
    lines = {} if moving else line_memories(flat, number, rate_hz, {"tv": terms.tv, "th": terms.th})
    if lines:
        freedom = min(time_freedom(each, number) for each in lines.values())
        terms = replace(terms, t=noise_3d(flat, freedom).t)
    for term, stays in (("tv", "v"), ("th", "h")):
        if term in lines:
            terms = replace(terms, **{term: lines[term].total, stays: lines[term].fixed})
    rows, columns = flat.shape[1:]
    levels = flat.mean(axis=(1, 2))
    finer = terms.tvh.value**2 / (rows * columns) + terms.tv.value**2 / rows + terms.th.value**2 / columns
    level = fit_level(levels, finer, number)
    seconds = float(number[-1] - number[0]) / rate_hz
    means = [(lines.get("tv"), rows), (lines.get("th"), columns), (memory, rows * columns)]
    level = _without_means(level, means, seconds)
    if not moving and level.time_frames is not None and _correlated(levels, number, terms.t):
        terms = replace(terms, t=level.sigma)
    return terms, over_time, lines, level


def _without_means(level: Level, memories: list[tuple[Memory | None, int]], seconds: float) -> Level:
    """Return the level without the part of correlated pixels and lines in the mean of a frame.

    A random walk of unit variance per second has a variance of T / 6 about its mean over T seconds.
    """
    theirs = sum(
        (memory.total.value**2 + memory.walk.value**2 * seconds / 6) / count
        for memory, count in memories
        if memory is not None
    )
    if level.time_frames is None:
        return replace(level, sigma=replace(level.sigma, low=root(level.sigma.low**2 - theirs)))
    if level.sigma.value**2 > 4 * theirs:
        return level
    return Level(Estimate(0.0, 0.0, level.sigma.high), None)


def _correlated(levels: Floats, number: Indices, sigma: Estimate) -> bool:
    """Return whether the level is significant and correlated from frame to frame."""
    after = np.flatnonzero(np.diff(number) == 1)
    if len(after) < LEAST_MEMORY_FRAMES or sigma.low <= 0:
        return False
    apart = levels - levels.mean()
    return float(np.mean(apart[after] * apart[after + 1])) > LINE_CORRELATION * sigma.value**2


def _bounded(sigma: Estimate, whole: Estimate, moving: bool) -> Estimate:
    """Return a sigma; an upper bound with motion, or where the sigma is 0."""
    return Estimate(sigma.value, 0.0, max(sigma.high, whole.high)) if moving or sigma.high == 0 else sigma


def noise_3d(frames: Values, time_freedom: float | None = None, moving: bool = False) -> Noise3dTerms:
    """Return the terms of frames (T, rows, columns) of a flat scene, in their units.

    time_freedom    degrees of freedom of a series about its mean; T - 1 for noise that is white in time
    moving          True with motion: each term is bounded by the whole variation along its axes

    Intervals are those of generalised pivotal quantities (S. Weerahandi, "Generalized Confidence Intervals", JASA 88,
    1993): mean squares over chi-squares, drawn with a fixed seed. Raise InputError unless the frames are an array of
    finite numbers with at least 4 frames, rows and columns.
    """
    check_frames(frames)
    check_size(frames)
    squares = mean_squares(frames)
    estimates = components(squares, frames.shape)
    times, rows, columns = frames.shape
    sides = {"t": times - 1 if time_freedom is None else time_freedom, "v": rows - 1, "h": columns - 1}
    draws = {}
    for term, mean_square in squares.items():
        freedom = np.prod([sides[axis] for axis in term])
        draws[term] = mean_square * freedom / stream(0, "noise_3d", term).chisquare(freedom, _DRAWS)
    drawn = components(draws, frames.shape)
    terms = {}
    for term in TERMS:
        low, high = np.quantile(drawn[term], ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
        if moving or high <= 0:
            others = np.prod([size for axis, size in zip("tvh", frames.shape, strict=True) if axis not in term])
            low, high = 0.0, max(high, estimates[term], np.quantile(draws[term], (1 + LEVEL) / 2) / others)
        terms[term] = Estimate(float(estimates[term]), float(low), float(high)).map(root)
    return Noise3dTerms(**terms)


def mean_squares(frames: Values) -> dict[str, Floats]:
    """Return the mean square of each effect of frames (T, rows, columns), in the order of `TERMS`."""
    values = np.asarray(frames, np.float64)
    size, axis = values.shape, {"t": 0, "v": 1, "h": 2}
    means = {term: values.mean(axis=tuple(axis[a] for a in "tvh" if a not in term), keepdims=True) for term in TERMS}
    level = values.mean(keepdims=True)
    effects: dict[str, Floats] = {}
    found: dict[str, Floats] = {}
    for term in TERMS:
        effect = means[term] - level
        for inner, known in effects.items():
            if set(inner) < set(term):
                effect = effect - known
        effects[term] = effect
        others = np.prod([size[axis[a]] for a in "tvh" if a not in term])
        freedom = np.prod([size[axis[a]] - 1 for a in term])
        found[term] = others * np.square(effect).sum() / freedom
    return found


def components(squares: dict[str, Floats], shape: tuple[int, ...]) -> dict[str, Floats]:
    """Return the unbiased variances of the terms from mean squares; an estimate may be negative.

    E[MS_tvh] = s_tvh, E[MS_tv] = s_tvh + H s_tv, E[MS_t] = s_tvh + H s_tv + V s_th + V H s_t, and so on in turn (s the
    variances; T, V, H the numbers of frames, rows and columns).
    """
    times, rows, columns = shape
    s = squares
    return {
        "tvh": s["tvh"],
        "tv": (s["tv"] - s["tvh"]) / columns,
        "th": (s["th"] - s["tvh"]) / rows,
        "vh": (s["vh"] - s["tvh"]) / times,
        "t": (s["t"] - s["tv"] - s["th"] + s["tvh"]) / (rows * columns),
        "v": (s["v"] - s["tv"] - s["vh"] + s["tvh"]) / (times * columns),
        "h": (s["h"] - s["th"] - s["vh"] + s["tvh"]) / (times * rows),
    }
