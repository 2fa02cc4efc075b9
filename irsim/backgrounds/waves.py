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


PEAK = 0.877
"""Of a full sea: the wind over the speed of its longest wave, whose frequency is w = 0.877 g / U (Pierson and Moskowitz
1964)."""

SIDE_RAD = math.radians(20)
"""Directions of an octave's two trains, to either side of that of the wind."""


def longest_wave(wind_m_s: float) -> float:
    """Wavelength, m, at the peak of a full sea: k = w^2 / g."""
    return float(2 * np.pi * wind_m_s**2 / (PEAK**2 * GRAVITY))


def spread_rad(number: int) -> float:
    """How far the directions of waves are spread about that of the wind, the circular rms, in an octave, counted from
    that of the longest wave on: sqrt(2 / (s + 1)) of the law cos^(2 s)(angle / 2) with s = 9.77 (f / f_peak)^mu, mu =
    -2.33 - 1.45 (U / c - 1.17) of winds U and longest waves of speed c (Hasselmann, Dunckel and Ewing, J. Physical
    Oceanography 10 (1980) 1264, measured up to a few times f_peak). Short waves run nearly all ways."""
    mu = -2.33 - 1.45 * (PEAK - 1.17)
    s = 9.77 * 2 ** (mu * number / 2)  # f goes with the root of 1 / length
    return math.sqrt(2 / (s + 1))


def own_spread_rad(number: int) -> float:
    """The standard deviation of directions in each of the two trains, which is cut off at 90 degrees: what a train runs
    by, all of it goes ahead. So octaves from the fourth on are spread by 46 to 50 degrees together, not by more."""
    return math.sqrt(spread_rad(number) ** 2 - SIDE_RAD**2)


def leaning(number: int) -> tuple[float, float]:
    """(across, along) the wind: rms parts of the slopes of a train's waves, whose squares add up to 1."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 721)
    weights = np.exp(-0.5 * (angles / own_spread_rad(number)) ** 2)
    across = float(np.average(np.sin(angles + SIDE_RAD) ** 2, weights=weights))
    return math.sqrt(across), math.sqrt(1 - across)


class Octave:
    """An octave of waves: two trains, each with its own groups."""

    def __init__(self, wind_m_s: float, wind_deg: float, number: int, seed: int) -> None:
        self.length_m = longest_wave(wind_m_s) / 2**number
        self._speed = math.sqrt(GRAVITY * self.length_m / (2 * math.pi))  # of deep water
        wind = math.radians(wind_deg)
        self._angles = [wind - SIDE_RAD, wind + SIDE_RAD]
        across, along = leaning(number)
        self._leans = [
            (along * math.sin(wind) + beside * math.cos(wind), along * math.cos(wind) - beside * math.sin(wind))
            for beside in (-across, across)
        ]
        self._trains = [padded(wave_train(seed, number, side)) for side in range(2)]
        draw = stream(seed, "waves", number)
        self._starts = draw.uniform(0, TILE, (2, 2)).tolist()

    def at(self, right: Floats, ahead: Floats, time: float) -> tuple[Floats, Floats]:
        """Slopes to the right and towards the camera, each axis of variance 1 if waves ran all ways, (rows, cols).

        All waves of a train lean the same way, by the rms of what they would each: the two trains of an octave by
        others."""
        per_m = PER_WAVE / self.length_m / TILE
        across, along = np.zeros_like(right), np.zeros_like(right)
        of_trains = zip(self._angles, self._leans, self._trains, self._starts, strict=True)
        for angle, (to_right, to_ahead), train, (run, beside) in of_trains:
            sine, cosine = math.sin(angle), math.cos(angle)
            # The train has run so many of its periods: the whole ones do not tell.
            run = math.fmod(run / TILE - self._speed * time * per_m, 1)
            wave = sampled(
                train,
                mixed(right, cosine * per_m, ahead, -sine * per_m, beside / TILE),
                mixed(right, sine * per_m, ahead, cosine * per_m, run),
            )
            cv2.scaleAdd(wave, to_right, across, dst=across)
            cv2.scaleAdd(wave, -to_ahead, along, dst=along)
        return across, along


def wave_train(seed: int, number: int, side: int) -> Floats:
    """(TILE, TILE) periodic waves that run along the rows' axis, PER_WAVE texels long, of variance 1: together with the
    other train they are spread as `spread_rad` says, as far as that goes (`own_spread_rad`)."""
    fx, fy = np.fft.rfftfreq(TILE)[None, :], np.fft.fftfreq(TILE)[:, None]
    length = np.hypot(fx, fy) * PER_WAVE
    with np.errstate(divide="ignore"):
        octave = np.exp(-0.5 * (np.log2(np.maximum(length, 1e-9)) / 0.4) ** 2)
    spread = np.exp(-0.25 * (np.arctan2(fx, np.abs(fy)) / own_spread_rad(number)) ** 2)  # of amplitudes
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
    return np.asarray(cv2.remap(texture, _texels(columns), _texels(rows), cv2.INTER_LINEAR))


def _texels(at: Floats) -> Floats:
    """Places in periods as texels of one tile."""
    texels = np.floor(at)
    np.subtract(at, texels, out=texels)  # within one array: new ones cost more than what is done in them
    texels *= TILE
    return np.asarray(texels)
