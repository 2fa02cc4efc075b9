"""High-pass filter in the frequency domain, H = 1 / (1 + (D0 / D)^(2 n)).

R. Gonzalez, R. Woods, "Digital Image Processing", 3rd ed. 2008, eq. 4.9-3 (Butterworth). Xue et al. 2011, section 1,
call it the costly alternative to their filter. D is the frequency, cycles/px; the cosine transform (DCT-II) mirrors the
frame at its edges.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy import fft

from irsim.types import MEDIAN_TO_SIGMA, Image
from irtrack.features.highpass import REACH, ROUNDING

CUTOFFS = tuple(0.02 * 2 ** (k / 2) for k in range(7))
"""Cut-off frequencies that are tried, cycles/px: .02 to .16, half the bandwidth of a point's image."""
SURE = 4.0
"""Number of standard errors by which a kurtosis must exceed another; for n normal pixels the error is sqrt(24 / n)."""
ORDER = 2
"""n of `FrequencyHighPass`."""

Singles = npt.NDArray[np.float32]


@lru_cache(maxsize=16)
def butterworth(shape: tuple[int, ...], cutoff: float, order: int) -> Singles:
    """Return H (rows, cols) at the frequencies k / (2 N) cycles/px of a cosine transform; 0 at frequency 0."""
    down, across = (np.arange(count) / (2 * count) for count in shape)
    squared = down[:, None] ** 2 + across**2
    squared[0, 0] = 1.0
    H = (1 / (1 + (cutoff**2 / squared) ** order)).astype(np.float32)
    H[0, 0] = 0.0
    H.setflags(write=False)
    return H


def spectrum_of(picture: Singles) -> Singles:
    """Return the cosine transform (rows, cols) of a picture."""
    spectrum: Singles = fft.dctn(picture, norm="ortho")
    return spectrum


def passed(spectrum: Singles, cutoff: float, order: int) -> Singles:
    """Return the high-passed picture (rows, cols) of a spectrum."""
    response: Singles = fft.idctn(spectrum * butterworth(spectrum.shape, cutoff, order), norm="ortho", overwrite_x=True)
    return response


def first_cutoff(spectrum: Singles, order: int) -> float:
    """Return the D0 of `CUTOFFS` whose response has the largest kurtosis, since sparse targets give long tails.

    Among values of D0 whose kurtosis differs from the largest by no more than noise, return the smallest.
    """
    kurtoses = [_kurtosis(passed(spectrum, each, order)) for each in CUTOFFS]
    enough = max(kurtoses) - SURE * (24 / spectrum.size) ** 0.5
    return next(each for each, kurtosis in zip(CUTOFFS, kurtoses, strict=True) if kurtosis >= enough)


def _kurtosis(response: Singles) -> float:
    squares = np.square(response, dtype=np.float64)
    variance = squares.mean()
    return float(np.square(squares).mean() / variance**2) if variance > 1e-6 else 0.0


@dataclass(frozen=True, slots=True)
class FrequencyHighPass:
    """High-pass filter to 8-bit pictures, 128 + gain * residual, as `irtrack.features.highpass.HighPass`."""

    cutoff: float
    gain: float

    @classmethod
    def fitted(cls, image: Image) -> FrequencyHighPass:
        """Return the filter with the D0 of a first frame, whose gain maps `REACH` deviations to 128 grey levels."""
        spectrum = spectrum_of(image.astype(np.float32))
        cutoff = first_cutoff(spectrum, ORDER)
        deviation = MEDIAN_TO_SIGMA * float(np.median(np.abs(passed(spectrum, cutoff, ORDER))))
        return cls(cutoff, 128 / (REACH * max(deviation, ROUNDING)))

    def __call__(self, image: Image) -> npt.NDArray[np.uint8]:
        """Return the high-passed picture (rows, columns) of a frame."""
        residual = passed(spectrum_of(image.astype(np.float32)), self.cutoff, ORDER)
        levels: npt.NDArray[np.uint8] = np.clip(np.rint(128 + self.gain * residual), 0, 255).astype(np.uint8)
        return levels

    def view(self, image: Image) -> npt.NDArray[np.uint8]:
        """Return the whole picture, as for `HighPass.view`."""
        return self(image)
