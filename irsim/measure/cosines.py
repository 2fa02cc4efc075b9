"""Noise over time as cosines: what white noise, AR(1) noise and a random walk each give to every mode.

Of the discrete cosines of a series of T frames the first, a constant, holds all of the fixed pattern, and AR(1) noise
is nearly independent from mode to mode in them (N. Ahmed, T. Natarajan, K. R. Rao, "Discrete Cosine Transform", IEEE
Trans. Computers C-23, 1974). The variance that each holds is known exactly, of frames at any times.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irsim.types import Floats, Indices

_EACH = 64
"""The slowest modes are kept each; from there on neighbours, whose variances are nearly alike, are put together."""
_BINS = 96
"""How many are left of the others, evenly in log."""


@dataclass(frozen=True)
class Cosines:
    """Modes of frames taken at given times.

    ages    (T,) frames of the camera since the first one
    basis   (T, T) orthonormal, the constant one first
    starts  (B,) first mode of each bin; the constant one is alone in its own
    sizes   (B,) modes in each bin
    pairs   (B, L) share of the correlation over each lag, 0 .. L - 1 frames of the camera, in a bin's variance
    """

    ages: Indices
    basis: Floats
    starts: Indices
    sizes: Indices
    pairs: Floats

    @classmethod
    def of(cls, number: Indices) -> Cosines:
        """Those of frames taken at `number` (T,), rising, in frames of the camera."""
        from scipy.fft import dct, irfft, next_fast_len, rfft

        count = len(number)
        basis = dct(np.eye(count), axis=0, norm="ortho")
        starts = np.unique(
            np.concatenate([np.arange(min(_EACH, count)), np.geomspace(_EACH, count, _BINS)[:-1].astype(int)])
        )
        starts = starts[starts < count]
        sizes = np.diff(np.append(starts, count))
        ages = number - number[0]
        lags = int(ages[-1]) + 1
        length = next_fast_len(2 * lags)
        pairs = np.empty((len(starts), lags))
        for bin_, (start, size) in enumerate(zip(starts, sizes, strict=True)):
            spread = np.zeros((size, length))
            spread[:, ages] = basis[start : start + size]
            power = np.square(np.abs(rfft(spread, axis=1))).mean(axis=0)
            pairs[bin_] = irfft(power, length)[:lags]
        pairs[:, 1:] *= 2
        return cls(ages, basis, starts, sizes, pairs)

    @property
    def constant(self) -> Cosines:
        """The constant mode alone: what it holds is T times the square of the frames' mean."""
        return replace(self, basis=self.basis[:1], starts=self.starts[:1], sizes=self.sizes[:1], pairs=self.pairs[:1])

    def squares(self, values: Floats) -> Floats:
        """(B, ...) mean square of the modes of each bin in values (T, ...)."""
        modes = np.square(np.tensordot(self.basis, values, axes=1))
        sizes = self.sizes.reshape(-1, *[1] * (values.ndim - 1))
        found: Floats = np.add.reduceat(modes, self.starts, axis=0) / sizes
        return found

    def white(self) -> Floats:
        """(B,) variance of each bin in unit white noise."""
        return np.ones(len(self.starts))

    def remembered(self, decay: float) -> Floats:
        """(B,) that in unit AR(1) noise of correlation exp(-decay k) over k frames."""
        found: Floats = self.pairs @ np.exp(-decay * np.arange(self.pairs.shape[1]))
        return found

    def grown(self, decay: float) -> Floats:
        """(B,) that in AR(1) noise that a correction took away in the first frame: x[k] - rho^k x[0]."""
        return self.remembered(decay) - self.squares(np.exp(-decay * self.ages))

    def walked(self) -> Floats:
        """(B,) that in a random walk from the first frame on whose variance grows by 1 a frame: of covariance
        min(i, j) = (i + j - |i - j|) / 2 over i and j frames, of which the sum is in the constant mode alone."""
        found: Floats = self.pairs @ (-0.5 * np.arange(self.pairs.shape[1]))
        found[0] += self.ages.sum()
        return found

    def fixed(self) -> Floats:
        """(B,) that in a fixed pattern of unit variance."""
        return np.where(self.starts == 0, float(len(self.ages)), 0.0)
