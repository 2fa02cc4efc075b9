"""Noise of a recording in one flat region: 3-D noise, correlation over time, level, drift and bad pixels."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from irsim.calibration.bad_pixels import BadPixels, find_bad_pixels, patch, unstable_pixels
from irsim.calibration.level import Level, fit_level, is_correlated, without_means
from irsim.calibration.motion import motion, scene_slides, scene_terms
from irsim.calibration.noise_3d import TERMS, Noise3dTerms, noise_3d
from irsim.calibration.selection import Region, as_region, flat_windows
from irsim.calibration.statistics import (
    ROUNDED,
    Estimate,
    Values,
    check_measurable,
    check_size,
    clipped,
    whole_counts,
)
from irsim.calibration.stretch import Breaks, Stretch, jumps, longest_stretch, new_frames, pattern_steps
from irsim.calibration.temporal import Memory, Temporal, line_memories, temporal_noise, time_freedom
from irsim.types import Bools, Floats, Indices

OVER_TIME = ("pair", "lags", "memory", "drift")


@dataclass(frozen=True)
class NoiseReport:
    """Noise figures in counts.

    stretch     measured frames, and reasons why others are left out
    frames      number of measured frames
    terms       3-D noise. Where noise is correlated over time, tvh, tv, th and t are sigmas of all of it, and vh is
                without the part that it leaves in the mean
    temporal    pixel noise over time: pair difference, correlations and correlated part
    lines       noise of rows and columns over time, where it is correlated
    level       noise of the mean of frames
    fine        temporal sigma of noise that is white in time and space; an upper bound with motion
    together, moving        as in `Motion`, in the region
    doubtful    names of figures that may contain the scene
    slides      True where the whole scene moves past the camera
    crossed     True where a target of the truth crosses the region
    drift, slope_per_s      sigma of the means of frames, and their slope by least squares
    dead, hot, blinking     numbers of bad pixels in the whole picture, outside targets
    pixels      number of pixels that were judged good or bad
    clipped     fraction of the region's counts at 0 or at the highest count
    rounded     True where rounding to whole counts hides the noise
    frozen_from as in `BadPixels`
    bad         masks of the bad pixels, including those under targets
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
    bad: BadPixels = field(repr=False, compare=False)

    @property
    def pixel_sigma(self) -> float:
        """Temporal sigma of a pixel; with motion only that of noise white in time and space."""
        return self.fine if self.moving or self.slides else self.terms.tvh.value

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON values, with None for an infinite end."""
        stretch = self.stretch
        used: dict[str, Any] = {"repeats": stretch.repeats, "lost": stretch.lost, "rate_hz": stretch.rate_hz}
        used |= {**asdict(stretch.breaks), "used": list(stretch.index)}
        values = asdict(self, dict_factory=_without_arrays)
        del values["bad"]
        return {**values, "region": list(self.region), "stretch": used}


def _without_arrays(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    return {key: None if value == math.inf else value for key, value in pairs if not isinstance(value, np.ndarray)}


def measure_noise(
    frames: Values,
    rate_hz: float,
    region: Region | tuple[int, int, int, int] | None = None,
    top: float = 65535.0,
    taken: Bools | None = None,
    times: Floats | None = None,
    start: int = 0,
) -> NoiseReport:
    """Return the noise of frames (T, rows, columns) in counts, measured in `region` or in the flattest still window.

    region  x, y, w, h, px
    top     highest possible count
    taken   (rows, columns) mask of pixels that a target covers in any frame, which are left out
    times   (T,) s; whole frame periods without a frame count as lost frames
    start   number of the first frame, for messages

    The longest stretch of frames without a break is measured. A visible step of the fixed pattern counts as a break.
    Raises InputError for frames that are too few, too small or not finite, and for arguments of a wrong type.
    """
    check_measurable(frames, rate_hz, top, taken, times)
    check_size(frames)
    given = None if region is None else as_region(region, frames)
    new = new_frames(frames, float(rate_hz), times)
    cut = jumps([frames[k] for k in new.index])
    breaks = Breaks(pauses=new.pauses, jumps=tuple(new.index[cut].tolist()))
    window = _window(frames, longest_stretch(new, breaks, len(frames), start), given, top, taken)
    while steps := pattern_steps(window.flat):
        known = {*breaks.steps, *(window.stretch.index[step] for step in steps)}
        breaks = replace(breaks, steps=tuple(sorted(known)))
        window = _window(frames, longest_stretch(new, breaks, len(frames), start), given, top, taken)
    return _report(window, float(rate_hz), top, taken)


@dataclass(frozen=True, eq=False)
class _Window:
    """Frames (T, rows, columns) of a stretch, their bad pixels, and a region in which these are replaced."""

    stretch: Stretch
    frames: Values
    bad: BadPixels
    region: Region
    flat: Floats


def _window(frames: Values, stretch: Stretch, given: Region | None, top: float, taken: Bools | None) -> _Window:
    used = stretch.of(frames)
    bad = find_bad_pixels(used, top)
    region = _still_region(used, bad.all, top, taken) if given is None else given
    flat = patch(region.of(used), bad.all[region.rows, region.columns])
    check_size(flat)
    return _Window(stretch, used, bad, region, patch(flat, unstable_pixels(flat)).astype(np.float64))


def _still_region(frames: Values, bad: Bools, top: float, taken: Bools | None) -> Region:
    """Return the flattest window without motion and texture; else the flattest still window; else the flattest one."""
    flattest = still = None
    for region in flat_windows(frames, top, taken):
        flattest = flattest or region
        flat = patch(region.of(frames), bad[region.rows, region.columns]).astype(np.float64)
        if motion(flat).together:
            continue
        if "vh" not in scene_terms(flat.mean(axis=0)):
            return region
        still = still or region
    assert flattest is not None
    return still or flattest


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
        bad=window.bad,
    )


def _decompose(
    flat: Floats, number: Indices, rate_hz: float, moving: bool
) -> tuple[Noise3dTerms, Temporal, dict[str, Memory], Level]:
    """Return the 3-D terms, the noise of pixels over time, the correlated noise of lines, and the level."""
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
    level = without_means(level, means, seconds)
    if not moving and level.time_frames is not None and is_correlated(levels, number, terms.t):
        terms = replace(terms, t=level.sigma)
    return terms, over_time, lines, level


def _bounded(sigma: Estimate, whole: Estimate, moving: bool) -> Estimate:
    """Return a sigma, whose interval runs from 0 to the higher end of it and of `whole` with motion or where it is
    0."""
    return Estimate(sigma.value, 0.0, max(sigma.high, whole.high)) if moving or sigma.high == 0 else sigma
