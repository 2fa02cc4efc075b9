"""Fisher information of the mean of noisy pixels, and Cramér-Rao bounds from it.

    J = D' V^-1 D        V = N + U C U'

D (pixels, parameters) are derivatives of the mean, N is diagonal, and U C U' is the noise common to rows, to columns
and to the whole frame, which enters by Woodbury's identity:

    V^-1 = N^-1 - N^-1 U (C^-1 + U' N^-1 U)^-1 U' N^-1

S. Kay, "Estimation Theory", 1993, ch. 3. Where the noise is below `FINE_LSB` or counts are clipped, a pixel has the
exact information of its rounded counts in place of 1/N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from irsim.render.moments import Exact, Region, region_slices

FINE_LSB = 0.4
"""Noise, counts, below which rounding loses more information than its variance of 1/12 suggests."""
CLIPPED_SIGMA = 5.0
"""Distance, in sigmas, of a mean from the lowest or highest count within which clipping takes information."""
TOLERANCE, STEPS = 1e-8, 200
"""Relative residual at which conjugate gradients stop, and their largest number of steps."""


@dataclass(frozen=True, eq=False)
class FrameNoise:
    """Temporal noise of one frame, or of a part of it where no noise is common to several pixels.

    weights             (rows, cols) information of each pixel on its own mean, 1/counts²; 0 where it carries none
    row, column, frame  variances common to a row, to a column and to the frame, counts²
    """

    weights: Exact
    row: float = 0.0
    column: float = 0.0
    frame: float = 0.0

    @property
    def has_common(self) -> bool:
        """True where some noise is common to a row, a column or the frame."""
        return bool(self.row or self.column or self.frame)

    def information(self, derivatives: Exact, region: Region) -> Exact:
        """Return J (n, n) of derivatives of the mean (n, rows, cols) in a region of `weights`, 0 outside of it."""
        rows, columns = region_slices(region)
        weighted = derivatives * self.weights[rows, columns]
        found: Exact = np.einsum("iab,jab->ij", derivatives, weighted)
        if not self.has_common:
            return found
        height, width = self.weights.shape
        sums = np.zeros((height + width + 1, len(derivatives)))
        sums[rows] = weighted.sum(axis=2).T if self.row else 0.0
        sums[height:-1][columns] = weighted.sum(axis=1).T if self.column else 0.0
        sums[-1] = weighted.sum(axis=(1, 2)) if self.frame else 0.0
        return np.asarray(found - sums.T @ self._offsets(sums))

    def _offsets(self, sums: Exact) -> Exact:
        """Return (C^-1 + U' N^-1 U)^-1 b for b (rows + cols + 1, n), 0 for terms without variance.

        By conjugate gradients for all columns at once, preconditioned by the diagonal.
        """
        height, width = self.weights.shape
        across, down = self.weights.sum(axis=1), self.weights.sum(axis=0)
        variances = np.repeat([self.row, self.column, self.frame], [height, width, 1])
        used = variances > 0
        diagonal = 1 / np.where(used, variances, 1.0) + np.concatenate([across, down, [across.sum()]])

        def product(v: Exact) -> Exact:
            """Return M v, where v is 0 in unused terms."""
            along, upright, common = v[:height], v[height:-1], v[-1:]
            out: Exact = diagonal[:, None] * v
            if self.row and self.column:
                out[:height] += self.weights @ upright
                out[height:-1] += self.weights.T @ along
            if self.frame:
                out[:height] += across[:, None] * common
                out[height:-1] += down[:, None] * common
                out[-1] += across @ along + down @ upright
            out[~used] = 0.0
            return out

        inverse = np.where(used, 1 / diagonal, 0.0)[:, None]
        x = inverse * sums
        residual = sums - product(x)
        step = solved = inverse * residual
        energy = (residual * solved).sum(axis=0)
        least = TOLERANCE**2 * (sums * inverse * sums).sum(axis=0)
        for _ in range(STEPS):
            if (energy <= least).all():
                break
            image = product(step)
            length = energy / np.maximum((step * image).sum(axis=0), np.finfo(float).tiny)
            x, residual = x + length * step, residual - length * image
            solved = inverse * residual
            energy, last = (residual * solved).sum(axis=0), energy
            step = solved + energy / np.maximum(last, np.finfo(float).tiny) * step
        return x


def position_covariance(information: Exact) -> Exact | None:
    """Return the bound on the covariance (2, 2) of the first two parameters, the others unknown; None where singular.

    The inverse of the Schur complement of the other parameters.
    """
    scale = np.sqrt(np.diag(information))
    if not (scale > 0).all():
        return None
    scaled = information / np.outer(scale, scale)
    if np.linalg.eigvalsh(scaled)[0] < 1e-9:
        return None
    covariance: Exact = np.linalg.inv(scaled)[:2, :2] / np.outer(scale[:2], scale[:2])
    return covariance


def quantised_information(mean: Exact, sigma: Exact, full: int) -> Exact:
    """Return the Fisher information, 1/counts², of counts rounded and clipped to 0..full on their `mean` (n,).

    I = sum over counts k of (dP_k / d mean)² / P_k, with P_k the probability of count k in normal noise `sigma` (n,)
    above 0, counts. The lowest and the highest count hold all that lies beyond.
    """
    found = np.zeros(mean.shape)
    reach = int(np.ceil(8 * sigma.max(initial=0.0))) + 1
    nearest = np.rint(np.clip(mean, 0, full))
    for step in range(-reach, reach + 1):
        count = nearest + step
        inside = (count >= 0) & (count <= full)
        lower = np.where(count == 0, -np.inf, (count - 0.5 - mean) / sigma)
        upper = np.where(count == full, np.inf, (count + 0.5 - mean) / sigma)
        # In the upper tail the difference of probabilities near 1 would cancel: it is mirrored.
        mirrored = lower > 0
        low, high = np.where(mirrored, -upper, lower), np.where(mirrored, -lower, upper)
        probability = ndtr(high) - ndtr(low)
        slope = (np.exp(-(lower**2) / 2) - np.exp(-(upper**2) / 2)) / (np.sqrt(2 * np.pi) * sigma)
        used = inside & (probability > 1e-200)
        found[used] += slope[used] ** 2 / probability[used]
    return found


def needs_exact(variance: Exact, mean: Exact, full: int) -> bool:
    """Return True if some pixel's information must be computed exactly, as it differs from 1 / variance; arguments as
    in `pixel_information`."""
    return bool(_inexact(variance, mean, full)[0].any())


def pixel_information(variance: Exact, mean: Exact, full: int) -> Exact:
    """Return the information of pixels on their own mean, (rows, cols), 1/counts².

    variance   of each pixel's own temporal noise with 1/12 of rounding, counts²; infinite where it does not respond
    mean       noiseless counts with the fixed pattern, before rounding and clipping
    """
    exact, sigma = _inexact(variance, mean, full)
    found: Exact = 1 / variance
    if exact.any():
        found[exact] = quantised_information(mean[exact], sigma[exact], full)
    return found


def _inexact(variance: Exact, mean: Exact, full: int) -> tuple[np.ndarray, Exact]:
    """Return a mask of the pixels with little noise or possible clipping, and the noise before rounding, counts."""
    sigma = np.sqrt(np.maximum(variance - 1 / 12, 0.0))
    reach = CLIPPED_SIGMA * sigma
    responds = np.isfinite(variance) & (sigma > 0)
    with np.errstate(invalid="ignore"):
        near = (mean < reach) | (mean > full - reach)
    return responds & ((sigma < FINE_LSB) | near), sigma
