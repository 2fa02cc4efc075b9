"""Whether the scene slides before the camera, as against noise that is blurred over pixels."""

from __future__ import annotations

import math

import cv2
import numpy as np

from irsim.measure.given import Values
from irsim.measure.picked import LARGE, evenly, middle
from irsim.types import Floats

_SOFT = 1.5
"""Sigma, px, of the blur before gradients are taken: it lowers noise beneath texture."""
_WIDE = 6.0
"""Sigma, px, of the blur that is taken off pictures far apart in time: what a warming lens adds is wider."""
_LEAST = 0.22
"""Share of the change that one shift must explain for a part to move: noise alone has some hundredths, the slowest
slides told have 0.25. Waves before a still camera run as one, too: 0.8 to 0.9 in the example `sea`."""
_PARTS = 3
_WIDEST = math.isqrt(LARGE) // _PARTS
"""Px of each of these parts that are looked at in a large picture, either way."""
_NEXT_PAIRS, _FAR_PAIRS = 24, 9
"""Pairs of frames that are looked at: neighbours, and those of each longer distance."""
_LEAST_SIDE = 48
"""Of smaller pictures, px, neighbours alone are looked at: chance explains more of the change in fewer pixels."""
TOLD_SIDE = 28
"""Of smaller ones nothing is told: up to 20 px a side white noise looks as if it slid in each of 20 draws, of 24 px in
3 of them, of 28 px in none."""


def slides(frames: Values) -> bool:
    """Does the scene of frames (T, rows, columns) slide, in most of the picture?

    The change of a small shift d is -d times the gradient; that d is found by least squares (B. D. Lucas
    and T. Kanade, "An iterative image registration technique", IJCAI 1981), and the share of the change
    that it explains is told from noise, which has no such tie to the picture. The median over 3 x 3
    parts and some pairs of frames decides: a target that crosses does not move the scene.

    Pairs are neighbours, and frames 2, 4, 8 and so on apart, up to half of all: a slow slide shows once it has
    gone far enough. In 40 frames of 128 x 128 px, 0.005 px a frame is told under noise of a tenth of the texture's
    sigma, 0.05 px a frame under noise as strong as the texture; in half as many frames, twice that. Pictures of less
    than 28 px a side are said to stand still, for noise alone would look as if it slid.
    """
    if min(frames.shape[1:]) < TOLD_SIDE:
        return False
    longest = len(frames) // 2 if min(frames.shape[1:]) >= _LEAST_SIDE else 1
    return any(_explained_at(frames, 2**power) > _LEAST for power in range(max(longest, 1).bit_length()))


def _explained_at(frames: Values, apart: int) -> float:
    """Share of the change over so many frames that shifts explain, in the median over parts and pairs."""
    count = _NEXT_PAIRS if apart == 1 else _FAR_PAIRS
    shares = []
    for k in evenly(len(frames) - apart, count):
        for pair in _looked_at(frames[k : k + apart + 1 : apart]):
            first, second = (_softened(picture, apart > 1) for picture in pair)
            down, across = np.gradient(((first + second) / 2).astype(np.float64))
            shares.append(_explained((second - first).astype(np.float64), np.asarray(across), np.asarray(down)))
    return float(np.median(shares))


def _looked_at(pair: Values) -> list[Values]:
    """Both pictures of a pair (2, rows, columns); of large ones the middle of each of 3 x 3 parts."""
    if pair[0].size <= LARGE:
        return [pair]
    parts = (part for rows in np.array_split(pair, _PARTS, axis=1) for part in np.array_split(rows, _PARTS, axis=2))
    return [middle(part, _WIDEST) for part in parts]


def _softened(frame: Values, flat: bool) -> Floats:
    """A frame, blurred; less what is smooth in it where it shall be flat."""
    values = frame.astype(np.float32)
    soft = cv2.GaussianBlur(values, (0, 0), _SOFT)
    return np.asarray(soft - cv2.GaussianBlur(values, (0, 0), _WIDE) if flat else soft)


def _explained(change: Floats, across: Floats, down: Floats) -> Floats:
    """(9,) share of the change in each part that the best shift explains, by the normal equations of least squares."""
    pictures = np.stack([change, across, down])
    pictures -= pictures.mean(axis=(1, 2), keepdims=True)  # or sums of squares would round away what varies
    sums = _over_parts(np.concatenate([np.ones_like(change)[None], pictures]))
    count, means = sums[0], sums[1:] / sums[0]
    spread = _over_parts(pictures[:, None] * pictures) - count * means[:, None] * means
    spread = np.moveaxis(spread.reshape(3, 3, -1), -1, 0)
    slopes, tied, changed = spread[:, 1:, 1:], spread[:, 1:, 0], spread[:, 0, 0]
    explained = np.einsum("pi,pij,pj->p", tied, np.linalg.pinv(slopes, hermitian=True), tied)
    return np.asarray(explained / (changed + 1e-12))


def _over_parts(pictures: Floats) -> Floats:
    """(..., 3, 3) sums of pictures (..., rows, columns) over each part."""
    for axis in (-2, -1):
        parts = np.array_split(np.arange(pictures.shape[axis]), _PARTS)
        pictures = np.add.reduceat(pictures, [part[0] for part in parts], axis=axis)
    return pictures
