"""Whether the scene moves before the camera, as against noise that is blurred over pixels."""

from __future__ import annotations

import cv2
import numpy as np

from irsim.measure.region import Values
from irsim.types import Floats

_LOOKED_AT = 24
_SOFT = 1.5
"""Sigma, px, of the blur before gradients are taken: it lowers noise beneath texture."""
_LEAST = 0.2
"""Share of the change that one shift must explain for a part to move: noise alone has some hundredths."""
_PARTS = 3


def moves(frames: Values) -> bool:
    """Does the scene of frames (T, rows, columns) slide from frame to frame, in most of the picture?

    The change of a small shift d is -d times the gradient; that d is found by least squares (B. D. Lucas
    and T. Kanade, "An iterative image registration technique", IJCAI 1981), and the share of the change
    that it explains is told from noise, which has no such tie to the picture. The median over 3 x 3
    parts and some pairs of frames decides: a target that crosses does not move the scene.
    """
    pairs = np.unique(np.linspace(0, len(frames) - 2, _LOOKED_AT).astype(int))
    shares = []
    for k in pairs:
        first, second = (cv2.GaussianBlur(frames[i].astype(np.float32), (0, 0), _SOFT) for i in (k, k + 1))
        change = (second - first).astype(np.float64)
        down, across = np.gradient(((first + second) / 2).astype(np.float64))
        shares += [_explained(*parts) for parts in zip(*map(_parts, (change, across, down)), strict=True)]
    return float(np.median(shares)) > _LEAST


def _parts(picture: Floats) -> list[Floats]:
    rows = np.array_split(picture, _PARTS)
    return [part for row in rows for part in np.array_split(row, _PARTS, axis=1)]


def _explained(change: Floats, across: Floats, down: Floats) -> float:
    """Share of the change in a part that the best shift explains."""
    slopes = np.stack([part.ravel() - part.mean() for part in (across, down)], axis=1)
    rest = change.ravel() - change.mean()
    shift = np.linalg.lstsq(slopes, rest, rcond=None)[0]
    return float(np.square(slopes @ shift).sum() / (np.square(rest).sum() + 1e-12))
