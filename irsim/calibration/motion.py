"""Detection of motion and of a scene in frames that should contain only noise.

Noise and fixed pattern of a detector are independent from pixel to pixel. Correlated changes of neighbouring pixels
reveal motion, and correlated means reveal texture of a scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.calibration.statistics import Values, center_lines, evenly
from irsim.types import MEDIAN_TO_SIGMA, Floats

_TOGETHER = 0.1
"""Correlation between the changes of neighbouring pixels above which they count as correlated, in a large window."""
_CHANCE = 5.0
_LINE_CHANCE = 4.0
"""Standard errors beyond which a correlation of pixels (`_CHANCE`), and of lines, is significant."""
_SHARPER = 2.0
"""Ratio of measured to expected sharp noise above which the scene moves. Filters in the camera give 1.3."""
_SLIDING = 0.22
"""Fraction of a change, explained by one shift, above which a part of the picture moves. Noise gives a few 0.01."""
LEAST_SLIDE_SIDE = 28
"""Least side of a picture, px, for which motion and noise can be distinguished."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Signs of motion in a window.

    fine        sigma of noise that is white in time and space, counts
    together    True where changes of neighbouring pixels are correlated, by motion or by smoothing in the camera
    moving      True where motion is certain
    """

    fine: float
    together: bool
    moving: bool


def motion(frames: Floats) -> Motion:
    """Return the signs of motion in a window (T, rows, columns).

    The neighbour correlation of smoothed noise is the same at any lag. That of motion rises with the lag, or comes with
    sharp noise. For noise that a Gaussian blur correlates by r between neighbours, `sharp_sigma` returns (6 - 8 r + 2
    r^4) / 6 of its sigma.
    """
    chance = max(_TOGETHER, _CHANCE / math.sqrt(frames[0].size))
    fine = sharp_sigma(frames)
    next_to, sigma = _change(frames, 1)
    far, _ = _change(frames, max(len(frames) // 2, 1))
    smoothed = sigma * (6 - 8 * next_to + 2 * next_to**4) / 6
    both = next_to > chance and fine > max(_SHARPER * smoothed, 2 / math.sqrt(12))
    return Motion(fine, max(next_to, far) > chance, far - next_to > chance or both)


def sharp_sigma(frames: Floats) -> float:
    """Return the sigma of noise that is white in time and space. Smooth motion hardly changes it.

    It is estimated by the median of absolute differences of neighbouring frames, filtered by [1 -2 1] x [1 -2 1] with
    gain 6 (J. Immerkaer, Computer Vision and Image Understanding 64, 1996).
    """
    changes = np.diff(np.asarray(frames, np.float64), axis=0)
    bent = np.diff(np.diff(changes, n=2, axis=1), n=2, axis=2)
    return float(MEDIAN_TO_SIGMA * np.median(np.abs(bent)) / (6 * np.sqrt(2)))


def _change(frames: Floats, lag: int) -> tuple[float, float]:
    """Return the correlation of neighbouring pixels, and the sigma, of changes over a lag in frames."""
    change = center_lines(frames[lag:] - frames[:-lag])
    power = float(np.square(change).mean())
    if power == 0:
        return 0.0, 0.0
    return neighbour_covariance(change) / power, math.sqrt(power / 2)


def neighbour_covariance(values: Floats) -> float:
    """Return the mean product of neighbouring pixels in (..., rows, columns), along rows or columns, the larger one."""
    along = float((values[..., 1:] * values[..., :-1]).mean())
    return max(along, float((values[..., 1:, :] * values[..., :-1, :]).mean()))


def scene_terms(picture: Floats) -> tuple[str, ...]:
    """Return the terms "v", "h" and "vh" of 3-D noise, as far as they contain a scene, for a window (rows, columns).

    In the fixed pattern of a detector neighbouring pixels, and lines one and two apart, are uncorrelated.
    """
    rest = center_lines(picture[None])[0]
    pairs = (
        (rest[:, 1:], rest[:, :-1]),
        (rest[1:], rest[:-1]),
        (rest[1:, 1:], rest[:-1, :-1]),
        (rest[1:, :-1], rest[:-1, 1:]),
    )
    power = max(float(np.square(rest).mean()), np.finfo(np.float64).tiny)
    alike = float(np.mean([(one * other).mean() for one, other in pairs])) / power
    if alike > _CHANCE / math.sqrt(len(pairs) * rest.size):
        return "v", "h", "vh"
    return tuple(term for term, axis in (("v", 1), ("h", 0)) if _lines_alike(picture.mean(axis=axis)))


def _lines_alike(levels: Floats) -> bool:
    apart = levels - levels.mean()
    power = max(float(np.square(apart).mean()), np.finfo(np.float64).tiny)
    correlation = float(np.mean([(apart[lag:] * apart[:-lag]).mean() for lag in (1, 2)])) / power
    return correlation > _LINE_CHANCE / math.sqrt(2 * len(levels))


def scene_slides(frames: Values) -> bool:
    """Return True where the scene in frames (T, rows, columns) moves past the camera in most of the picture.

    In each of 3 x 3 parts of a pair of frames, one shift is fitted to the change by least squares (B. D. Lucas and T.
    Kanade, IJCAI 1981). The median of the explained fraction over parts and pairs decides, for pairs 1, 2, 4, 8 ...
    frames apart.
    """
    if min(frames.shape[1:]) < LEAST_SLIDE_SIDE:
        return False
    longest = len(frames) // 2 if min(frames.shape[1:]) >= 48 else 1
    return any(_explained(frames, 2**power) > _SLIDING for power in range(max(longest, 1).bit_length()))


def _explained(frames: Values, apart: int) -> float:
    shares = []
    for k in evenly(len(frames) - apart, 24 if apart == 1 else 9):
        first, second = (_smooth(frames[at], apart > 1) for at in (k, k + apart))
        down, across = np.gradient((first + second) / 2)
        pictures = np.stack([second - first, across, down])
        for rows in np.array_split(pictures, 3, axis=1):
            for part in np.array_split(rows, 3, axis=2):
                flat = part.reshape(3, -1) - part.reshape(3, -1).mean(axis=1, keepdims=True)
                change, slopes = flat[0], flat[1:]
                solved = np.linalg.lstsq(slopes @ slopes.T, slopes @ change, rcond=1e-9)[0]
                shares.append(float(solved @ slopes @ change) / (float(change @ change) + 1e-12))
    return float(np.median(shares))


def _smooth(frame: Values, level: bool) -> Floats:
    """Return a frame blurred by 1.5 px; with `level`, less its blur by 6 px, which removes slow changes of level."""
    values = frame.astype(np.float64)
    soft = cv2.GaussianBlur(values, (0, 0), 1.5)
    return np.asarray(soft - cv2.GaussianBlur(values, (0, 0), 6.0) if level else soft)
