"""Hu's invariant moments of grey windows, and their likeness.

M. Hu, "Visual pattern recognition by moment invariants", IRE Trans. Information Theory 8(2), 1962: unchanged by shift,
scale and rotation of the pattern.
"""

from __future__ import annotations

import numpy as np

from irsim.types import Floats, Image
from irtrack.features.window import Window

USED = 4
"""Number of invariants used, of seven: the last three are of third order, noise on windows of few pixels."""
NOISE = 0.02
"""Share of the power of the first invariant that is added to each before the logarithm."""
_FLOOR = 1e-12


def hu(windows: Floats) -> Floats:
    """Return the first invariants (..., USED) of windows (..., rows, columns) of weights of at least 0."""
    rows, columns = windows.shape[-2:]
    y, x = np.mgrid[:rows, :columns] - np.array([(rows - 1) / 2, (columns - 1) / 2])[:, None, None]
    powers = [(p, q) for p in range(4) for q in range(4 - p)]
    basis = np.stack([(x**p * y**q).ravel() for p, q in powers])
    raw = dict(zip(powers, np.moveaxis(windows.reshape(*windows.shape[:-2], -1) @ basis.T, -1, 0), strict=True))
    mass = np.maximum(raw[0, 0], _FLOOR)
    a, b = raw[1, 0] / mass, raw[0, 1] / mass
    n20 = (raw[2, 0] - a * raw[1, 0]) / mass**2
    n02 = (raw[0, 2] - b * raw[0, 1]) / mass**2
    n11 = (raw[1, 1] - a * raw[0, 1]) / mass**2
    n30 = (raw[3, 0] - 3 * a * raw[2, 0] + 2 * a * a * raw[1, 0]) / mass**2.5
    n03 = (raw[0, 3] - 3 * b * raw[0, 2] + 2 * b * b * raw[0, 1]) / mass**2.5
    n21 = (raw[2, 1] - 2 * a * raw[1, 1] - b * raw[2, 0] + 2 * a * a * raw[0, 1]) / mass**2.5
    n12 = (raw[1, 2] - 2 * b * raw[1, 1] - a * raw[0, 2] + 2 * b * b * raw[1, 0]) / mass**2.5
    first, second = n20 + n02, (n20 - n02) ** 2 + 4 * n11**2
    third = (n30 - 3 * n12) ** 2 + (3 * n21 - n03) ** 2
    fourth = (n30 + n12) ** 2 + (n21 + n03) ** 2
    return np.stack([first, second, third, fourth], axis=-1)


def log_hu(windows: Floats) -> Floats:
    """Return ln(Hu_i + s Hu_1^k) (..., USED), k = 1, 2, 3, 3 the power in which Hu_i grows, s the share `NOISE`.

    The invariants 2 to 4 of a symmetric target vanish: without the second term their logarithms would be noise.
    """
    found = hu(windows)
    first = np.maximum(found[..., :1], _FLOOR)
    logs: Floats = np.log(np.maximum(found, 0) + NOISE * first ** np.array([1, 2, 3, 3]))
    return logs


def invariants_around(
    image: Image, window: Window, corner: tuple[int, int], reach: int, level: float, sign: float
) -> Floats:
    """Return `log_hu` (2 reach + 1, 2 reach + 1, USED) of the windows with corners up to `reach` px from `corner`.

    Weights: counts beyond `level`, of the sign of the target's contrast; 0 outside the frame.
    """
    rows, columns = window.rows + 2 * reach, window.columns + 2 * reach
    left, top = corner[0] - reach, corner[1] - reach
    weights = np.zeros((rows, columns))
    y0, y1 = max(top, 0), min(top + rows, image.shape[0])
    x0, x1 = max(left, 0), min(left + columns, image.shape[1])
    if y0 < y1 and x0 < x1:
        inside = np.maximum(sign * (image[y0:y1, x0:x1].astype(np.float64) - level), 0)
        weights[y0 - top : y1 - top, x0 - left : x1 - left] = inside
    return log_hu(np.lib.stride_tricks.sliding_window_view(weights, (window.rows, window.columns)))


def moment_likeness(invariants: Floats, reference: Floats) -> Floats:
    """Return exp(-|ln Hu - ln Hu0|), (...), of invariants (..., USED) and a reference (USED,); 0 .. 1."""
    likeness: Floats = np.exp(-np.linalg.norm(invariants - reference, axis=-1))
    return likeness
