"""Features by which a target is recognised: geometry, texture, frequencies.

A patch is smoothed by a 3 x 3 median, stretched to 0 .. 255 between two of its percentiles and, for texture, equalised.
Geometry: area, aspect and Hu's moments of the part above a threshold (M. Hu, IRE Trans. Information Theory 8, 1962).
Texture: local binary patterns, and the grey-level co-occurrence matrix (R. Haralick, K. Shanmugam, I. Dinstein, IEEE
Trans. SMC 3(6), 1973). Frequencies: the spectrum's energy in rings, and the energies of the Haar wavelet transform.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Box, Floats, Image
from irtrack.features.lbp import PATTERNS, uniform_patterns
from irtrack.features.scaled_region import Picture, ScaledRegion

SIDE = 16
"""Side of a resampled patch, px."""
ROOM = 1.5
"""Sides of the box that a patch spans."""
LEVELS = 8
"""Grey levels of the co-occurrence matrix."""
RINGS = 8
"""Rings of the spectrum."""
STEPS = 3
"""Steps of the wavelet transform."""
OFFSET = 8.0
"""Least excess of a neighbour over the middle pixel in a local binary pattern, of 256 levels."""
TINY = 1e-12
NAMES = (
    *("ln w", "ln h", "area", "aspect", *(f"hu {k}" for k in range(1, 8))),
    *(f"pattern {k}" for k in range(PATTERNS)),
    *("contrast", "homogeneity", "energy", "correlation"),
    *(f"ring {k}" for k in range(RINGS)),
    *(f"wavelet {k}" for k in range(3 * STEPS)),
)
"""Names of the features, in the order of a vector."""


def recognition_vector(image: Image, box: Box) -> Floats:
    """Return the features (len(NAMES),) of the target in a box that meets the frame."""
    center, sides = np.array([box.cx, box.cy]), np.array([box.w, box.h])
    low, high = center - ROOM * sides / 2, center + ROOM * sides / 2
    pixels = cv2.resize(ScaledRegion.of(image, low, high, sides * ROOM / SIDE).pixels, (SIDE, SIDE))
    patch = stretched(np.asarray(cv2.medianBlur(pixels, 3), np.float32))
    even = np.asarray(cv2.equalizeHist(patch), np.uint8)
    return np.concatenate(
        [
            np.log(sides),
            geometry(patch),
            np.bincount(uniform_patterns(even, OFFSET).ravel(), minlength=PATTERNS)[:PATTERNS] / even.size,
            haralick(cooccurrence(even // (256 // LEVELS))),
            rings(patch.astype(np.float64)),
            wavelet_energies(patch.astype(np.float64)),
        ]
    )


def stretched(patch: Picture) -> npt.NDArray[np.uint8]:
    """Return a patch in 256 levels between its 2nd and 98th percentile; 0 where it is constant."""
    low, high = np.percentile(patch, (2, 98))
    if high - low < 1e-6:
        return np.zeros(patch.shape, np.uint8)
    levels: npt.NDArray[np.uint8] = np.clip(np.rint((patch - low) * (255 / (high - low))), 0, 255).astype(np.uint8)
    return levels


def geometry(patch: npt.NDArray[np.uint8]) -> Floats:
    """Return area share, aspect, and Hu's seven moments (logarithms with sign), of the part above Otsu's threshold.

    The target is the part that holds the middle; aspect is the ratio of the deviations along the principal axes.
    """
    _, mask = cv2.threshold(patch, 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    middle = mask[SIDE // 4 : -SIDE // 4, SIDE // 4 : -SIDE // 4]
    if middle.mean() < 0.5:
        mask = 1 - mask
    moments = cv2.moments(mask, binaryImage=True)
    half, cross = (moments["nu20"] - moments["nu02"]) / 2, moments["nu11"]
    mean, spread = (moments["nu20"] + moments["nu02"]) / 2, float(np.hypot(half, cross))
    aspect = np.sqrt(max(mean - spread, TINY) / max(mean + spread, TINY))
    return np.array([mask.mean(), aspect, *signed_log(hu_moments(mask.astype(np.float64)))])


def hu_moments(picture: Floats) -> Floats:
    """Return Hu's seven moments of a picture (rows, columns)."""
    return np.asarray(cv2.HuMoments(cv2.moments(picture.astype(np.float64))), np.float64).ravel()


def signed_log(values: Floats) -> Floats:
    """Return sign(x) ln(1 + |x| / 1e-6), which keeps the order of values of many magnitudes."""
    logs: Floats = np.sign(values) * np.log1p(np.abs(values) / 1e-6)
    return logs


def cooccurrence(levels: npt.NDArray[np.uint8]) -> Floats:
    """Return the shares (LEVELS, LEVELS) of pairs of levels of neighbours in a row or column, both ways."""
    pairs = np.zeros((LEVELS, LEVELS))
    for one, other in ((levels[:, :-1], levels[:, 1:]), (levels[:-1], levels[1:])):
        counts = np.bincount((one.astype(np.intp) * LEVELS + other).ravel(), minlength=LEVELS**2)
        pairs += counts.reshape(LEVELS, LEVELS)
    pairs = pairs + pairs.T
    shares: Floats = pairs / max(pairs.sum(), 1)
    return shares


def haralick(pairs: Floats) -> Floats:
    """Return contrast, homogeneity, energy and correlation of a co-occurrence matrix."""
    i, j = np.indices(pairs.shape)
    mean = float((i * pairs).sum())
    variance = float(((i - mean) ** 2 * pairs).sum())
    covariance = float(((i - mean) * (j - mean) * pairs).sum())
    return np.array(
        [
            float((pairs * (i - j) ** 2).sum()),
            float((pairs / (1 + (i - j) ** 2)).sum()),
            float(np.sqrt((pairs**2).sum())),
            covariance / variance if variance > TINY else 1.0,
        ]
    )


def rings(patch: Floats) -> Floats:
    """Return the shares (RINGS,) of the energy |FFT|^2, without its mean, in rings of the spectrum of equal width."""
    energy = np.abs(np.fft.fft2(patch)) ** 2
    energy[0, 0] = 0
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(patch.shape[1]), np.fft.fftfreq(patch.shape[0])))
    ring = np.minimum((frequency / np.sqrt(0.5) * RINGS).astype(np.intp), RINGS - 1)
    shares: Floats = np.bincount(ring.ravel(), energy.ravel(), RINGS) / max(energy.sum(), TINY)
    return shares


def haar_transform(patch: Floats) -> tuple[list[Floats], Floats]:
    """Return the details (three a step) and the rest of the orthonormal Haar transform."""
    details: list[Floats] = []
    rest = patch
    for _ in range(STEPS):
        a, b, c, d = rest[::2, ::2], rest[::2, 1::2], rest[1::2, ::2], rest[1::2, 1::2]
        details += [(a - b + c - d) / 2, (a + b - c - d) / 2, (a - b - c + d) / 2]
        rest = (a + b + c + d) / 2
    return details, rest


def wavelet_energies(patch: Floats) -> Floats:
    """Return the shares (3 STEPS,) of the details' energies in that of all details."""
    energies = np.array([(each**2).sum() for each in haar_transform(patch)[0]])
    shares: Floats = energies / max(energies.sum(), TINY)
    return shares
