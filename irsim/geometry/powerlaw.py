"""Random fields whose power falls with frequency as a power law."""

from __future__ import annotations

import numpy as np

from irsim.rng import Address, normals
from irsim.types import Floats


def power_law(
    shape: tuple[int, int], beta: float, correlation_px: float, stretch: float, seed: int, *address: Address
) -> Floats:
    """(rows, columns) float32 periodic Gaussian field of mean 0 and variance 1.

    Its 2-D power spectrum falls as f^-beta above 1/correlation_px cycles a px and is flat below:
    amplitude filter (1/correlation_px^2 + f^2)^(-beta/4) on white noise. `stretch` > 1 draws it
    out along x.
    """
    fx = np.fft.rfftfreq(shape[1])[None, :] * stretch
    fy = np.fft.fftfreq(shape[0])[:, None]
    amplitude = (1 / correlation_px**2 + fx**2 + fy**2) ** (-beta / 4)
    amplitude[0, 0] = 0.0  # mean 0
    white = normals(shape, seed, *address)
    field = np.fft.irfft2(np.fft.rfft2(white) * amplitude, s=shape)
    return np.asarray(field / field.std(), dtype=np.float32)
