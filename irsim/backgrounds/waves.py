"""Deep-water waves that travel: octaves of two wave trains each, as slopes of the surface."""

from __future__ import annotations

import math

import cv2
import numpy as np

from irsim.backgrounds.texture import closed
from irsim.rng import normals, stream
from irsim.types import Floats

GRAVITY = 9.81
"""Acceleration of gravity, m/s2, rounded; the `STANDARD_GRAVITY` of trajectories would change the waves of each
seed."""

TILE, PER_WAVE = 512, 16
"""Side of a wave texture, texels, and texels per wavelength at the middle of the octave."""

PEAK = 0.877
"""Wind speed over the phase speed of the longest wave of a fully developed sea, whose frequency is w = 0.877 g / U
(Pierson and Moskowitz 1964)."""

TRAIN_RAD = math.radians(20)
"""Angle from the wind to each of an octave's two wave trains, one on either side of it."""


def longest_wave(wind_m_s: float) -> float:
    """Return the wavelength, m, at the peak of a fully developed sea: k = w^2 / g."""
    return float(2 * np.pi * wind_m_s**2 / (PEAK**2 * GRAVITY))


def directional_rms_rad(number: int) -> float:
    """Return the circular rms of wave directions about the wind in an octave, counted from the longest wave.

    It is sqrt(2 / (s + 1)) of the law cos^(2 s)(angle / 2) with s = 9.77 (f / f_peak)^mu, mu = -2.33 - 1.45 (U / c -
    1.17), wind U and phase speed c of the longest wave (Hasselmann, Dunckel and Ewing, J. Physical Oceanography 10
    (1980) 1264, measured up to a few times f_peak). Short waves run in nearly all directions.
    """
    mu = -2.33 - 1.45 * (PEAK - 1.17)
    s = 9.77 * 2 ** (mu * number / 2)  # f is proportional to length^(-1/2)
    return math.sqrt(2 / (s + 1))


def train_rms_rad(number: int) -> float:
    """Return the standard deviation of directions in each of the two trains, truncated at 90 degrees, as all waves of a
    train run forward. Both trains together thus have at most 46 to 50 degrees, reached from the fourth octave on."""
    return math.sqrt(directional_rms_rad(number) ** 2 - TRAIN_RAD**2)


def slope_components(number: int) -> tuple[float, float]:
    """Return the rms slopes of a train across and along the wind; their squares add up to 1."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 721)
    weights = np.exp(-0.5 * (angles / train_rms_rad(number)) ** 2)
    across = float(np.average(np.sin(angles + TRAIN_RAD) ** 2, weights=weights))
    return math.sqrt(across), math.sqrt(1 - across)


class WaveOctave:
    """Octave of waves: two trains, each with its own groups."""

    def __init__(self, wind_m_s: float, wind_deg: float, number: int, seed: int) -> None:
        self.length_m = longest_wave(wind_m_s) / 2**number
        self._speed = math.sqrt(GRAVITY * self.length_m / (2 * math.pi))  # phase speed in deep water, m/s
        wind = math.radians(wind_deg)
        self._angles = [wind - TRAIN_RAD, wind + TRAIN_RAD]
        across, along = slope_components(number)
        self._slopes = [
            (along * math.sin(wind) + beside * math.cos(wind), along * math.cos(wind) - beside * math.sin(wind))
            for beside in (-across, across)
        ]
        self._trains = [closed(wave_train(seed, number, side)) for side in range(2)]
        draw = stream(seed, "waves", number)
        self._starts = draw.uniform(0, TILE, (2, 2)).tolist()

    def at(self, right: Floats, ahead: Floats, time: float) -> tuple[Floats, Floats]:
        """Return slopes to the right and towards the camera, (rows, cols), at positions in m and a time in s.

        Each axis would have variance 1 if waves ran in all directions. All waves of a train have the direction of its
        rms slope.
        """
        per_m = PER_WAVE / self.length_m / TILE
        across, along = np.zeros_like(right), np.zeros_like(right)
        of_trains = zip(self._angles, self._slopes, self._trains, self._starts, strict=True)
        for angle, (to_right, to_ahead), train, (run, beside) in of_trains:
            sine, cosine = math.sin(angle), math.cos(angle)
            # Periods travelled, without the whole ones.
            run = math.fmod(run / TILE - self._speed * time * per_m, 1)
            wave = sampled(
                train,
                weighted_sum(right, cosine * per_m, ahead, -sine * per_m, beside / TILE),
                weighted_sum(right, sine * per_m, ahead, cosine * per_m, run),
            )
            cv2.scaleAdd(wave, to_right, across, dst=across)
            cv2.scaleAdd(wave, -to_ahead, along, dst=along)
        return across, along


def wave_train(seed: int, number: int, side: int) -> Floats:
    """Return periodic waves along the rows' axis, (TILE, TILE), PER_WAVE texels long, of variance 1.

    Both trains together have the directions of `directional_rms_rad`, within the limits of `train_rms_rad`.
    """
    fx, fy = np.fft.rfftfreq(TILE)[None, :], np.fft.fftfreq(TILE)[:, None]
    length = np.hypot(fx, fy) * PER_WAVE
    with np.errstate(divide="ignore"):
        octave = np.exp(-0.5 * (np.log2(np.maximum(length, 1e-9)) / 0.4) ** 2)
    spread = np.exp(-0.25 * (np.arctan2(fx, np.abs(fy)) / train_rms_rad(number)) ** 2)  # spread of amplitudes
    white = np.fft.rfft2(normals((TILE, TILE), seed, "waves", number, side))
    field = np.fft.irfft2(white * octave * spread, s=(TILE, TILE))
    return np.asarray(field / field.std(), dtype=np.float32)


def weighted_sum(one: Floats, share: float, other: Floats, others: float, shift: float) -> Floats:
    """Return one * share + other * others + shift, in one pass."""
    return np.asarray(cv2.addWeighted(one, share, other, others, shift), dtype=np.float32)


def sampled(texture: Floats, columns: Floats, rows: Floats) -> Floats:
    """Return a `closed` texture at positions (any size) between its texels; positions are float32, in periods."""
    return np.asarray(cv2.remap(texture, _texels(columns), _texels(rows), cv2.INTER_LINEAR))


def _texels(at: Floats) -> Floats:
    """Return positions, in periods, as texels of one period."""
    texels = np.floor(at)
    np.subtract(at, texels, out=texels)  # in place: allocation costs more than the arithmetic
    texels *= TILE
    return np.asarray(texels)
