"""Text of `irsim noise` and `irsim fit`: lines, a summary, and notes on the limits of their figures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from irsim.calibration.noise import NoiseReport
from irsim.calibration.noise_3d import TERMS
from irsim.calibration.statistics import Estimate
from irsim.calibration.temporal import LEAST_CORRELATION, LEAST_MEMORY_FRAMES, Memory
from irsim.errors import counted, decimal_text

if TYPE_CHECKING:
    from irsim.calibration.figures import Figures

_MEANINGS = (
    "frame to frame, the whole picture",
    "row to row, fixed",
    "column to column, fixed",
    "row to row, in time",
    "column to column, in time",
    "pixel to pixel, fixed",
    "pixel to pixel, in time",
)
_CLIPPED = 0.005
"""Least fraction of clipped counts that is reported. It reduces the sigma of Gaussian noise by half a percent."""


def number(value: float, digits: int = 4) -> str:
    """Return a number as YAML text with `digits` significant digits. A value that is a rounding error of floats is
    written as 0."""
    return "0" if abs(value) < 1e-9 else decimal_text(value, digits)


def interval(value: Estimate, digits: int = 4) -> str:
    """Return an interval as text: '1.2 to 1.4', '1.2 or more' or 'at most 1.4'."""
    if math.isinf(value.high):
        return f"{number(value.low, digits)} or more"
    if value.bound:
        return f"at most {number(value.high, digits)}"
    return f"{number(value.low, digits)} to {number(value.high, digits)}"


def estimate(value: Estimate) -> str:
    """Return an estimate as text: '1.3 (1.2 to 1.4)', or only the interval of a bound."""
    return interval(value, 3) if value.bound else f"{number(value.value, 3)} ({interval(value, 3)})"


def noise_lines(report: NoiseReport, start: int = 0) -> Iterator[tuple[str, str]]:
    """Yield labels and texts of a noise report, whose frames are numbered from `start`."""
    doubt = dict.fromkeys(report.doubtful, "; may contain the scene")
    yield "region", f"{report.region} (x,y,w,h px), {counted(report.frames, 'frame')}, mean {report.mean:.1f} counts"
    for term, meaning in zip(TERMS, _MEANINGS, strict=True):
        yield term, f"{estimate(getattr(report.terms, term))}  {meaning}{doubt.get(term, '')}"
    over_time = report.temporal
    yield "pair", f"{estimate(over_time.pair)}  pixel, differences of neighbouring frames{doubt.get('pair', '')}"
    shown = "  ".join(f"{k}: {r.value:.2f}" for k, r in zip(over_time.lags, over_time.correlation, strict=True))
    yield "lags", f"correlation over frames  {shown}{doubt.get('lags', '')}"
    if over_time.memory is not None:
        yield from _memory_lines("memory", "pixels", over_time.memory, doubt.get("memory", ""))
    elif report.frames >= LEAST_MEMORY_FRAMES:
        yield "memory", f"none: correlation from frame to frame is below {LEAST_CORRELATION}{doubt.get('memory', '')}"
    else:
        yield "memory", f"unknown: needs {LEAST_MEMORY_FRAMES} frames"
    for term, memory in report.lines.items():
        lines = "rows" if term == "tv" else "columns"
        yield from _memory_lines(lines, lines, memory, doubt.get(term, ""))
    drifted = f"{report.drift:.3g} counts sigma of the frames' means, slope {report.slope_per_s:.3g} a second"
    yield "drift", drifted + doubt.get("drift", "")
    yield "bad", f"{report.dead} dead, {report.hot} hot, {report.blinking} blinking of {report.pixels} pixels"
    yield from (("left out", sentence) for sentence in report.stretch.left_out(start))
    yield from (("note", sentence) for sentence in noise_notes(report))


def _memory_lines(label: str, pixels: str, memory: Memory, doubt: str) -> Iterator[tuple[str, str]]:
    if memory.correlated.value > 0:
        yield label, f"rho {estimate(memory.rho)}, time constant {estimate(memory.time_constant_s)} s{doubt}"
        yield "", f"white {estimate(memory.white)}, correlated {estimate(memory.correlated)} counts"
    else:
        yield label, f"white {estimate(memory.white)} counts{doubt}"
    if memory.drift is not None:
        yield "", f"{pixels} drift by {estimate(memory.drift)} counts in a second, as the root of time"


def noise_notes(report: NoiseReport) -> Iterator[str]:
    """Yield sentences on the limits of a noise report."""
    count = report.stretch.length
    memory, level = report.temporal.memory, report.level.time_frames
    if report.slides:
        yield "the scene moves past the camera: only sharp white noise is measured, as an upper bound"
        yield "blinking pixels are found only where they change more than the moving scene"
    elif report.moving:
        yield (
            f"motion at {report.region}: only sharp white noise is measured, as an upper bound; "
            "region=X,Y,W,H selects a still place"
        )
    elif report.together:
        yield (
            f"neighbouring pixels change together at {report.region}: there is fast motion, "
            "or the camera smooths its noise; region=X,Y,W,H selects a still place"
        )
    elif report.doubtful:
        yield (
            f"the scene may be part of {', '.join(report.doubtful)}: neighbours are alike there; "
            "region=X,Y,W,H selects a uniform place, and irsim fit separates camera and scene"
        )
    if report.crossed:
        yield f"targets cross {report.region}, where noise is measured; region=X,Y,W,H selects a place without them"
    if report.clipped >= _CLIPPED:
        yield (
            f"{decimal_text(100 * report.clipped, 2)} % of the counts at {report.region} are clipped: the noise is "
            "larger; region=X,Y,W,H selects another place"
        )
    if report.rounded:
        yield f"noise of {report.pixel_sigma:.2g} counts as measured is hidden by the rounding to whole counts"
    if memory is not None and not report.moving and memory.time_constant_s.high * report.stretch.rate_hz > count / 3:
        yield f"{count} frames are few for this time constant: noise, fixed pattern and drift are not separated"
    if level is not None and not report.moving and level.high > count / 2:
        yield f"the level changes as slowly as over {count} frames: only the interval of its sigma, t, is meaningful"
    if report.frozen_from is None:
        yield "most pixels never change: dead pixels that hold their value are not found"
    elif report.frames < report.frozen_from:
        yield f"{report.frames} frames are too few to find dead pixels that never change; needed: {report.frozen_from}"


def figure_notes(
    report: NoiseReport, psf: Estimate, blur: Estimate | None, still: int, objects: int, layered: bool, textured: bool
) -> Iterator[str]:
    """Yield sentences on the limits of a recording's figures of noise, texture, blur and background.

    psf, blur   as in `Figures`
    still       number of points that stand still
    objects     number of small objects that are left out of the texture
    layered     True where most variance lies between rows, as with a horizon
    textured    True where texture was found
    """
    yield from noise_notes(report)
    if report.slides:
        yield "fixed pattern, memory, rows, columns and level need a still scene; hold the camera still"
    if objects:
        yield f"{counted(objects, 'small object')} far out of the texture: left out of its spectrum, mean and histogram"
    if still:
        yield f"points that stand still: {still}; a hot pixel that shares light with its neighbours resembles one"
    if blur is None:
        yield f"no point is seen: the blur is taken to be {psf.value:.1g} px"
        yield f"texture and fixed pattern hold for any blur of {psf.low:.1g} to {psf.high:.1g} px"
    else:
        yield (
            f"the sharpest point seen has a sigma of {blur.value:.2g} px, its own size included: texture and fixed "
            f"pattern hold for any blur of {psf.low:.2g} to {psf.high:.2g} px"
        )
    if textured and layered:
        yield (
            "the picture is layered, as with a horizon: the background is written as ground of one texture, "
            "without sky, sea or rows of objects"
        )
    if textured and (report.moving or report.slides):
        yield "moving parts of the scene are written as still"


def fit_summary(found: Figures) -> Iterator[tuple[str, str]]:
    """Yield labels and texts of noise, fixed pattern, bad pixels and blur, to print."""
    yield "noise", f"{estimate(found.noise)} counts in time, of each pixel"
    if found.memory is not None and found.memory_frames is not None and found.memory.value:
        yield "", f"of it {estimate(found.memory)} with a time constant of {estimate(found.memory_frames)} frames"
    if found.walk is not None:
        yield "", f"pixels drift by {estimate(found.walk)} in a frame, as the root of their number"
    for name, lines in (("rows", found.rows), ("columns", found.columns)):
        if lines is not None and lines.correlated.value:
            yield "", f"{name} {estimate(lines.correlated)} with a time constant of {estimate(lines.time_constant_s)} s"
        if lines is not None and lines.drift is not None:
            yield "", f"{name} drift by {estimate(lines.drift)} in a second, as the root of time"
    if found.level is not None and found.level_frames is not None:
        yield "", f"level {estimate(found.level)} with a time constant of {estimate(found.level_frames)} frames"
    level = found.level if found.level_frames is None else None
    if white := _named((("rows", found.row_noise), ("columns", found.column_noise), ("level", level))):
        yield "", f"{white}, white in time"
    if fixed := _named((("pixels", found.pixel), ("rows", found.row), ("columns", found.column))):
        yield "pattern", f"{fixed}, fixed"
    if odd_even := _named(found.odd_even):
        yield "", f"half of the offset of even lines above odd ones: {odd_even}"
    known = [f"{name} {estimate(share)}" for name, share in found.flaws.shares.items() if share.high < 1]
    if known:
        yield "bad", f"{', '.join(known)} of all pixels"
    assumed = "" if found.blur is not None else ", a typical value: no point source is seen"
    yield "psf", f"{estimate(found.psf)} px{assumed}"


def _named(values: tuple[tuple[str, Estimate | None], ...]) -> str:
    return ", ".join(f"{name} {estimate(value)}" for name, value in values if value is not None)
