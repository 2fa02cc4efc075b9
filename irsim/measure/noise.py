"""All that can be measured of a recording's noise, on one flat region of it."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from irsim.measure.defects import (
    ROUNDED,
    Defects,
    defects,
    faint_blinkers,
    stirred,
    uneven,
    whole_counts,
    without_lines,
)
from irsim.measure.ends import at_an_end, ends_of
from irsim.measure.flat_windows import windows
from irsim.measure.given import Values, check_given
from irsim.measure.jumps import jumps
from irsim.measure.level import Level
from irsim.measure.memory import Memory, Temporal
from irsim.measure.neighbours import alike, changes
from irsim.measure.noise_3d import TERMS, Noise3dTerms, check_size
from irsim.measure.patched import patched
from irsim.measure.quiet import quiet_sigma
from irsim.measure.region import Region, as_region
from irsim.measure.remembered import remembered
from irsim.measure.repeats import NewFrames, new_frames
from irsim.measure.steady import slides
from irsim.measure.steps import pattern_steps
from irsim.measure.stretch import Breaks, Stretch, longest_stretch
from irsim.types import Bools, Floats

_CHANCE = 1.05
"""By how much sharp noise may be more than what is measured of it: white noise in the least of pictures, 64x64 px and
32 frames, scatters by 1 % (`quiet_sigma`, 24 draws)."""
_OF_TIME = ("pair", "lags", "memory", "drift")
"""What is told beside the terms, and holds what moves as they do."""


@dataclass(frozen=True)
class NoiseReport:
    """Figures in counts; intervals are 95 %.

    stretch     which frames they are read from, and what was left out
    frames      how many these are
    terms       3-D noise; where noise has memory, tvh is its whole sigma (not only what shows within
                these frames) and vh is freed of its mean
    temporal    pair differences, lag correlations, memory
    fine        temporal sigma of what is sharp and has no memory: of a moving background only what is as sharp shows in
                it, so that where something moves it is an upper bound
    together    whether neighbours in the region change together, from frame to frame or over half of the frames:
                something moves there, or noise is blurred over pixels
    moving      whether it can be told that something moves there: then only `fine` speaks of noise alone
    doubtful    names of what may be the scene's. Where neighbours change together these are all `terms` and "pair",
                "lags", "memory" and "drift"; else those of the terms in which neighbouring pixels, rows or columns are
                alike
    lines       memory of those of tv and th that are not drawn anew in each frame: the term is then the whole sigma,
                and v or h what stays but for it
    level       sigma and memory of the frames' level; where it remembers, "t" is its whole sigma
    slides      whether the whole scene slides before the camera; blurred noise does not. Pixels that blink by less than
                it changes are then missed, or are among the dead or hot ones
    crossed     whether a target of the truth is in the region in some frame
    drift       sigma of the frames' means
    slope_per_s of the frames' means, by least squares
    dead, hot, blinking     pixels in the whole picture, where no target of the truth was nor all is full of light
    hidden      share of the picture in which the scene changes by more than the noise: pixels that blink are missed
    uneven      share of the picture in which what stands differs from pixel to pixel by more than the noise: pixels
                there that are dead or hot are missed
    uneven_by   counts by which such a pixel has to stand out there to be found, in the median; 0 where `uneven` is 0
    pixels      how many of it these are among
    clipped     share of the region's counts that are at 0 or at the highest there can be: noise is cut off there
    rounded     whether counts are whole and noise is so small that rounding hides it
    frozen_from frames from which on a pixel that never changes counts as dead; None where most never do
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
    hidden: float
    uneven: float
    uneven_by: float
    pixels: int
    clipped: float
    rounded: bool
    frozen_from: int | None

    @property
    def pixel_sigma(self) -> float:
        """Temporal sigma of a pixel, counts: of what is sharp, where something moves."""
        return self.fine if self.moving else self.terms.tvh.value

    @property
    def sharp_sigma(self) -> float:
        """The same, and of what is sharp where the whole scene slides."""
        return self.fine if self.slides else self.pixel_sigma

    @property
    def fine_most(self) -> float:
        """What `fine` may be at most by chance, counts."""
        return self.fine * _CHANCE

    def as_json(self) -> dict[str, Any]:
        """Plain values, ready for json.dumps; None for an end that no interval has."""
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
    """Noise of frames (T, rows, columns) in counts, on `region` or the flattest window in which nothing moves.

    Frames that repeat the one before do not count; where the picture or the fixed pattern becomes another, or more are
    lost than noise remembers, the longest stretch without such a break does.

    region  x, y, w, h, px
    top     the highest count there can be
    taken   (rows, columns): where targets are in some frame, so that noise is not measured there
    times   (T,) s, of the frames: where all are whole periods apart, lost frames count as time that went on
    start   the number of the first frame, for errors

    InputError where frames are too few or small or not finite, and where an argument is something else.
    """
    return noise_and_defects(frames, rate_hz, region, top, taken, times, start)[0]


def noise_and_defects(
    frames: Values,
    rate_hz: float,
    region: Region | tuple[int, int, int, int] | None,
    top: float,
    taken: Bools | None,
    times: Floats | None,
    start: int,
) -> tuple[NoiseReport, Defects]:
    """The same, and the bad pixels of those frames that it is read from, where targets were, too."""
    check_given(frames, rate_hz, top, taken, times)
    check_size(frames)
    rate_hz = float(rate_hz)  # of numpy's, which json does not know
    asked = None if region is None else as_region(region, frames)
    read = _longest_read(frames, asked, top, taken, new_frames(frames, rate_hz, times), start)
    return _told(read, rate_hz, top, taken), read.bad


@dataclass(frozen=True, eq=False)
class _Read:
    """What noise is read from.

    frames  (T, rows, columns) of the stretch
    bad     their bad pixels
    flat    (T, rows, columns) of the region, without bad pixels
    """

    stretch: Stretch
    frames: Values
    bad: Defects
    region: Region
    flat: Floats


def _longest_read(
    frames: Values, asked: Region | None, top: float, taken: Bools | None, new: NewFrames, start: int
) -> _Read:
    """Of the longest stretch of new frames in which neither the picture nor the fixed pattern becomes another."""
    others = jumps([frames[k] for k in new.index])
    breaks = Breaks(pauses=new.pauses, jumps=tuple(new.index[others].tolist()))
    read = _read(frames, longest_stretch(new, breaks, len(frames), start), asked, top, taken)
    # Cut at its steps, another stretch may be the longest, in which none were looked for yet.
    while steps := pattern_steps(read.flat, np.array(read.stretch.number)):
        breaks = replace(breaks, steps=tuple(sorted({*breaks.steps, *(read.stretch.index[step] for step in steps)})))
        read = _read(frames, longest_stretch(new, breaks, len(frames), start), asked, top, taken)
    return read


def _told(read: _Read, rate_hz: float, top: float, taken: Bools | None) -> NoiseReport:
    stretch, frames, bad, region, flat = read.stretch, read.frames, read.bad, read.region, read.flat
    number = np.array(stretch.number) - stretch.number[0]
    moved = changes(flat)
    found = remembered(flat, number, stretch.rate_hz, moved.moving)
    means = flat.mean(axis=(1, 2))
    whole = patched(frames, bad.all)
    sliding = slides(whole)
    told = bad.off(taken)
    fine = moved.fine
    if sliding or moved.moving:
        fine = min(fine, quiet_sigma(whole if sliding else flat))
    doubtful = (*TERMS, *_OF_TIME) if moved.together else alike(flat.mean(axis=0))
    sigma = fine if moved.moving else found.terms.tvh.value
    steep = uneven(whole, _standing(flat, sigma, "vh" in doubtful))
    return NoiseReport(
        region=region,
        stretch=stretch,
        frames=len(frames),
        rate_hz=rate_hz,
        mean=float(flat.mean()),
        terms=found.terms,
        temporal=found.temporal,
        fine=fine,
        together=moved.together,
        moving=moved.moving,
        doubtful=doubtful,
        lines=found.lines,
        level=found.level,
        slides=sliding,
        crossed=taken is not None and bool(taken[region.rows, region.columns].any()),
        drift=float(means.std(ddof=1)),
        slope_per_s=float(np.polyfit(number / stretch.rate_hz, means - means.mean(), 1)[0]),
        dead=int(told.dead.sum()),
        hot=int(told.hot.sum()),
        blinking=int(told.blinking.sum()),
        hidden=float(stirred(frames, sigma).mean()),
        uneven=steep.share,
        uneven_by=steep.counts,
        pixels=int(told.judged.sum()),
        clipped=_clipped(frames, flat, top),
        rounded=whole_counts(frames) and (fine if sliding else sigma) < ROUNDED,
        frozen_from=bad.frozen_from,
    )


def _clipped(frames: Values, flat: Floats, top: float) -> float:
    """Share of `flat`, a part of the frames, at an end of what counts can be."""
    return float(at_an_end(flat, ends_of(frames, top)).mean())


def _standing(flat: Floats, sigma: float, of_scene: bool) -> float:
    """Sigma of what noise leaves from pixel to pixel in the mean of all frames (T, rows, columns): what differs there,
    or, where that is the scene's, what is left of a noise of `sigma` that is new in each frame."""
    level = flat.mean(axis=0)
    return sigma / math.sqrt(len(flat)) if of_scene else float(without_lines(level).std())


def _read(frames: Values, stretch: Stretch, asked: Region | None, top: float, taken: Bools | None) -> _Read:
    """Of a stretch of frames, on the region that is asked for, or on the flattest that is still."""
    used = stretch.of(frames)
    bad = defects(used, top)
    region = _still(used, bad.all, top, taken) if asked is None else asked
    flat = _without(bad.all, used, region)
    check_size(flat)
    return _Read(stretch, used, bad, region, np.asarray(patched(flat, faint_blinkers(flat)), np.float64))


def _without(bad: Bools, frames: Values, region: Region) -> Floats:
    """A region of the frames, its bad pixels patched."""
    return patched(region.of(frames), bad[region.rows, region.columns]).astype(np.float64)


def _still(frames: Values, bad: Bools, top: float, taken: Bools | None) -> Region:
    """The flattest window in which nothing moves and no texture is seen; the flattest that is still, where texture is
    in all of these; the flattest of all, where something moves in each."""
    offered: list[Region] = []
    textured: Region | None = None
    for region in windows(frames, top, taken):
        offered.append(region)
        flat = _without(bad, frames, region)
        if changes(flat).together:
            continue
        if "vh" not in alike(flat.mean(axis=0)):
            return region
        textured = textured or region
    return textured or offered[0]
