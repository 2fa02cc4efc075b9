"""Realism: texture and noise of a source compared with those of real infrared recordings."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from irsim.calibration.background import TEXTURE_PICTURES, background_pictures
from irsim.calibration.figures import Figures, measure_figures
from irsim.calibration.selection import Progress, may_be_pictures, read_frames, target_boxes
from irsim.calibration.statistics import Estimate
from irsim.calibration.texture import TextureFigures, texture_figures
from irsim.errors import InputError, expect_source
from irsim.types import Source

Bounds = tuple[float, float]
_SLOPE, _AXIS = 0.2, 0.35
"""Differences in beta, and in beta along one axis, between recordings of one class."""
_SPREAD, _UNEVEN = 1.25, 1.4
"""Factors between spreads, and unevennesses, of recordings of one class."""
_ROWS = 0.2
"""Difference in the share of rows between recordings of one class."""
BEND = (-1.0, 1.0)
"""Allowed bend of the spectrum: three real sequences have 0.0 to 0.1, blurred white noise 1.4 and more."""
_FACTOR = 2.0
"""Factor between fixed patterns of sensors of one sort: one uncooled camera has 2.5 to 6.4 over eight clips."""
_WHITE, _MEMORY = 0.05, 0.15
"""Differences in the lag-1 correlation of cooled cameras, and of uncooled ones of different rates."""
_FRAMES = 120
_PICTURES = "its noise is not judged: pictures of 8 bits hold no sensor's noise; allowed: a sensor's counts"
_HEAD = "95 % interval (all but correlation: in units of a pixel's noise)"


@dataclass(frozen=True)
class RealTexture:
    """Least and greatest figures of real recordings of a class; see `TextureFigures`.

    rows and uneven are open where no sequence of the class was measured.
    """

    beta: Bounds
    beta_x: Bounds
    beta_y: Bounds
    spread: Bounds
    rows: Bounds = (0.0, 1.0)
    uneven: Bounds | None = None

    def ranges(self) -> dict[str, Bounds]:
        """Return the allowed range of each figure: of the class, widened by the differences within a class."""
        found = {
            "beta": (self.beta[0] - _SLOPE, self.beta[1] + _SLOPE),
            "beta_x": (self.beta_x[0] - _AXIS, self.beta_x[1] + _AXIS),
            "beta_y": (self.beta_y[0] - _AXIS, self.beta_y[1] + _AXIS),
            "bend": BEND,
            "spread": (self.spread[0] / _SPREAD, self.spread[1] * _SPREAD),
            "rows": (max(self.rows[0] - _ROWS, 0.0), min(self.rows[1] + _ROWS, 1.0)),
        }
        if self.uneven is not None:
            found["uneven"] = self.uneven[0] / _UNEVEN, self.uneven[1] * _UNEVEN
        return found


CLASSES = {
    "cloud": RealTexture((2.9, 4.1), (2.2, 3.2), (3.1, 4.7), (19, 42), uneven=(0.58, 1.24)),
    "horizon": RealTexture((3.6, 3.6), (2.9, 2.9), (4.0, 4.0), (68, 68), (0.88, 0.92), (1.24, 1.46)),
    "trees": RealTexture((2.2, 2.5), (2.2, 2.2), (1.9, 2.4), (42, 61), (0.1, 0.1), (1.31, 1.31)),
    "treeline": RealTexture((2.2, 3.8), (1.1, 2.9), (1.9, 4.0), (50, 68), (0.88, 0.92), (1.24, 1.46)),
    "ground": RealTexture((2.3, 2.9), (1.8, 2.7), (2.1, 2.75), (12.5, 32)),
    "city": RealTexture((2.4, 2.4), (2.2, 2.2), (2.4, 2.4), (33, 33)),
}
"""Medians of infrared recordings, measured by the project from 4/N to 0.2 cycles/px, N the shorter side in px; spreads
are those of tiles.

cloud: thin, thick and broken cloud, one sequence without compression. ground: from the air by day and night, at long
range, a park. treeline: between bare trees and horizon with field. Three sequences of Svanstrom et al., "A dataset for
multi-sensor drone detection" (Data in Brief 2021), widen these, measured as `irsim realism` does without their targets:

thin cloud over a bright horizon    beta 3.6, 2.9 / 2.8, spread 42, rows 0.88, uneven 1.24
the same above the horizon alone    beta 3.8, 2.7 / 3.1, spread 17, rows 0.33, uneven 0.58
a line of hot trees                 beta 3.8, 1.1 / 4.0, spread 50, rows 0.92, uneven 1.46
bare trees before the sky           beta 2.5, 2.2 / 2.4, spread 42, rows 0.10, uneven 1.31

Rows and uneven are from these alone. For cloud, beta_y is that above the horizon, and the spread there is left out.
"""


def _wide(low: float, high: float) -> Bounds:
    return low / _FACTOR, high * _FACTOR


CAMERAS: dict[str, dict[str, Bounds]] = {
    "cooled": {
        "correlation": (-_WHITE, _WHITE),
        "pixel": _wide(0.37, 0.40),
        "column": _wide(0.04, 0.085),
        "row": _wide(0.10, 0.12),
        "level": _wide(0.19, 0.21),
    },
    "uncorrected": {
        "correlation": (-_WHITE, _WHITE),
        "pixel": _wide(4.7, 4.8),
        "column": _wide(0.78, 0.91),
        "row": _wide(8.8, 15.8),
    },
    "uncooled": {
        "correlation": (0.74 - _MEMORY, min(0.90 + _MEMORY, 1.0)),
        "pixel": _wide(0.7, 4.6),
        "column": _wide(0.17, 1.0),
        "row": _wide(0.11, 0.93),
    },
}
"""Lag-1 correlation of a pixel's noise; fixed patterns and the frame's level in units of the pixel's noise.

Measured by the project on raw counts of a cooled LWIR camera after correction and a cooled MWIR camera without (samples
of pyradi), and of an uncooled Lepton 3 over eight clips (python-cptv).
"""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Figure and its allowed range. The figure is outside if its whole interval is (without an interval, its value)."""

    figure: str
    value: float
    low: float
    high: float
    interval: Bounds | None = None

    @property
    def inside(self) -> bool:
        least, most = self.interval or (self.value, self.value)
        return least <= self.high and most >= self.low

    @property
    def measured(self) -> str:
        """Value to hundredths; outside of the range, with as many digits as show it."""
        places = 2
        while not self.inside and self.low <= float(f"{self.value:.{places}f}") <= self.high and places < 6:
            places += 1
        return f"{self.value:z.{places}f}"

    @property
    def allowed(self) -> str:
        return f"{self.low:.2f} to {self.high:.2f}"


@dataclass(frozen=True)
class Comparison:
    """Measured figures compared with the ranges of all classes of background, or of all sorts of camera.

    figures     figure -> its value as text
    by_name     name of a class or sort -> verdicts on its figures
    required    name whose verdicts decide, or None
    head        heading of the column of values
    """

    figures: Mapping[str, str]
    by_name: Mapping[str, tuple[Verdict, ...]]
    required: str | None
    head: str = ""

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        return () if self.required is None else self.by_name[self.required]

    @property
    def failing(self) -> dict[str, tuple[Verdict, ...]]:
        """Name -> verdicts outside of its ranges, for names with such verdicts."""
        outside = {name: tuple(each for each in verdicts if not each.inside) for name, verdicts in self.by_name.items()}
        return {name: verdicts for name, verdicts in outside.items() if verdicts}

    @property
    def fitting(self) -> tuple[str, ...]:
        """Names whose ranges contain all figures."""
        return tuple(name for name in self.by_name if name not in self.failing)

    def lines(self, head: str, none: str) -> Iterator[str]:
        """Yield the figures; then `head` with the names that fit, or `none`; then the figures that exclude other
        names."""
        heading = self.head if self.required is None else f"allowed for {self.required}"
        yield f"{'figure':11} measured  {heading}".rstrip()
        if self.required is None:
            for figure, text in self.figures.items():
                yield f"{figure:11} {text}"
        for each in self.verdicts:
            yield f"{each.figure:11} {each.measured:>8}  {each.allowed}  {'ok' if each.inside else 'OUTSIDE'}"
        yield f"{head}: {', '.join(self.fitting) or none}"
        if self.required is None:
            for name, verdicts in self.failing.items():
                outside = (f"{each.figure} {each.measured} (allowed {each.allowed})" for each in verdicts)
                yield f"  not {name}: {', '.join(outside)}"


@dataclass(frozen=True)
class Realism:
    """Texture and noise compared with real ones.

    texture, classes    texture figures and their comparison; empty and None where it was not measured
    noise, sorts        noise figures and their comparison; empty and None where noise cannot be compared
    noise_unknown       reason why noise cannot be compared, or None
    """

    texture: Mapping[str, float]
    classes: Comparison | None
    noise: Mapping[str, Estimate]
    sorts: Comparison | None
    noise_unknown: str | None

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        return tuple(each for each in (self.classes, self.sorts) if each is not None)

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Verdicts for the required class and sort."""
        return tuple(verdict for each in self.comparisons for verdict in each.verdicts)

    @property
    def inside(self) -> bool:
        """True if no figure is outside of its range."""
        return all(verdict.inside for verdict in self.verdicts)

    def lines(self) -> Iterator[str]:
        """Yield lines of text, without `noise_unknown`."""
        if self.classes is not None:
            yield from self.classes.lines("looks like", "no class of real recordings")
        if self.sorts is not None:
            yield from self.sorts.lines("its noise is like", "that of no real camera")

    def as_json(self) -> dict[str, Any]:
        """Return plain values, ready for json.dumps."""
        found: dict[str, Any] = {}
        if self.classes is not None:
            found = {**self.texture, "like": self.classes.required, "classes": self.classes.fitting}
        if self.sorts is None:
            found["noise_unknown"] = self.noise_unknown
        else:
            noise = {figure: value.as_json() for figure, value in self.noise.items()}
            found |= {"camera": self.sorts.required, **noise, "cameras": self.sorts.fitting}
        failing = {name: verdicts for each in self.comparisons for name, verdicts in each.failing.items()}
        outside = {name: [verdict.figure for verdict in verdicts] for name, verdicts in failing.items()}
        ranges = {v.figure: {"low": v.low, "high": v.high, "inside": v.inside} for v in self.verdicts}
        return {**found, "outside": outside, "ranges": ranges}


def measure_realism(
    source: Source, like: str | None = None, camera: str | None = None, progress: Progress | None = None
) -> Realism:
    """Return a source's texture and noise compared with those of real recordings.

    like        class of background, one of `CLASSES`, that the texture must fit
    camera      sort of camera, one of `CAMERAS`, that the noise must fit; texture is then measured only with `like`

    Raise InputError for unknown names, pictures too small for texture, and noise that cannot be compared with `camera`.
    """
    expect_source("a comparison", source)
    if like is not None:
        check_class(like)
    if camera is not None:
        check_sort(camera)
    found: dict[str, float] = {}
    classes = None
    if camera is None or like is not None:
        measured = texture_figures(background_pictures(source, TEXTURE_PICTURES))
        found, classes = asdict(measured), compare_texture(measured, like)
    try:
        if may_be_pictures(source) and camera is None:
            raise InputError(_PICTURES)
        figures = _figures(source, camera is not None, progress)
        noise = noise_figures(figures)
    except InputError as error:
        if camera is not None:
            raise
        return Realism(found, classes, {}, None, str(error))
    return Realism(found, classes, noise, compare_noise(figures, camera), None)


def _figures(source: Source, points: bool, progress: Progress | None) -> Figures:
    wanted = range(min(_FRAMES, len(source)))
    counts, times = read_frames(source, wanted, progress)
    boxes = target_boxes(source, wanted.start, wanted.stop)
    top = 2.0**source.bits - 1
    return measure_figures(counts, source.rate_hz, None, top, points=points, times=times, boxes=boxes)


def noise_figures(found: Figures) -> dict[str, Estimate]:
    """Return the figures of `CAMERAS`; raise InputError where the recording does not determine them."""
    if found.pixel is None or found.row is None or found.column is None or found.level is None:
        raise InputError("its noise cannot be judged: the scene moves; allowed: a still camera")
    unit = found.noise.value
    if not unit:
        raise InputError("its noise cannot be judged: it is below the rounding to whole counts")
    row = found.row
    if found.even_rows is not None:  # the variance of rows includes that of even above odd ones
        even = found.even_rows
        near, far = sorted((abs(even.low), abs(even.high)))
        near = 0.0 if even.low < 0 < even.high else near
        row = Estimate(math.hypot(row.value, even.value), math.hypot(row.low, near), math.hypot(row.high, far))
    sigmas = {"pixel": found.pixel, "column": found.column, "row": row, "level": found.level}
    scaled = {name: sigma.map(lambda value: value / unit) for name, sigma in sigmas.items()}
    return {"correlation": _correlation(found), **scaled}


def _correlation(found: Figures) -> Estimate:
    """Return the lag-1 correlation of white and AR(1) noise; 0 without memory."""
    memory, frames, white = found.memory, found.memory_frames, found.white
    if memory is None or frames is None:
        return Estimate(0.0, 0.0, 0.0)

    def lag_1(correlated: float, independent: float, time: float) -> float:
        return correlated**2 / (correlated**2 + independent**2) * math.exp(-1 / time) if correlated and time else 0.0

    return Estimate(
        lag_1(memory.value, white.value, frames.value),
        lag_1(memory.low, white.high, frames.low),
        lag_1(memory.high, white.low, frames.high),
    )


def compare_texture(found: TextureFigures, like: str | None = None) -> Comparison:
    """Return the comparison of a texture with all classes; raise InputError for an unknown class."""
    if like is not None:
        check_class(like)
    by_name = {
        name: tuple(Verdict(figure, getattr(found, figure), *ends) for figure, ends in real.ranges().items())
        for name, real in CLASSES.items()
    }
    return Comparison({each: f"{getattr(found, each):z8.2f}" for each in TextureFigures.__slots__}, by_name, like)


def compare_noise(found: Figures, camera: str | None = None) -> Comparison:
    """Return the comparison of noise with all sorts of camera; raise InputError for an unknown sort or undetermined
    noise."""
    if camera is not None:
        check_sort(camera)
    values = noise_figures(found)
    by_name = {
        sort: tuple(
            Verdict(name, values[name].value, low, high, (values[name].low, values[name].high))
            for name, (low, high) in ranges.items()
        )
        for sort, ranges in CAMERAS.items()
    }
    figures = {name: f"{each.value:8.2f}  {_interval(each)}" for name, each in values.items()}
    return Comparison(figures, by_name, camera, _HEAD)


def _interval(value: Estimate) -> str:
    if value.low == value.high:
        return "none found, taken as this"
    low, high = f"{value.low:.2f}", f"{value.high:.2f}"
    return f"{low} to {high}" if low != high else "known to better than 0.01"


def check_class(like: object) -> None:
    """Raise InputError for an unknown class of background."""
    if not (isinstance(like, str) and like in CLASSES):
        raise InputError(f"like {reprlib.repr(like)}: no such class; allowed: {', '.join(CLASSES)}")


def check_sort(camera: object) -> None:
    """Raise InputError for an unknown sort of camera."""
    if not (isinstance(camera, str) and camera in CAMERAS):
        raise InputError(f"camera {reprlib.repr(camera)}: no such sort of camera; allowed: {', '.join(CAMERAS)}")
