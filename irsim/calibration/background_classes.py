"""Classes of background: figures of the texture of pictures, and their intervals in real infrared recordings."""

from __future__ import annotations

import reprlib
from dataclasses import dataclass

import numpy as np

from irsim.calibration.statistics import Values, check_frames
from irsim.errors import InputError
from irsim.types import Floats

Bounds = tuple[float, float]
_LEAST_SIDE = 64
_LOWEST, _HIGHEST = 4, 0.2
"""Lowest frequency, cycles a side, and highest, cycles a px, to which slopes are fitted. At other frequencies blur,
noise and sharpening prevail."""
_SLOPE, _AXIS = 0.2, 0.35
"""Differences in beta, and in beta along one axis, that occur between recordings of one class."""
_SPREAD, _UNEVEN = 1.25, 1.4
"""Ratios of the spreads, and of the unevennesses, of recordings of one class."""
_ROWS = 0.2
"""Difference in the fraction `rows` between recordings of one class."""
BEND = (-1.0, 1.0)
"""Allowed bend of the spectrum. Three real sequences have 0.0 to 0.1, blurred white noise has 1.4 and more."""


@dataclass(frozen=True, slots=True)
class TextureFigures:
    """Figures of the texture of 8-bit pictures, medians over frames.

    beta            2-D power spectrum ~ f^-beta, from 4 cycles a side to 0.2 cycles a px
    beta_x, beta_y  beta in narrow strips of the spectrum along the axes
    bend            slope of the upper half of the frequencies (in log f) less the slope of the lower half
    spread          standard deviation of grey levels
    rows            fraction of the variance that lies between the means of rows, large with a horizon
    uneven          relative standard deviation of the standard deviations of tiles, 1/8 of the shorter side wide
    """

    beta: float
    beta_x: float
    beta_y: float
    bend: float
    spread: float
    rows: float
    uneven: float


def texture_figures(frames: Values) -> TextureFigures:
    """Return the texture figures of frames (T, rows, columns). InputError for sides below 64 px and uniform frames."""
    check_frames(frames)
    rows, columns = frames.shape[1:]
    if min(rows, columns) < _LEAST_SIDE:
        raise InputError(
            f"{columns}x{rows} px are too few for a spectrum; allowed: at least {_LEAST_SIDE}x{_LEAST_SIDE}"
        )
    pictures = [np.asarray(frame, np.float64) for frame in frames]
    found = [
        (*slopes(each), float(each.std()), float(each.mean(axis=1).var() / each.var()), unevenness(each))
        for each in pictures
        if each.std() > 0
    ]
    if not found:
        raise InputError("every frame is uniform: there is no texture to measure")
    return TextureFigures(*(float(value) for value in np.median(found, axis=0)))


def slopes(picture: Floats) -> tuple[float, float, float, float]:
    """Return (beta, beta_x, beta_y, bend) of a picture (rows, columns) under a Hann window."""
    rows, columns = picture.shape
    window = np.outer(np.hanning(rows), np.hanning(columns))
    power = np.square(np.abs(np.fft.rfft2((picture - picture.mean()) * window)))
    fx, fy = np.meshgrid(np.fft.rfftfreq(columns), np.fft.fftfreq(rows))
    radius = np.hypot(fx, fy)
    x, y = np.abs(fy) < 1.5 / rows, np.abs(fx) < 1.5 / columns
    lowest = _LOWEST / min(rows, columns)
    middle = np.sqrt(lowest * _HIGHEST)
    return (
        _slope(radius, power, lowest, _HIGHEST),
        _slope(radius[x], power[x], lowest, _HIGHEST),
        _slope(radius[y], power[y], lowest, _HIGHEST),
        _slope(radius, power, middle, _HIGHEST) - _slope(radius, power, lowest, middle),
    )


def unevenness(picture: Floats) -> float:
    """Return the relative standard deviation of the standard deviations of square tiles of a picture."""
    side = min(picture.shape) // 8
    down, across = (length // side for length in picture.shape)
    within = picture[: down * side, : across * side].reshape(down, side, across, side).std(axis=(1, 3))
    return float(within.std() / within.mean())


def _slope(frequency: Floats, power: Floats, lowest: float, highest: float) -> float:
    """Return -d log power / d log f by a least-squares fit to means over bands of equal width in log f."""
    kept = (frequency >= lowest) & (frequency <= highest)
    logs = np.log(frequency[kept])
    band = np.floor((logs - logs.min()) / 0.15).astype(int)
    counts = np.bincount(band)
    there = counts > 0
    at = np.bincount(band, logs)[there] / counts[there]
    powers = np.log((np.bincount(band, power[kept])[there] / counts[there]).clip(1e-30))
    return float(-np.polyfit(at, powers, 1)[0])


@dataclass(frozen=True)
class RealTexture:
    """Least and greatest `TextureFigures` of real recordings of a class; None where not measured."""

    beta: Bounds
    beta_x: Bounds
    beta_y: Bounds
    spread: Bounds
    rows: Bounds = (0.0, 1.0)
    uneven: Bounds | None = None

    def ranges(self) -> dict[str, Bounds]:
        """Return the allowed interval of each figure: that of the class, widened by differences within a class."""
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
"""Medians of infrared recordings, measured by the project from 4/N to 0.2 cycles/px, with N the shorter side in px.
Each `spread` is that of tiles.

cloud: thin, thick and broken cloud, one sequence without compression. ground: from the air by day and night, at long
range, a park. treeline: between bare trees and a horizon with a field. Three sequences of Svanstrom et al., "A dataset
for multi-sensor drone detection" (Data in Brief 2021), widen these intervals. They were measured without their targets,
as `irsim realism` does:
thin cloud over a bright horizon    beta 3.6, 2.9 / 2.8, spread 42, rows 0.88, uneven 1.24
part above that horizon alone       beta 3.8, 2.7 / 3.1, spread 17, rows 0.33, uneven 0.58
a line of hot trees                 beta 3.8, 1.1 / 4.0, spread 50, rows 0.92, uneven 1.46
bare trees before the sky           beta 2.5, 2.2 / 2.4, spread 42, rows 0.10, uneven 1.31

`rows` and `uneven` are from these sequences alone. For cloud, beta_y is that above the horizon, and the spread there is
left out.
"""


def check_class(like: object) -> None:
    """Raise InputError for an unknown class of background."""
    if not (isinstance(like, str) and like in CLASSES):
        raise InputError(f"like {reprlib.repr(like)}: no such class; allowed: {', '.join(CLASSES)}")
