"""Waves of deep water that travel: octaves of them, each two trains, as slopes of the surface."""

from __future__ import annotations

import math

import cv2
import numpy as np

from irsim.rng import normals, stream
from irsim.types import Floats

GRAVITY = 9.81
"""m/s2, rounded: with the `STANDARD_GRAVITY` of paths, 0.03 % less, each seed would have slightly other waves."""

TILE, PER_WAVE = 512, 16
"""Side of a wave texture, texels, and texels for each wavelength at its middle."""


def longest_wave(wind_m_s: float) -> float:
    """Wavelength, m, at the peak of a full sea: w = 0.877 g / U (Pierson and Moskowitz 1964), k = w^2 / g."""
    return float(2 * np.pi * wind_m_s**2 / (0.877**2 * GRAVITY))


SIDES_DEG = (-20.0, 20.0)
"""Directions of an octave's two trains, from that of the wind."""


def spread_rad(number: int) -> float:
    """How far the directions of waves are spread about that of the wind, rms, in an octave, counted from that of the
    longest wave on: sqrt(2 / (s + 1)) of the law cos^(2 s)(angle / 2), s = 9.77 (f / f_peak)^-2.33 where the wind is
    1.17 times as fast as the longest wave (Hasselmann, Dunckel and Ewing, J. Physical Oceanography 10 (1980) 1264).
    Short waves run nearly all ways."""
    s = 9.77 * 2 ** (-2.33 * number / 2)  # f goes with the root of 1 / length
    return math.sqrt(2 / (s + 1))


class Octave:
    """An octave of waves: two trains, each with its own groups."""

    def __init__(self, wind_m_s: float, wind_deg: float, number: int, seed: int) -> None:
        self.length_m = longest_wave(wind_m_s) / 2**number
        self._speed = math.sqrt(GRAVITY * self.length_m / (2 * math.pi))  # of deep water
        self._angles = [math.radians(wind_deg + side) for side in SIDES_DEG]
        self._trains = [padded(wave_train(seed, number, side)) for side in range(2)]
        draw = stream(seed, "waves", number)
        self._starts = draw.uniform(0, TILE, (2, 2)).tolist()

    def at(self, right: Floats, ahead: Floats, time: float) -> tuple[Floats, Floats]:
        """Slopes to the right and towards the camera, each axis of variance 1 if waves ran all ways, (rows, cols)."""
        per_m = PER_WAVE / self.length_m / TILE
        across, along = np.zeros_like(right), np.zeros_like(right)
        for angle, train, (run, beside) in zip(self._angles, self._trains, self._starts, strict=True):
            sine, cosine = math.sin(angle), math.cos(angle)
            # The train has run so many of its periods: the whole ones do not tell.
            run = math.fmod(run / TILE - self._speed * time * per_m, 1)
            wave = sampled(
                train,
                mixed(right, cosine * per_m, ahead, -sine * per_m, beside / TILE),
                mixed(right, sine * per_m, ahead, cosine * per_m, run),
            )
            cv2.scaleAdd(wave, sine, across, dst=across)
            cv2.scaleAdd(wave, -cosine, along, dst=along)
        return across, along


def wave_train(seed: int, number: int, side: int) -> Floats:
    """(TILE, TILE) periodic waves that run along the rows' axis, PER_WAVE texels long, of variance 1: together with the
    other train they are spread as `spread_rad` says."""
    own = math.sqrt(spread_rad(number) ** 2 - math.radians(SIDES_DEG[side]) ** 2)
    fx, fy = np.fft.rfftfreq(TILE)[None, :], np.fft.fftfreq(TILE)[:, None]
    length = np.hypot(fx, fy) * PER_WAVE
    with np.errstate(divide="ignore"):
        octave = np.exp(-0.5 * (np.log2(np.maximum(length, 1e-9)) / 0.4) ** 2)
    spread = np.exp(-0.25 * (np.arctan2(fx, np.abs(fy)) / own) ** 2)  # of amplitudes: own is that of their squares
    white = np.fft.rfft2(normals((TILE, TILE), seed, "waves", number, side))
    field = np.fft.irfft2(white * octave * spread, s=(TILE, TILE))
    return np.asarray(field / field.std(), dtype=np.float32)


def padded(texture: Floats) -> Floats:
    """A periodic texture with its first row and column once more at its end, for `sampled`."""
    return np.asarray(cv2.copyMakeBorder(np.asarray(texture, np.float32), 0, 1, 0, 1, cv2.BORDER_WRAP))


def mixed(one: Floats, share: float, other: Floats, others: float, shift: float) -> Floats:
    """one * share + other * others + shift, in one pass."""
    return np.asarray(cv2.addWeighted(one, share, other, others, shift), dtype=np.float32)


def sampled(texture: Floats, columns: Floats, rows: Floats) -> Floats:
    """A `padded` texture at places (any size) between its texels; places are float32, in periods."""
    x, y = ((at - np.floor(at)) * np.float32(TILE) for at in (columns, rows))
    return np.asarray(cv2.remap(texture, x, y, cv2.INTER_LINEAR))
