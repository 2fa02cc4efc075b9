"""Charge that saturated pixels spill."""

from __future__ import annotations

from typing import Annotated, Literal

import cv2
import numpy as np
from pydantic import Field

from irsim.kinds import Part
from irsim.quantities import Fraction
from irsim.types import Floats

Direction = Literal["columns", "rows", "around"]


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

        Along lines one half runs each way, until pixels with room have taken it: nothing is lost but
        at the frame's edge. Around, it falls off exponentially with distance, and what comes to
        saturated pixels is lost.
        """
        if signal.max() <= top:
            return
        if self.along == "around":
            self._spill_around(signal, top)
        else:
            _spill_along(signal if self.along == "columns" else signal.T, top, self.fraction)

    def _spill_around(self, signal: Floats, top: float) -> None:
        reach = int(np.ceil(6 * self.length_px))
        excess = np.maximum(signal - np.float32(top), 0)
        np.minimum(signal, np.float32(top), out=signal)
        rows, columns = np.nonzero(excess)
        here = slice(max(rows.min() - reach, 0), rows.max() + reach + 1)
        there = slice(max(columns.min() - reach, 0), columns.max() + reach + 1)
        offsets = np.arange(-reach, reach + 1.0)
        kernel = np.exp(-np.hypot(offsets, offsets[:, None]) / self.length_px)
        kernel[reach, reach] = 0  # the pixel itself is full
        kernel *= self.fraction / kernel.sum()
        spilt = cv2.filter2D(excess[here, there], -1, kernel, borderType=cv2.BORDER_CONSTANT)
        window = signal[here, there]
        np.minimum(window + spilt, np.float32(top), out=window)


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
