"""All that a recording tells of its camera and of its background, with intervals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from itertools import chain
from typing import Any

import numpy as np

from irsim.errors import InputError, counted
from irsim.measure.backdrop import TEXTURE_PICTURES, backdrop
from irsim.measure.boxes import Boxes, covered
from irsim.measure.defects import ROUNDED, whole_counts
from irsim.measure.field import Field, periodogram
from irsim.measure.flaws import Flaws, flaws
from irsim.measure.given import Values, check_given
from irsim.measure.histogram import histogram
from irsim.measure.interval import Measured, exactly, less, root, square
from irsim.measure.lines import turns, without_turns
from irsim.measure.memory import Memory
from irsim.measure.noise import NoiseReport, noise_and_defects
from irsim.measure.notes import AT_MOST, SMALL, blur_notes, noise_notes, outstanding, texture_notes, unlike_notes
from irsim.measure.passing import passing_blurs
from irsim.measure.patched import patched
from irsim.measure.pattern import fixed_pattern
from irsim.measure.picked import evenly
from irsim.measure.points import point_blur
from irsim.measure.region import Region
from irsim.measure.rounding import perhaps_hidden, without_rounding
from irsim.measure.settled import settled
from irsim.measure.steady import TOLD_SIDE
from irsim.measure.still import Still, still_things
from irsim.measure.unblurred import fit_unblurred
from irsim.types import Bools, Floats

FRAMES = 300
"""Frames that are looked at where the caller does not say: 200 MB of 640x512 px."""
_LEAST_SIDE = 8
"""Of smaller pictures, px, no spectrum is fitted."""
_STIRRED = 0.1
"""Share of the picture that changes by more than the noise from which rows and columns may be what moves slowly, even
where noise is read beside it: waves under noise of 40 mK, a third of the picture, made rows of 1.5 counts 4.7."""


@dataclass(frozen=True, kw_only=True)
class Figures:
    """In counts and frames of the recording; None where that cannot tell. Rounding's 1/12 is taken out of variances.

    rows and columns, as `Memory` has them, are in seconds.

    frames                  from which they are read
    noise                   whole temporal sigma of a pixel; of it white the part without memory, memory that with.
                            Where something moves both are upper bounds of what is sharp and has no memory
    memory_frames           in which the part with memory falls to a correlation of 1/e
    memory_age_s            time from a correction that took that part away to the first frame; infinity where none did
    walk                    by which what drifts from pixel to pixel has changed after a frame; it grows as the root of
                            their number. None where it may be none
    row_noise, column_noise temporal sigmas of whole rows and columns, white in time
    rows, columns           where they remember: of what there is besides
    level, level_frames     sigma of the whole frame's level, and the time of its memory
    pixel, row, column      sigmas of what stays: fixed pattern that is white over pixels, rows, columns
    even_rows, even_columns what even ones lie above odd ones, halved
    blur                    sigma of the sharpest thing seen, px; None where no point is seen
    psf                     sigma of the lens's blur, under which texture and pixel are told: of that thing, which has a
                            size of its own, at most
    texture, mean, histogram    of the background: its field, its mean, and its values at even shares where they
                            are not Gaussian
    flaws                   bad pixels
    """

    frames: int
    noise: Measured
    white: Measured
    memory: Measured | None = None
    memory_frames: Measured | None = None
    memory_age_s: float = math.inf
    walk: Measured | None = None
    row_noise: Measured | None = None
    column_noise: Measured | None = None
    rows: Memory | None = None
    columns: Memory | None = None
    level: Measured | None = None
    level_frames: Measured | None = None
    pixel: Measured | None = None
    row: Measured | None = None
    column: Measured | None = None
    even_rows: Measured | None = None
    even_columns: Measured | None = None
    blur: Measured | None = None
    psf: Measured
    texture: Field | None = None
    mean: float
    histogram: tuple[float, ...]
    flaws: Flaws
    region: Region
    notes: tuple[str, ...]

    def measured(self) -> Iterator[tuple[str, Measured]]:
        """Names and values of all figures with an interval, those of parts under theirs.

        What stays of lines with memory where noise is read (`Memory.fixed`) is none: the scene's are among it. The
        camera's own are `row` and `column`.
        """
        for name in ("", "rows", "columns", "texture", "flaws"):
            part, prefix = (getattr(self, name), f"{name}.") if name else (self, "")
            for field in fields(part) if part is not None else ():
                value = getattr(part, field.name)
                if isinstance(value, Measured) and not (isinstance(part, Memory) and field.name == "fixed"):
                    yield prefix + field.name, value

    @property
    def flawed(self) -> bool:
        """Whether there are bad pixels."""
        return any(share.value for share in self.flaws.shares.values())

    @property
    def turned(self) -> tuple[tuple[str, Measured], ...]:
        """Of even_rows and even_columns those that are there: by four standard errors."""
        both = (("rows", self.even_rows), ("columns", self.even_columns))
        return tuple((along, found) for along, found in both if found and abs(found.value) > found.high - found.low)


def measure_figures(
    frames: Values,
    rate_hz: float,
    region: Region | None = None,
    top: float = 65535.0,
    taken: Bools | None = None,
    start: int = 0,
    passing: bool = True,
    times: Floats | None = None,
    boxes: Boxes | None = None,
) -> Figures:
    """Figures of frames (T, rows, columns) in counts; noise is read on `region`, or the flattest window.

    top, taken, times   as `measure_noise` has them. InputError where frames are too few or small, less than 8 x 8 px.
    start       the number of the first frame, for the notes
    passing     whether the blur is looked for in points that pass, too, which takes most of the time. Where it is not,
                and none stands still, texture and pixel are told under the usual blurs
    boxes       of each frame, where its targets are, which is no texture; `taken` is then where any of them is. Small
                things that stand far out of what is left are none, either
    """
    check_given(frames, rate_hz, top, taken, times)
    if boxes is not None:
        if taken is not None:
            raise InputError("taken and boxes: both say where targets are; allowed: one of them")
        if len(boxes) != len(frames):
            raise InputError(f"boxes: of {counted(len(boxes), 'frame')}; allowed: None, or of all {len(frames)}")
        taken = covered(chain(*boxes), frames.shape[1:])
    if min(frames.shape[1:]) < _LEAST_SIDE:
        raise InputError(
            f"a picture of {frames.shape[2]}x{frames.shape[1]} px is too small to be measured; "
            f"allowed: at least {_LEAST_SIDE}x{_LEAST_SIDE}"
        )
    report, bad = noise_and_defects(frames, rate_hz, region, top, taken, times, start)
    frames = report.stretch.of(frames)
    periods = np.diff(report.stretch.number) * report.stretch.slower
    held = tuple(() if boxes is None else boxes[k] for k in report.stretch.index)
    unsure = report.together and not report.moving and min(frames.shape[1:]) < TOLD_SIDE
    if unsure:
        report = replace(report, moving=True, rounded=whole_counts(frames) and report.fine < ROUNDED)
    still = still_things(frames, bad, top)
    bad = still.spared(bad)
    whole = patched(frames, bad.all | still.all)
    passed = _passed(frames, bad.all | still.all, top, report.slides) if passing else []
    # What is surely as sharp: of many the least value would be one that is too small by chance.
    blur = min([*still.points, *passed], key=lambda sigma: sigma.high, default=None)
    if report.slides:
        marked = flaws(frames, periods, bad.off(taken), report.fine)
        # All others may blink, too, hidden by the change of the scene.
        blinking = Measured(marked.blinking.value, marked.blinking.value, 1.0)
        found = _of_moving(report, whole, held, blur, still, replace(marked, blinking=blinking))
    else:
        found = _of_still(report, whole, held, blur, still, flaws(frames, periods, bad.off(taken), report.pixel_sigma))
    return replace(found, notes=(*report.stretch.left_out(start), *([SMALL] if unsure else []), *found.notes))


def _passed(frames: Values, bad: Bools, top: float, slides: bool) -> list[Measured]:
    """Blurs of points that pass: what is behind them is known of a scene that stands; else only bright ones tell it."""
    found = [] if slides else passing_blurs(frames, bad, top)
    if found:
        return found
    bright = point_blur(frames, bad, top)
    return [] if bright is None else [bright]


def _of_still(
    report: NoiseReport, whole: Values, boxes: Boxes, blur: Measured | None, still: Still, bad: Flaws
) -> Figures:
    usual = report.fine if report.moving else float(np.hypot(report.terms.tvh.value, report.drift))
    stands = settled(whole, usual, boxes)
    behind = backdrop(stands.picture, stands.never)
    even_rows, even_columns = turns(behind.picture, 0), turns(behind.picture, 1)
    behind = replace(behind, picture=without_turns(behind.picture, even_rows.value, even_columns.value))
    picture = behind.picture
    fixed = fixed_pattern(picture, blur, report.moving, behind.held)
    left, left_rows, left_columns = _left(report, len(whole))
    pixel = perhaps_hidden(less(fixed.floor.map(root), left), report.rounded)
    row, column = less(fixed.row, left_rows), less(fixed.column, left_columns)
    if report.moving or report.hidden >= _STIRRED:
        # What moves leaves a part of it behind in the mean, and rows and columns are read in the whole picture.
        pixel, row, column = (Measured(sigma.value, 0.0, sigma.high, bound=True) for sigma in (pixel, row, column))
    return Figures(
        frames=report.frames,
        **_of_time(report),
        pixel=pixel,
        row=row,
        column=column,
        even_rows=even_rows,
        even_columns=even_columns,
        blur=blur,
        psf=fixed.blur,
        texture=fixed.spectrum.texture,
        mean=float(behind.seen.mean()),
        histogram=histogram(behind.seen, fixed.spectrum),
        flaws=bad,
        region=report.region,
        notes=(
            *noise_notes(report),
            *outstanding([behind.things]),
            *texture_notes(fixed, picture, report.terms.tvh.value),
            *blur_notes(blur, fixed.blur, still),
            *unlike_notes(fixed.spectrum, picture, report.moving),
        ),
    )


def _of_moving(
    report: NoiseReport, whole: Values, boxes: Boxes, blur: Measured | None, still: Still, bad: Flaws
) -> Figures:
    """Where the scene slides, only what is sharp and white in time is told from it."""
    picked = evenly(len(whole), TEXTURE_PICTURES)
    behind = [backdrop(whole[k].astype(np.float64), covered(boxes[k], whole.shape[1:])) for k in picked]
    powers = np.mean([periodogram(each.picture) for each in behind], axis=0)
    spectrum, psf = fit_unblurred(powers, whole[0].shape, blur)
    middle = behind[len(behind) // 2]
    return Figures(
        frames=report.frames,
        **_of_time(report),
        blur=blur,
        psf=psf,
        texture=spectrum.texture,
        mean=float(np.concatenate([each.seen for each in behind]).mean()),
        histogram=histogram(middle.seen, spectrum),
        flaws=bad,
        region=report.region,
        notes=(
            "the scene moves: memory of the noise, its rows, columns and level and the fixed pattern cannot be told "
            "from it; record something even, or hold the camera still",
            AT_MOST,
            *noise_notes(report),
            *outstanding([each.things for each in behind]),
            *blur_notes(blur, psf, still),
            *unlike_notes(spectrum, middle.picture, True),
        ),
    )


def _of_time(report: NoiseReport) -> dict[str, Any]:
    """Figures of noise that changes in time; where something moves, an upper bound of what is sharp and white alone:
    sharp texture that moves adds to it."""
    if report.moving or report.slides:
        sharp = without_rounding(Measured(report.fine, 0.0, report.fine_most, bound=True), report.rounded)
        return {"noise": sharp, "white": sharp}
    terms, memory, level, slower = report.terms, report.temporal.memory, report.level, report.stretch.slower
    rows, columns = report.lines.get("tv"), report.lines.get("th")
    drift = None if memory is None else memory.told_walk
    return {
        "noise": without_rounding(terms.tvh, report.rounded),
        "white": without_rounding(terms.tvh if memory is None else memory.white, report.rounded),
        "memory": None if memory is None else memory.correlated,
        "memory_frames": None if memory is None else memory.time_constant_s.map(lambda s: s * report.rate_hz),
        "memory_age_s": math.inf if memory is None else memory.age_s,
        "walk": None if drift is None else drift.map(lambda sigma: sigma / math.sqrt(report.rate_hz)),
        "row_noise": terms.tv if rows is None else rows.white,
        "column_noise": terms.th if columns is None else columns.white,
        "rows": rows,
        "columns": columns,
        "level": level.sigma,
        "level_frames": None if level.time_frames is None else level.time_frames.map(lambda time: time * slower),
    }


def _left(report: NoiseReport, count: int) -> tuple[Measured, Measured, Measured]:
    """Variances that noise in time leaves in the mean of so many frames: of pixels, rows, columns."""
    if report.moving:
        return exactly(report.fine**2 / count), exactly(0.0), exactly(0.0)
    terms = report.terms
    of = ((terms.tvh, report.temporal.memory), (terms.tv, report.lines.get("tv")), (terms.th, report.lines.get("th")))
    pixels, rows, columns = (
        sigma.map(lambda value: value**2 / count) if memory is None else memory.left.map(square) for sigma, memory in of
    )
    return pixels, rows, columns
