"""Figures of a recording's camera and background, in counts, px and frames of the recording."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from itertools import chain
from typing import Any

import numpy as np

from irsim.calibration.background import TEXTURE_PICTURES, background, mean_picture
from irsim.calibration.bad_pixel_figures import BadPixelFigures, bad_pixel_figures
from irsim.calibration.bad_pixels import FULL, patch
from irsim.calibration.fixed_pattern import fixed_pattern, odd_even, remove_odd_even
from irsim.calibration.noise import NoiseReport, measure_noise
from irsim.calibration.psf import point_blur
from irsim.calibration.report import figure_notes
from irsim.calibration.selection import Boxes, Region, box_mask
from irsim.calibration.statistics import (
    Estimate,
    Values,
    check_measurable,
    evenly,
    exact,
    may_be_hidden,
    remove_rounding,
    root,
    square,
    subtract,
)
from irsim.calibration.temporal import Memory
from irsim.calibration.texture import PowerLaw, fit_texture, grey_levels, periodogram
from irsim.errors import InputError, counted
from irsim.types import Floats

FRAMES = 300
"""Default number of frames measured: 200 MB for 640 x 512 px."""
_LEAST_SIDE = 8


@dataclass(frozen=True, kw_only=True)
class Figures:
    """Figures in counts and frames of the recording; None where the recording does not determine them.

    The rounding variance of 1/12 is subtracted. Times in `rows` and `columns`, of type `Memory`, are in seconds.

    noise, white, memory    temporal sigma of a pixel, of its white part and of its correlated part; with motion an
                            upper bound of white noise
    memory_frames           time constant of the correlated part
    walk                    sigma of the change by drift in a frame; None where it is not significant
    row_noise, column_noise white temporal sigma of rows and columns
    rows, columns           noise of rows and columns over time, where it is correlated
    level, level_frames     sigma and time constant of the mean of whole frames
    pixel, row, column      sigmas of the fixed pattern of pixels, rows and columns
    even_rows, even_columns half of the offset of even lines above odd ones
    blur                    sigma of the sharpest point, px; None without a point
    psf                     sigma of the blur that is assumed for `texture` and `pixel`, px
    texture                 texture of the background, or None
    mean, histogram         mean of the background, and its quantiles where they are not Gaussian
    flaws                   bad pixels
    """

    frames: int
    noise: Estimate
    white: Estimate
    memory: Estimate | None = None
    memory_frames: Estimate | None = None
    walk: Estimate | None = None
    row_noise: Estimate | None = None
    column_noise: Estimate | None = None
    rows: Memory | None = None
    columns: Memory | None = None
    level: Estimate | None = None
    level_frames: Estimate | None = None
    pixel: Estimate | None = None
    row: Estimate | None = None
    column: Estimate | None = None
    even_rows: Estimate | None = None
    even_columns: Estimate | None = None
    blur: Estimate | None = None
    psf: Estimate
    texture: PowerLaw | None = None
    mean: float
    histogram: tuple[float, ...]
    flaws: BadPixelFigures
    region: Region
    notes: tuple[str, ...]

    def estimates(self) -> Iterator[tuple[str, Estimate]]:
        """Yield names, such as "rows.rho", and values of all figures with an interval. The figure `fixed` of rows and
        of columns is left out, as it contains the scene."""
        for name in ("", "rows", "columns", "texture", "flaws"):
            part, prefix = (getattr(self, name), f"{name}.") if name else (self, "")
            for field in fields(part) if part is not None else ():
                value = getattr(part, field.name)
                if isinstance(value, Estimate) and not (isinstance(part, Memory) and field.name == "fixed"):
                    yield prefix + field.name, value

    @property
    def odd_even(self) -> tuple[tuple[str, Estimate], ...]:
        """Names and values of `even_rows` and `even_columns`, as far as they exceed four standard errors."""
        both = (("rows", self.even_rows), ("columns", self.even_columns))
        return tuple((along, found) for along, found in both if found and abs(found.value) > found.high - found.low)


def measure_figures(
    frames: Values,
    rate_hz: float,
    region: Region | None = None,
    top: float = 65535.0,
    start: int = 0,
    points: bool = True,
    times: Floats | None = None,
    boxes: Boxes | None = None,
) -> Figures:
    """Return the figures of frames (T, rows, columns) in counts.

    region, top, times, start   as in `measure_noise`
    points      False: search no points, which takes most of the time, and assume usual blurs
    boxes       target boxes of each frame, which are left out

    Raises InputError where frames are too few or smaller than 8 x 8 px.
    """
    check_measurable(frames, rate_hz, top, None, times)
    taken = None
    if boxes is not None:
        if len(boxes) != len(frames):
            raise InputError(f"boxes: of {counted(len(boxes), 'frame')}; allowed: None, or of all {len(frames)}")
        taken = box_mask(chain(*boxes), frames.shape[1:])
    if min(frames.shape[1:]) < _LEAST_SIDE:
        raise InputError(
            f"a picture of {frames.shape[2]}x{frames.shape[1]} px is too small to be measured; "
            f"allowed: at least {_LEAST_SIDE}x{_LEAST_SIDE}"
        )
    report = measure_noise(frames, rate_hz, region, top, taken, times, start)
    bad, used = report.bad, report.stretch.of(frames)
    periods = np.diff(report.stretch.number) * report.stretch.slower
    seen = tuple(() if boxes is None else boxes[k] for k in report.stretch.index)
    patched = patch(used, bad.all)
    blur, still = point_blur(patched, bad.all | ~bad.judged, top, not report.slides) if points else (None, 0)
    flaws = bad_pixel_figures(used, periods, bad.without(taken))
    if report.slides:  # motion of the scene hides blinking pixels
        flaws = replace(flaws, blinking=replace(flaws.blinking, high=1.0))
    standing = _standing(report, patched, seen, blur, top) if not report.slides else None
    scene = standing or _sliding(report, patched, seen, blur)
    parts = {**_over_time(report), **scene.figures}
    found = Figures(frames=report.frames, region=report.region, blur=blur, flaws=flaws, notes=(), **parts)
    notes = figure_notes(report, found.psf, blur, still, scene.objects, scene.layered, found.texture is not None)
    return replace(found, notes=(*report.stretch.left_out(start), *notes))


@dataclass(frozen=True)
class _Scene:
    """Figures of background and fixed pattern, number of small objects left out, and True if the picture is layered."""

    figures: dict[str, Any]
    objects: int
    layered: bool


def _standing(report: NoiseReport, frames: Values, boxes: Boxes, blur: Estimate | None, top: float) -> _Scene:
    """Return the figures of a still scene from the mean of all frames."""
    sigma = report.fine if report.moving else math.hypot(report.terms.tvh.value, report.drift)
    mean, always = mean_picture(frames, sigma, boxes)
    behind = background(mean, always | (mean >= FULL * top) | ~report.bad.judged)
    rows, columns = odd_even(behind.picture, 0), odd_even(behind.picture, 1)
    picture = remove_odd_even(behind.picture, rows.value, columns.value)
    fixed = fixed_pattern(picture, blur, behind.filled)
    left, left_rows, left_columns = _left_in_mean(report, len(frames))
    sigmas = {
        "pixel": may_be_hidden(subtract(fixed.floor.map(root), left), report.rounded),
        "row": subtract(fixed.row, left_rows),
        "column": subtract(fixed.column, left_columns),
    }
    if report.moving:  # moving objects leave a part in the mean
        sigmas = {name: Estimate(each.value, 0.0, each.high, bound=True) for name, each in sigmas.items()}
    figures: dict[str, Any] = {
        **sigmas,
        "even_rows": rows,
        "even_columns": columns,
        "psf": fixed.psf,
        "texture": fixed.spectrum.texture,
        "mean": float(behind.seen.mean()),
        "histogram": grey_levels(behind.seen, fixed.spectrum),
    }
    return _Scene(figures, behind.objects, _is_layered(picture))


def _sliding(report: NoiseReport, frames: Values, boxes: Boxes, blur: Estimate | None) -> _Scene:
    """Return the figures of a scene that moves past the camera from single frames, without a fixed pattern.

    Two upper bounds of noise are known: the white floor of the spectrum, which contains the fixed pattern of pixels,
    and the sharp changes from frame to frame, which contain sharp texture. The smaller one is taken.
    """
    picked = evenly(len(frames), TEXTURE_PICTURES).tolist()
    shape = frames.shape[1], frames.shape[2]
    behind = [background(frames[k].astype(np.float64), box_mask(boxes[k], shape)) for k in picked]
    powers = np.mean([periodogram(each.picture) for each in behind], axis=0)
    spectrum, psf = fit_texture(powers, shape, blur)
    middle = behind[len(behind) // 2]
    figures: dict[str, Any] = {
        "psf": psf,
        "texture": spectrum.texture,
        "mean": float(np.concatenate([each.seen for each in behind]).mean()),
        "histogram": grey_levels(middle.seen, spectrum),
    }
    floor, sharp = spectrum.floor.map(root), _sharp_bound(report)
    if floor.high < sharp.high:
        sharp = Estimate(floor.value, 0.0, floor.high, bound=True)
    figures["noise"] = figures["white"] = remove_rounding(sharp, report.rounded)
    return _Scene(figures, max(each.objects for each in behind), _is_layered(middle.picture))


def _is_layered(picture: Floats) -> bool:
    """Return True where the means of rows have most of the variance, as with a horizon. Hot objects are clipped."""
    usual = np.clip(picture, *np.quantile(picture, (0.02, 0.98)))
    return bool(usual.mean(axis=1).var() > 0.5 * usual.var())


def _over_time(report: NoiseReport) -> dict[str, Any]:
    """Return the figures of temporal noise; with motion only an upper bound of white noise."""
    if report.moving or report.slides:
        sharp = remove_rounding(_sharp_bound(report), report.rounded)
        return {"noise": sharp, "white": sharp}
    terms, memory, level, slower = report.terms, report.temporal.memory, report.level, report.stretch.slower
    rows, columns = report.lines.get("tv"), report.lines.get("th")
    drift = None if memory is None else memory.drift
    return {
        "noise": remove_rounding(terms.tvh, report.rounded),
        "white": remove_rounding(terms.tvh if memory is None else memory.white, report.rounded),
        "memory": None if memory is None else memory.correlated,
        "memory_frames": None if memory is None else memory.time_constant_s.map(lambda s: s * report.rate_hz),
        "walk": None if drift is None else drift.map(lambda sigma: sigma / math.sqrt(report.rate_hz)),
        "row_noise": terms.tv if rows is None else rows.white,
        "column_noise": terms.th if columns is None else columns.white,
        "rows": rows,
        "columns": columns,
        "level": level.sigma,
        "level_frames": None if level.time_frames is None else level.time_frames.map(lambda time: time * slower),
    }


def _sharp_bound(report: NoiseReport) -> Estimate:
    return Estimate(report.fine, 0.0, 1.05 * report.fine, bound=True)


def _left_in_mean(report: NoiseReport, count: int) -> tuple[Estimate, Estimate, Estimate]:
    """Return the variances that temporal noise of pixels, rows and columns leaves in the mean of `count` frames."""
    if report.moving:
        return exact(report.fine**2 / count), exact(0.0), exact(0.0)
    terms, lines = report.terms, report.lines
    parts = ((terms.tvh, report.temporal.memory), (terms.tv, lines.get("tv")), (terms.th, lines.get("th")))
    pixels, rows, columns = (
        sigma.map(lambda value: value**2 / count) if memory is None else memory.left.map(square)
        for sigma, memory in parts
    )
    return pixels, rows, columns
