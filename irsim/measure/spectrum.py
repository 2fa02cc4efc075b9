"""How the texture of a background falls off with frequency, how far its grey levels spread, and how evenly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.errors import InputError
from irsim.measure.given import Values, check_frames
from irsim.types import Floats

HIGHEST = 0.2
"""Cycles a px up to which slopes are fitted: above, blur, noise and sharpening speak."""
_LEAST_SIDE = 64
_STRIP = 1.5
"""Half the width of the strips about the axes, cycles a side."""
_LOWEST = 4
"""Cycles a side from which slopes are fitted: below, too few waves fit in."""
_TILES = 8
"""Tiles along the shorter side: as large as the coarsest half wave that slopes are fitted from."""


@dataclass(frozen=True, slots=True)
class Texture:
    """Medians over frames.

    beta            2-D power spectrum ~ f^-beta
    beta_x, beta_y  the same in strips about its x and its y axis
    bend            how much steeper the upper half of the frequencies (by log f) falls than the lower
    spread          standard deviation of grey levels, in units of the frames
    rows            share of its square that is between the means of rows: much where a horizon parts the picture
    uneven          how unevenly the texture lies: 0 where it is alike all over, see `unevenness`
    """

    beta: float
    beta_x: float
    beta_y: float
    bend: float
    spread: float
    rows: float
    uneven: float


def texture(frames: Values) -> Texture:
    """Of frames (T, rows, columns). InputError for what is no array of finite numbers, where a side is below 64 px, or
    all frames are even."""
    check_frames(frames)
    rows, columns = frames.shape[1:]
    if min(rows, columns) < _LEAST_SIDE:
        raise InputError(
            f"{columns}x{rows} px are too few for a spectrum; allowed: at least {_LEAST_SIDE}x{_LEAST_SIDE}"
        )
    pictures = [np.asarray(frame, np.float64) for frame in frames]
    found = [
        (
            *slopes(picture),
            float(picture.std()),
            float(picture.mean(axis=1).var() / picture.var()),
            unevenness(picture),
        )
        for picture in pictures
        if picture.std() > 0
    ]
    if not found:
        raise InputError("every frame is even: there is no texture to measure")
    return Texture(*(float(value) for value in np.median(found, axis=0)))


def slopes(picture: Floats) -> tuple[float, float, float, float]:
    """(beta, beta_x, beta_y, bend) of a picture (rows, columns): Hann window, least squares in log-log.

    From 4 cycles over the shorter side to 0.2 cycles a px; powers are
    averaged over bands of equal width in log f first, so that the many high frequencies do not
    outweigh the few low ones.
    """
    rows, columns = picture.shape
    windowed = (picture - picture.mean()) * np.outer(np.hanning(rows), np.hanning(columns))
    power = np.square(np.abs(np.fft.rfft2(windowed)))
    fx, fy = np.meshgrid(np.fft.rfftfreq(columns), np.fft.fftfreq(rows))
    radius = np.hypot(fx, fy)
    x, y = np.abs(fy) < _STRIP / rows, np.abs(fx) < _STRIP / columns
    lowest = _LOWEST / min(rows, columns)
    middle = np.sqrt(lowest * HIGHEST)
    return (
        _slope(radius, power, lowest, HIGHEST),
        _slope(radius[x], power[x], lowest, HIGHEST),
        _slope(radius[y], power[y], lowest, HIGHEST),
        _slope(radius, power, middle, HIGHEST) - _slope(radius, power, lowest, middle),
    )


def unevenness(picture: Floats) -> float:
    """How much standard deviations within tiles differ: their standard deviation over their mean.

    picture (rows, columns) is cut into squares of an eighth of the shorter side; what is left over at its right and
    lower edges does not count. Noise is alike in all of them (0); trees before an even sky fill only some of them.
    """
    side = min(picture.shape) // _TILES
    down, across = (length // side for length in picture.shape)
    tiles = picture[: down * side, : across * side].reshape(down, side, across, side)
    within = tiles.std(axis=(1, 3))
    return float(within.std() / within.mean())


def _slope(frequency: Floats, power: Floats, lowest: float, highest: float) -> float:
    """-d log power / d log f between two frequencies."""
    kept = (frequency >= lowest) & (frequency <= highest)
    logs = np.log(frequency[kept])
    band = np.floor((logs - logs.min()) / 0.15).astype(int)
    counts = np.bincount(band)
    there = counts > 0
    at = np.bincount(band, logs)[there] / counts[there]
    powers = np.log((np.bincount(band, power[kept])[there] / counts[there]).clip(1e-30))
    return float(-np.polyfit(at, powers, 1)[0])
