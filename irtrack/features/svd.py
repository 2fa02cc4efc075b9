"""Background suppression by singular values, and candidates for small targets in the residual.

L. Cui, J. Zheng, X. Li, "Detecting small targets based on SVD for background suppression and particle
filter", Application Research of Computers 28(4), 2011: of the frame A = sum s_i u_i v_i', the large
singular values carry the background, which is similar along rows and columns; a small target is not.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import MEDIAN_TO_SIGMA, Floats, Image
from irtrack.features.correlation import peak

Residual = npt.NDArray[np.float32]

OVERSAMPLING = 5
"""Number of random directions beyond the wanted components (Halko et al. 2011, section 1.3.1: five to ten)."""
THINNED = 4
"""Step of the rows and columns sampled for the deviation of a residual: 4800 of 320x240 px give it to 2 %."""


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """Frame (rows, columns) and its k largest singular components, left (rows, k) times right (k, columns)."""

    frame: Residual
    left: Residual
    right: Residual

    def less(self, components: int) -> Residual:
        """Return the frame without its `components` largest singular components, counts."""
        residual: Residual = self.frame - self.left[:, :components] @ self.right[:components]
        return residual


def largest_parts(image: Image, components: int, rng: np.random.Generator) -> Parts:
    """Return the `components` largest singular components of a frame, by random projection.

    N. Halko, P. Martinsson, J. Tropp, "Finding Structure with Randomness", SIAM Review 53(2), 2011,
    algorithm 4.4 with one power iteration, and 5.1; in 32 bits.
    """
    frame = image.astype(np.float32)
    directions = min(components + OVERSAMPLING, *frame.shape)
    seen = frame @ rng.standard_normal((frame.shape[1], directions), np.float32)
    basis, _ = np.linalg.qr(frame @ (frame.T @ np.linalg.qr(seen)[0]))
    small = basis.T @ frame
    # Left vectors and values of the small matrix, from its Gram matrix; eigh gives the smallest first.
    _, vectors = np.linalg.eigh(small @ small.T)
    turned = np.ascontiguousarray(vectors[:, ::-1][:, :components])
    return Parts(frame, basis @ turned, turned.T @ small)


def standardised(residual: Residual, size: tuple[int, int], sign: float) -> Residual:
    """Return z (rows, columns): the mean over the target's (w, h) px minus the median, in robust standard deviations.

    The standard deviation is estimated by the median distance from the median, which targets and edges change little.
    `sign` is 1 for hot targets, -1 for cold ones. A residual within rounding errors gives zeros.
    """
    mean = cv2.blur(residual, size, borderType=cv2.BORDER_REFLECT)
    some = mean[::THINNED, ::THINNED]
    middle = np.median(some)
    deviation = MEDIAN_TO_SIGMA * float(np.median(np.abs(some - middle)))
    if deviation <= 1e-6 * max(float(np.abs(residual).max()), 1.0):  # the residual is only rounding of 32 bits
        return np.zeros_like(residual)
    z: Residual = (mean - middle) * np.float32(sign / deviation)
    return z


def candidates(z: Residual, size: tuple[int, int], threshold: float, most: int) -> tuple[Floats, Floats]:
    """Return centres (n, 2) px and z (n,) of at most `most` maxima above a threshold, the highest first.

    A maximum is the highest z within the target's (w, h) px on all sides; its centre is refined by parabolas.
    """
    highest = cv2.dilate(z, np.ones((2 * size[1] - 1, 2 * size[0] - 1), np.uint8))
    rows, columns = np.nonzero((z == highest) & (z > threshold))
    heights = z[rows, columns].astype(np.float64)
    order = np.argsort(-heights, kind="stable")[:most]
    centers = [_refined(z, int(rows[i]), int(columns[i])) for i in order]
    return np.array(centers).reshape(-1, 2), heights[order]


def _refined(z: Residual, row: int, column: int) -> tuple[float, float]:
    top, left = max(row - 1, 0), max(column - 1, 0)
    (x, y), _ = peak(z[top : row + 2, left : column + 2].astype(np.float64))
    return left + x, top + y
