"""Optical flow of points between two pictures, with forward-backward errors."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Floats

Picture = npt.NDArray[np.uint8]
Places = npt.NDArray[np.float32]

CONVERGED = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.03)
"""Termination: at most 20 iterations, or a step below 0.03 px (Bouguet 2001, section 2.3)."""


def forward_backward(
    before: Picture, after: Picture, points: Floats, window: int, levels: int
) -> tuple[Floats, Floats]:
    """Return the positions of points (N, 2) px in the next picture, and their forward-backward errors (N,) px.

    Pyramidal Lucas-Kanade (J.-Y. Bouguet, "Pyramidal Implementation of the Affine Lucas Kanade Feature
    Tracker", Intel, 2001), runs forward and back; the error is the distance from the start of a point to the end of its
    backward flow (Z. Kalal, K. Mikolajczyk, J. Matas, "Forward-Backward Error", ICPR 2010, section 2). A point that is
    lost, or leaves the picture, has an infinite error.
    """
    start = points.astype(np.float32).reshape(-1, 1, 2)

    def follow(first: Picture, second: Picture, places: Places) -> tuple[Places, npt.NDArray[np.bool_]]:
        moved, found, _ = cv2.calcOpticalFlowPyrLK(  # type: ignore[call-overload]  # OpenCV's stubs require the output argument
            first, second, places, None, winSize=(window, window), maxLevel=levels, criteria=CONVERGED
        )
        return moved, found[:, 0] > 0

    there, found = follow(before, after, start)
    back, returned = follow(after, before, there)
    errors = np.linalg.norm((back - start)[:, 0], axis=1).astype(np.float64)
    moved = there[:, 0].astype(np.float64)
    height, width = after.shape
    inside = ((moved > -0.5) & (moved < (width - 0.5, height - 0.5))).all(axis=1)
    errors[~(inside & found & returned & np.isfinite(errors))] = np.inf
    return moved, errors


def scale_change(before: Floats, after: Floats) -> float:
    """Return the median ratio of the distances between points (N, 2) after and before; 1 for fewer than two.

    Kalal et al. 2010, section 3.
    """
    i, j = np.triu_indices(len(before), 1)
    first = np.hypot(*(before[i] - before[j]).T)
    second = np.hypot(*(after[i] - after[j]).T)
    apart = first > 0
    return float(np.median(second[apart] / first[apart])) if apart.any() else 1.0
