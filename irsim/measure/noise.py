"""All that can be said of a recording's noise, on one flat region of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from irsim.measure.defects import Defects, defects, faint_blinkers, patched, stirred
from irsim.measure.given import as_region, check_given
from irsim.measure.interval import Measured
from irsim.measure.memory import LEAST_FRAMES, Temporal, temporal, time_freedom
from irsim.measure.neighbours import alike, changes
from irsim.measure.noise_3d import TERMS, Noise3dTerms, check_size, noise_3d
from irsim.measure.quiet import quiet_sigma
from irsim.measure.region import Mask, Region, Values, windows
from irsim.measure.repeats import new_frames
from irsim.measure.steady import slides
from irsim.measure.stretch import Stretch, longest_stretch, pattern_steps
from irsim.types import Floats
from irsim.wording import counted

_CHANCE = 1.05
"""By how much sharp noise may be more than what is measured of it: white noise in the least of pictures, 64x64 px and
32 frames, scatters by 1 % (`quiet_sigma`, 24 draws)."""


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
    slides      whether the whole scene slides before the camera; blurred noise does not. Pixels that blink by less than
                it changes are then missed, or are among the dead or hot ones
    crossed     whether a target of the truth is in the region in some frame
    drift       sigma of the frames' means
    slope_per_s of the frames' means, by least squares
    dead, hot, blinking     pixels in the whole picture, where no target of the truth was
    hidden      share of the picture in which the scene changes by more than the noise: pixels that blink are missed
    pixels      how many of it these are among
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
    slides: bool
    crossed: bool
    drift: float
    slope_per_s: float
    dead: int
    hot: int
    blinking: int
    hidden: float
    pixels: int
    frozen_from: int | None

    @property
    def pixel_sigma(self) -> float:
        """Temporal sigma of a pixel, counts: of what is sharp, where something moves."""
        return self.fine if self.moving else self.terms.tvh.value

    @property
    def fine_most(self) -> float:
        """What `fine` may be at most by chance, counts."""
        return self.fine * _CHANCE

    def as_json(self) -> dict[str, Any]:
        """Plain values, ready for json.dumps; None for an end that no interval has."""
        stretch = self.stretch
        used = {"repeats": stretch.repeats, "steps": list(stretch.steps), "used": list(stretch.index)}
        values = asdict(self, dict_factory=lambda pairs: {k: None if v == math.inf else v for k, v in pairs})
        return {**values, "region": list(self.region), "stretch": used}


def measure_noise(
    frames: Values,
    rate_hz: float,
    region: Region | tuple[int, int, int, int] | None = None,
    top: float = 65535.0,
    taken: Mask | None = None,
) -> NoiseReport:
    """Noise of frames (T, rows, columns) in counts, on `region` or the flattest window in which nothing moves.

    Frames that repeat the one before do not count; where the fixed pattern changes, the longest stretch without
    such a step does.

    region  x, y, w, h, px
    top     the highest count there can be
    taken   (rows, columns): where targets are in some frame, so that noise is not measured there

    InputError where frames are too few or small or not finite, and where an argument is something else.
    """
    check_given(frames, rate_hz, top, taken)
    check_size(frames)
    asked = None if region is None else as_region(region, frames)
    new = new_frames(frames, rate_hz)
    stretch = longest_stretch(new, [], len(frames))
    bad, place, flat = _read(stretch.of(frames), asked, top, taken)
    if steps := pattern_steps(flat, new.number):
        stretch = longest_stretch(new, steps, len(frames))
        bad, place, flat = _read(stretch.of(frames), asked, top, taken)
    frames, region = stretch.of(frames), place
    number = np.array(stretch.number)
    flow = temporal(flat, stretch.rate_hz, number)
    moved = changes(flat)
    terms = noise_3d(flat, time_freedom(flow.memory, number), moved.moving)
    if flow.memory is not None:
        memory = flow.memory
        flow = replace(flow, memory=replace(memory, white=_bounded(memory.white, flow.pair, moved.moving)))
        terms = replace(
            terms,
            vh=_bounded(memory.pixel, terms.vh, moved.moving),
            tvh=_bounded(memory.total, terms.tvh, moved.moving),
        )
    means = flat.mean(axis=(1, 2))
    whole = patched(frames, bad.all)
    sliding = slides(whole)
    told = bad.off(taken)
    fine = moved.fine
    if sliding or moved.moving:
        fine = min(fine, quiet_sigma(whole if sliding else flat))
    return NoiseReport(
        region=region,
        stretch=stretch,
        frames=len(frames),
        rate_hz=rate_hz,
        mean=float(flat.mean()),
        terms=terms,
        temporal=flow,
        fine=fine,
        together=moved.together,
        moving=moved.moving,
        doubtful=(*TERMS, *_OF_TIME) if moved.together else alike(flat.mean(axis=0)),
        slides=sliding,
        crossed=taken is not None and bool(taken[region.rows, region.columns].any()),
        drift=float(means.std(ddof=1)),
        slope_per_s=float(np.polyfit(number / stretch.rate_hz, means, 1)[0]),
        dead=int(told.dead.sum()),
        hot=int(told.hot.sum()),
        blinking=int(told.blinking.sum()),
        hidden=float(stirred(frames, fine if moved.moving else terms.tvh.value).mean()),
        pixels=told.judged,
        frozen_from=bad.frozen_from,
    )


def _bounded(sigma: Measured, whole: Measured, moving: bool) -> Measured:
    """A sigma as its memory tells it; where something moves, or nothing is left of it, it may be up to the whole."""
    return Measured(sigma.value, 0.0, max(sigma.high, whole.high)) if moving or sigma.high == 0 else sigma


def _read(frames: Values, region: Region | None, top: float, taken: Mask | None) -> tuple[Defects, Region, Floats]:
    """Bad pixels of frames, the region, or the flattest that is still, and the frames there without bad pixels."""
    bad = defects(frames, top)
    region = _still(frames, bad.all, top, taken) if region is None else region
    flat = _without(bad.all, frames, region)
    check_size(flat)
    return bad, region, np.asarray(patched(flat, faint_blinkers(flat)), np.float64)


def _without(bad: Mask, frames: Values, region: Region) -> Floats:
    """A region of the frames, its bad pixels patched."""
    return patched(region.of(frames), bad[region.rows, region.columns]).astype(np.float64)


def _still(frames: Values, bad: Mask, top: float, taken: Mask | None) -> Region:
    """The flattest window in which nothing moves and no texture is seen; the flattest that is still, where texture is
    in all of these; the flattest of all, where something moves in each."""
    textured: Region | None = None
    offered = list(windows(frames, top, taken))
    for region in offered:
        flat = _without(bad, frames, region)
        if changes(flat).together:
            continue
        if "vh" not in alike(flat.mean(axis=0)):
            return region
        textured = textured or region
    return textured or offered[0]


def noise_lines(report: NoiseReport, start: int = 0) -> Iterator[tuple[str, str]]:
    """Labels and texts for people; `start` is the number of the first frame that was looked at."""
    doubts = dict.fromkeys(report.doubtful, "; may be the scene's")
    yield "region", f"{report.region} (x,y,w,h px), {counted(report.frames, 'frame')}, mean {report.mean:.1f} counts"
    for term, what in zip(TERMS, _WORDS, strict=True):
        yield term, f"{_ranged(getattr(report.terms, term))}  {what}{doubts.get(term, '')}"
    flow = report.temporal
    yield "pair", f"{_ranged(flow.pair)}  pixel, from differences of neighbouring frames{doubts.get('pair', '')}"
    shown = "  ".join(f"{lag}: {r.value:.2f}" for lag, r in zip(flow.lags, flow.correlation, strict=True))
    yield "lags", f"correlation over frames  {shown}{doubts.get('lags', '')}"
    if flow.memory is not None:
        m = flow.memory
        yield "memory", f"rho {_ranged(m.rho)}, time constant {_ranged(m.time_constant_s)} s{doubts.get('memory', '')}"
        yield "", f"white {_ranged(m.white)}, with memory {_ranged(m.correlated)} counts"
    elif report.frames >= LEAST_FRAMES:
        yield "memory", f"none: white in time{doubts.get('memory', '')}"
    else:
        yield "memory", f"not known: needs {LEAST_FRAMES} frames"
    drifted = f"{report.drift:.3g} counts of the frames' mean, slope {report.slope_per_s:.3g} a second"
    yield "drift", drifted + doubts.get("drift", "")
    yield "bad", f"{report.dead} dead, {report.hot} hot, {report.blinking} blinking of {report.pixels} pixels"
    if report.slides:
        yield "", "where the scene slides, pixels that blink are missed, or look dead or hot, unless they change more"
    elif missed := blinking_missed(report):
        yield "", missed
    if unsure := frozen_unknown(report):
        yield "", unsure
    yield from (("left out", sentence) for sentence in report.stretch.left_out(start))
    if report.crossed:
        yield "note", f"targets pass through {report.region}: region=X,Y,W,H names a place without them"
    if report.slides:
        yield "note", "the scene moves: it slides before the camera in most of the picture"
    if report.doubtful and not report.together:
        these = "neighbouring pixels are" if "vh" in report.doubtful else "rows or columns beside each other are"
        yield "note", f"{these} alike in what stays here, as a scene makes them and no detector does:"
        yield "", f"{', '.join(report.doubtful)} may be the scene's; region=X,Y,W,H names an even place,"
        yield "", "and irsim fit tells the camera's part from the scene's"
    if report.moving:
        yield "note", "neighbours change together, and not as noise does that is blurred: something moves here;"
    elif report.together:
        yield "note", "neighbours change together: noise itself is blurred over pixels, or something moves fast here;"
    if report.together:
        yield "", "the figures above hold its motion and texture, too: region=X,Y,W,H names a place that is still;"
        yield (
            "",
            f"noise that each pixel draws anew in each frame is at most {report.fine_most:.3g} counts, whatever moves",
        )


PICTURES = "8 bits: figures are those of a picture after gain control, not of a sensor"
"""What is to be said of recordings of no more."""


def blinking_missed(report: NoiseReport) -> str | None:
    """Where pixels that blink cannot be told from what the scene does; None where they can, but for some places."""
    if report.hidden < _SOME:
        return None
    return (
        f"in {100 * report.hidden:.0f} % of the picture the scene changes by more than the noise: pixels that blink "
        "there cannot be told from it, unless they change far more"
    )


def frozen_unknown(report: NoiseReport) -> str | None:
    """Why pixels that never change are not called dead; None where they are."""
    if report.frozen_from is None:
        return "most pixels never change: dead ones that hold their value cannot be told from them"
    if report.frames < report.frozen_from:
        return (
            f"{report.frames} frames are too few to tell dead pixels that hold their value from good ones that did "
            f"not happen to change: that takes {report.frozen_from} or more"
        )
    return None


_SOME = 0.01
"""Share of a picture: what moves in less hides hardly a bad pixel."""
_OF_TIME = ("pair", "lags", "memory", "drift")
"""What is told beside the terms, and holds what moves as they do."""
_WORDS = (
    "frame to frame, the whole picture",
    "row to row, fixed",
    "column to column, fixed",
    "row to row, anew in each frame",
    "column to column, anew in each frame",
    "pixel to pixel, fixed",
    "pixel to pixel, anew in each frame",
)


def _ranged(value: Measured) -> str:
    ends = f"{value.low:.3g} or more" if math.isinf(value.high) else f"{value.low:.3g} to {value.high:.3g}"
    return f"{value.value:.3g} ({ends})"
