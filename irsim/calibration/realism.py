"""Realism: comparison of a source's texture and noise with those of real infrared recordings."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from irsim.calibration.background import TEXTURE_PICTURES, background_pictures
from irsim.calibration.background_classes import CLASSES, Bounds, TextureFigures, check_class, texture_figures
from irsim.calibration.figures import Figures, measure_figures
from irsim.calibration.selection import Progress, may_be_pictures, read_frames, target_boxes
from irsim.calibration.statistics import Estimate
from irsim.errors import InputError, expect_source
from irsim.types import Source

_FACTOR = 2.0
"""Allowed ratio between fixed patterns of one sort of camera. One uncooled camera has 2.5 to 6.4 over eight clips."""
_WHITE, _MEMORY = 0.05, 0.15
"""Differences in lag-1 correlation between cooled cameras, and between uncooled ones of different frame rates."""
_FRAMES = 120
_PICTURES = "its noise is not judged: pictures of 8 bits hold no sensor's noise; allowed: a sensor's counts"
_HEAD = "95 % interval (all but correlation: in units of a pixel's noise)"


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
"""Least and greatest figures of each sort of camera: lag-1 correlation of a pixel's noise; fixed patterns and the noise
of the frame's level in units of the pixel's noise.

They were measured by the project on raw counts of a cooled LWIR camera with correction and a cooled MWIR camera without
(samples of pyradi), and of an uncooled Lepton 3 over eight clips (python-cptv).
"""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Figure and its allowed interval. A figure is outside if the whole of its own interval is outside, or its value if
    it has no interval."""

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
        """Value with two decimals, or with more where two do not show that it is outside the allowed interval."""
        places = 2
        while not self.inside and self.low <= float(f"{self.value:.{places}f}") <= self.high and places < 6:
            places += 1
        return f"{self.value:z.{places}f}"

    @property
    def allowed(self) -> str:
        return f"{self.low:.2f} to {self.high:.2f}"


@dataclass(frozen=True)
class Comparison:
    """Comparison of figures with the allowed intervals of all classes of background, or of all sorts of camera.

    figures     value of each figure as text
    by_name     verdicts on all figures for each class or sort
    required    name of the class or sort that decides, or None
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
        """Verdicts on figures outside their allowed intervals, by name of the class or sort."""
        outside = {name: tuple(each for each in verdicts if not each.inside) for name, verdicts in self.by_name.items()}
        return {name: verdicts for name, verdicts in outside.items() if verdicts}

    @property
    def fitting(self) -> tuple[str, ...]:
        """Names of the classes or sorts for which no figure is outside."""
        return tuple(name for name in self.by_name if name not in self.failing)

    def lines(self, head: str, none: str) -> Iterator[str]:
        """Yield the lines of the comparison: the figures, the names that fit (`head` and the names, or `none`), and the
        figures by which the other names do not fit."""
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
    """Texture and noise of a source, compared with those of real recordings.

    texture, classes    figures of texture and their comparison; empty and None where not measured
    noise, sorts        figures of noise and their comparison; empty and None where not determined
    noise_unknown       reason why noise is not determined, or None
    """

    texture: Mapping[str, float]
    classes: Comparison | None
    noise: Mapping[str, Estimate]
    sorts: Comparison | None
    noise_unknown: str | None

    @property
    def _comparisons(self) -> tuple[Comparison, ...]:
        return tuple(each for each in (self.classes, self.sorts) if each is not None)

    @property
    def inside(self) -> bool:
        """True where all figures are inside the intervals of the required class and sort."""
        return all(verdict.inside for each in self._comparisons for verdict in each.verdicts)

    def lines(self) -> Iterator[str]:
        """Yield the comparisons as lines of text, without `noise_unknown`."""
        if self.classes is not None:
            yield from self.classes.lines("looks like", "no class of real recordings")
        if self.sorts is not None:
            yield from self.sorts.lines("its noise is like", "that of no real camera")

    def as_json(self) -> dict[str, Any]:
        """Return the comparisons as JSON values."""
        found: dict[str, Any] = {}
        if self.classes is not None:
            found = {**self.texture, "like": self.classes.required, "classes": self.classes.fitting}
        if self.sorts is None:
            found["noise_unknown"] = self.noise_unknown
        else:
            noise = {figure: value.as_json() for figure, value in self.noise.items()}
            found |= {"camera": self.sorts.required, **noise, "cameras": self.sorts.fitting}
        outside: dict[str, list[str]] = {}
        ranges: dict[str, dict[str, Any]] = {}
        for each in self._comparisons:
            outside |= {name: [v.figure for v in verdicts] for name, verdicts in each.failing.items()}
            ranges |= {v.figure: {"low": v.low, "high": v.high, "inside": v.inside} for v in each.verdicts}
        return {**found, "outside": outside, "ranges": ranges}


def measure_realism(
    source: Source, like: str | None = None, camera: str | None = None, progress: Progress | None = None
) -> Realism:
    """Return texture and noise of a source, compared with those of real recordings.

    like        class of background whose ranges the texture must meet, one of `CLASSES`
    camera      required sort of camera, one of `CAMERAS`; texture is then measured only with `like`

    Raises InputError for unknown names, for pictures too small for texture, and for undetermined noise with `camera`.
    """
    expect_source("a comparison", source)
    if like is not None:
        check_class(like)
    if camera is not None:
        check_sort(camera)
    found, classes = {}, None
    if camera is None or like is not None:
        measured = texture_figures(background_pictures(source, TEXTURE_PICTURES))
        found, classes = asdict(measured), compare_texture(measured, like)
    try:
        if may_be_pictures(source) and camera is None:
            raise InputError(_PICTURES)
        wanted = range(min(_FRAMES, len(source)))
        counts, times = read_frames(source, wanted, progress)
        boxes, top = target_boxes(source, wanted.start, wanted.stop), 2.0**source.bits - 1
        points = camera is not None
        figures = measure_figures(counts, source.rate_hz, None, top, points=points, times=times, boxes=boxes)
        noise = noise_figures(figures)
    except InputError as error:
        if camera is not None:
            raise
        return Realism(found, classes, {}, None, str(error))
    return Realism(found, classes, noise, compare_noise(figures, camera), None)


def noise_figures(found: Figures) -> dict[str, Estimate]:
    """Return the figures listed in `CAMERAS`. Raises InputError where the recording does not determine them."""
    if found.pixel is None or found.row is None or found.column is None or found.level is None:
        raise InputError("its noise cannot be judged: the scene moves; allowed: a still camera")
    unit = found.noise.value
    if not unit:
        raise InputError("its noise cannot be judged: it is below the rounding to whole counts")
    row = found.row
    if found.even_rows is not None:  # the variance of rows includes the offset of even rows
        even = found.even_rows
        near, far = sorted((abs(even.low), abs(even.high)))
        near = 0.0 if even.low < 0 < even.high else near
        row = Estimate(math.hypot(row.value, even.value), math.hypot(row.low, near), math.hypot(row.high, far))
    sigmas = {"pixel": found.pixel, "column": found.column, "row": row, "level": found.level}
    scaled = {name: sigma.map(lambda value: value / unit) for name, sigma in sigmas.items()}
    return {"correlation": _correlation(found), **scaled}


def _correlation(found: Figures) -> Estimate:
    """Return the lag-1 correlation of a pixel's noise, white plus AR(1); 0 where no correlated part is found."""
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
    """Return the comparison of a texture with all classes of background. Raises InputError for an unknown class."""
    if like is not None:
        check_class(like)
    by_name = {
        name: tuple(Verdict(figure, getattr(found, figure), *ends) for figure, ends in real.ranges().items())
        for name, real in CLASSES.items()
    }
    return Comparison({each: f"{getattr(found, each):z8.2f}" for each in TextureFigures.__slots__}, by_name, like)


def compare_noise(found: Figures, camera: str | None = None) -> Comparison:
    """Return the comparison of noise with all sorts of camera. InputError for an unknown sort or undetermined noise."""
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
        return "none found; taken as exact"
    low, high = f"{value.low:.2f}", f"{value.high:.2f}"
    return f"{low} to {high}" if low != high else "known to better than 0.01"


def check_sort(camera: object) -> None:
    """Raise InputError for an unknown sort of camera."""
    if not (isinstance(camera, str) and camera in CAMERAS):
        raise InputError(f"camera {reprlib.repr(camera)}: no such sort of camera; allowed: {', '.join(CAMERAS)}")
