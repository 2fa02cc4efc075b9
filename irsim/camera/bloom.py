"""Charge that saturated pixels spill."""

from __future__ import annotations

from typing import Annotated, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from irsim.config.base import Part
from irsim.config.quantities import Fraction
from irsim.types import Floats

Direction = Literal["columns", "rows", "around"]

_TRACE = 1e-4
"""Less than this of a full pixel is left where it is: it is gone."""
_NEAR = 1e-4
"""Pixels with room that hold less of what is spread than this are too far away."""
_ROUNDS = 100
"""So often charge goes on at most; what fills a fifth of a picture has come to rest after some ten."""


class Bloom(Part):
    """What a saturated pixel cannot hold runs into its neighbours."""

    fraction: Fraction = 1.0
    """Share of the excess that spills; the rest is drained."""
    along: Direction = "columns"
    """Up and down its column, left and right along its row, or all around."""
    length_px: Annotated[float, Field(gt=0, le=100)] = 2.0
    """Around: distance in which what spills falls to 1/e, px."""

    def spill(self, signal: Floats, top: float) -> None:
        """Take what is above `top` from each pixel of `signal` (rows, cols) float32, and spill it; in place.

        Along lines one half runs each way, until pixels with room have taken it. Around, it goes to the pixels with
        room, the fewer the farther by exp(-distance / length_px), and what these cannot hold goes on alike. Nothing is
        lost but at the frame's edge.
        """
        if signal.max() <= top:
            return
        if self.along == "around":
            self._spill_around(signal, top)
        else:
            _spill_along(signal if self.along == "columns" else signal.T, top, self.fraction)

    def _spill_around(self, signal: Floats, top: float) -> None:
        reach = int(np.ceil(6 * self.length_px))
        offsets = np.arange(-reach, reach + 1.0)
        kernel = np.exp(-np.hypot(offsets, offsets[:, None]) / self.length_px)
        kernel[reach, reach] = 0  # the pixel itself is full
        kernel /= kernel.sum()
        full = np.float32(top)
        going = np.maximum(signal - full, 0) * np.float32(self.fraction)
        np.minimum(signal, full, out=signal)
        for _ in range(_ROUNDS):
            x, y, wide, high = cv2.boundingRect((going > _TRACE * full).view(np.uint8))
            if wide == 0:
                return
            here, there = slice(max(y - reach, 0), y + high + reach), slice(max(x - reach, 0), x + wide + reach)
            leaving, held = going[here, there], signal[here, there]
            brimful = held >= full
            share = 1 - _spread(brimful.astype(np.float32), kernel)  # of the kernel that falls on pixels with room
            near = share > _NEAR
            landed = np.maximum(_spread(np.where(near, leaving / np.maximum(share, _NEAR), 0), kernel), 0)
            landed[brimful] = 0
            leaving[near] = 0  # the others are too deep within full ones
            if brimful.all():
                _to_nearest(going, signal < full)
            else:
                _to_nearest(leaving, ~brimful)
            leaving += landed + held
            np.minimum(leaving, full, out=held)
            leaving -= held


def _to_nearest(going: Floats, room: NDArray[np.bool_]) -> None:
    """Move charge to the nearest pixel that has room each; in place. Without any it is lost at the frame's edge."""
    if not going.any():
        return
    if room.any():
        _, nearest = cv2.distanceTransformWithLabels(
            (~room).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
        )
        going[room] = np.bincount(nearest.ravel(), going.ravel())[nearest[room]]
    going[~room] = 0


def _spread(light: Floats, kernel: Floats) -> Floats:
    return np.asarray(cv2.filter2D(light.astype(np.float32, copy=False), -1, kernel, borderType=cv2.BORDER_CONSTANT))


def _spill_along(signal: Floats, top: float, fraction: float) -> None:
    """Spill along the first axis, in place: half of the excess on towards the end, half towards the beginning."""
    lines = np.flatnonzero((signal > top).any(axis=0))
    held = signal[:, lines].astype(np.float64)
    excess = np.maximum(held - top, 0)
    held -= excess
    for rows in (range(len(held)), range(len(held) - 1, -1, -1)):
        running = np.zeros(lines.size)
        for row in rows:
            room = top - held[row]
            taken = np.minimum(running, room)
            held[row] += taken
            running += fraction / 2 * excess[row] - taken
    signal[:, lines] = held
