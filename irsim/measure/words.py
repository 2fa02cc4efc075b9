"""A report of noise in words, and what it does not tell."""

from __future__ import annotations

import math
from collections.abc import Iterator

from irsim.errors import counted, decimal_text
from irsim.measure.interval import Measured
from irsim.measure.memory import LEAST_CORRELATION, LEAST_MEMORY_FRAMES, Memory
from irsim.measure.noise import NoiseReport
from irsim.measure.noise_3d import TERMS

_SOME = 0.01
"""Share of a picture: what moves in less hides hardly a bad pixel."""
_CLIPPED = 0.005
"""Share of clipped counts from which a sigma is too small: by half a percent where a normal noise has so
many beyond one end."""
_SLIDING = (
    "where the scene slides, pixels that blink are missed, or look dead or hot, unless they change more than it does"
)
_WORDS = (
    "frame to frame, the whole picture",
    "row to row, fixed",
    "column to column, fixed",
    "row to row, in time",
    "column to column, in time",
    "pixel to pixel, fixed",
    "pixel to pixel, in time",
)


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
        yield from _remembered("memory", "pixels", flow.memory, doubts.get("memory", ""))
    elif report.frames >= LEAST_MEMORY_FRAMES:
        told = f"none is told of a correlation of less than {LEAST_CORRELATION} from frame to frame"
        yield "memory", f"{told}{doubts.get('memory', '')}"
    else:
        yield "memory", f"not known: needs {LEAST_MEMORY_FRAMES} frames"
    for term, memory in report.lines.items():
        what = "rows" if term == "tv" else "columns"
        yield from _remembered(what, what, memory, doubts.get(term, ""))
    drifted = f"{report.drift:.3g} counts of the frames' mean, slope {report.slope_per_s:.3g} a second"
    yield "drift", drifted + doubts.get("drift", "")
    yield "bad", f"{report.dead} dead, {report.hot} hot, {report.blinking} blinking of {report.pixels} pixels"
    yield from (("left out", sentence) for sentence in report.stretch.left_out(start))
    yield from (("note", sentence) for sentence in report_notes(report))
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


def _remembered(label: str, what: str, memory: Memory, doubt: str) -> Iterator[tuple[str, str]]:
    if memory.correlated.value > 0:
        yield label, f"rho {_ranged(memory.rho)}, time constant {_ranged(memory.time_constant_s)} s{doubt}"
        yield "", f"white {_ranged(memory.white)}, with memory {_ranged(memory.correlated)} counts"
    else:
        yield label, f"white {_ranged(memory.white)} counts{doubt}"
    if memory.told_walk is not None:
        yield "", f"{what} drift by {_ranged(memory.told_walk)} counts in a second, as the root of time"


def report_notes(report: NoiseReport) -> Iterator[str]:
    """What a report does not tell, in sentences."""
    if report.crossed:
        yield f"targets pass through {report.region}, where noise is read: region=X,Y,W,H names a place without them"
    unknown = (
        _clipped_noise(report),
        _rounding_hides(report),
        _memory_outlasts(report),
        _level_wanders(report),
        _frozen_unknown(report),
        _SLIDING if report.slides else _blinking_missed(report),
        None if report.slides else _standing_missed(report),
    )
    yield from (sentence for sentence in unknown if sentence is not None)


def _memory_outlasts(report: NoiseReport) -> str | None:
    """What is not told of noise that remembers about as long as the frames last, or longer."""
    memory = report.temporal.memory
    count = report.stretch.length
    if report.moving or memory is None or memory.time_constant_s.high * report.stretch.rate_hz <= count / 3:
        return None
    if math.isinf(memory.time_constant_s.high):
        return f"noise goes on for longer than {count} frames can tell: it may as well be fixed pattern, or of coding"
    return f"{count} frames are few for noise that remembers so long: of its sigma the ends alone are told"


def _level_wanders(report: NoiseReport) -> str | None:
    """What is not told of a level that remembers about as long as the frames last."""
    count, time_frames = report.stretch.length, report.level.time_frames
    if report.moving or time_frames is None or time_frames.high <= count / 2:
        return None
    return f"the level wanders as slowly as {count} frames are long: of its sigma, t, the ends alone are told"


def _clipped_noise(report: NoiseReport) -> str | None:
    """What is not told of noise that the ends of the counts cut off."""
    if report.clipped < _CLIPPED:
        return None
    return (
        f"{decimal_text(100 * report.clipped, 2)} % of the counts at {report.region} are at an end of what counts can "
        "be: noise is cut off there, and more than is told; region=X,Y,W,H names a place between the ends"
    )


def _rounding_hides(report: NoiseReport) -> str | None:
    """What counts do not tell of noise that is small beside their steps."""
    if not report.rounded:
        return None
    return (
        f"noise is {report.sharp_sigma:.2g} counts as measured, hardly more than rounding to whole counts makes, or "
        "less: noise of less than a third of a count or so cannot be told from it"
    )


def _blinking_missed(report: NoiseReport) -> str | None:
    """Where pixels that blink cannot be told from what the scene does; None where they can, but for some places."""
    if report.hidden < _SOME:
        return None
    memory = report.temporal.memory
    what = "the scene changes" if memory is None or memory.told_walk is None else "the scene changes or pixels drift"
    return (
        f"in {100 * report.hidden:.0f} % of the picture {what} by more than the noise: pixels that blink "
        "there cannot be told from it, unless they change far more"
    )


def _standing_missed(report: NoiseReport) -> str | None:
    """Where dead and hot pixels cannot be told from what stands in the scene; None where they can, but for some
    places."""
    if report.uneven < _SOME:
        return None
    return (
        f"in {100 * report.uneven:.0f} % of the picture the scene differs from pixel to pixel by more than the noise: "
        f"pixels that are dead or hot there are missed unless they stand out by {report.uneven_by:.3g} counts or so"
    )


def _frozen_unknown(report: NoiseReport) -> str | None:
    """Why pixels that never change are not called dead; None where they are."""
    if report.frozen_from is None:
        return "most pixels never change: dead ones that hold their value cannot be told from them"
    if report.frames < report.frozen_from:
        return (
            f"{report.frames} frames are too few to tell dead pixels that hold their value from good ones that did "
            f"not happen to change: that takes {report.frozen_from} or more"
        )
    return None


def _ranged(value: Measured) -> str:
    ends = f"{value.low:.3g} or more" if math.isinf(value.high) else f"{value.low:.3g} to {value.high:.3g}"
    return f"{value.value:.3g} ({ends})"
