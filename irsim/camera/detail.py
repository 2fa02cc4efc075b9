"""Digital detail enhancement (DDE): a base layer, and small structure amplified over it.

The base is a guided filter of the counts by themselves (K. He, J. Sun, X. Tang, "Guided image filtering", IEEE TPAMI
35, 2013), computed on a coarser grid (K. He, J. Sun, "Fast guided filter", arXiv:1505.00996). Enhancement of infrared
pictures by such layers: F. Branchitta et al., "New technique for the visualization of high dynamic range infrared
images", Opt. Eng. 48, 2009; N. Liu, D. Zhao, "Detail enhancement for high-dynamic-range infrared images based on guided
image filter", Infrared Phys. Technol. 67, 2014.
"""

from __future__ import annotations

from typing import Annotated

import cv2
import numpy as np
from pydantic import Field

from irsim._native import COMPILED, kernels
from irsim.config.base import Part
from irsim.types import Counts, Floats

_COARSEST = 4
"""Largest step of the coarse grid, px."""


class DetailEnhancement(Part):
    """Amplification of detail: base + gain (counts - base).

    In a window of variance v the base is a counts + (1 - a) mean, a = v / (v + edge_counts²). Structure far below
    `edge_counts` is detail. Steps far above it stay in the base, but for 8 % of them per unit of gain beyond 1, by the
    coarse grid; steps near it and below overshoot by a halo as wide as the windows.
    """

    gain: Annotated[float, Field(ge=0, le=20)] = 2.0
    """Factor of the detail; 1 is off."""
    radius_px: Annotated[int, Field(ge=1, le=64)] = 8
    """Half of a window's side: the largest detail and the width of the halo, px."""
    edge_counts: Annotated[float, Field(gt=0, le=65_535)] = 60.0
    """Standard deviation in a window, counts, below which structure is detail; more gives more halo."""

    def enhance(self, counts: Floats, bits: int) -> Counts:
        """Return the enhanced counts, (rows, cols) uint16, of counts (rows, cols) float32, rounded and clipped."""
        if self.gain == 1:
            flat = np.zeros((1, counts.shape[1]), np.float32)
            return _apply(counts, flat + 1, flat, 2**bits - 1)
        return _apply(counts, *self._lines(counts), 2**bits - 1)

    def _lines(self, counts: Floats) -> tuple[Floats, Floats]:
        """Return slope and offset of the enhanced counts in the counts, in rows of the coarse grid, (n, cols)."""
        rows, columns = counts.shape
        step = max(min(_COARSEST, self.radius_px // 2), 1)
        coarse = -(-columns // step), -(-rows // step)
        # In float64, as squares of 16-bit counts leave float32 no digits for a small variance.
        small: Floats = np.asarray(cv2.resize(counts, coarse, interpolation=cv2.INTER_AREA), np.float64)
        side = 2 * max(round(self.radius_px / step), 1) + 1
        mean = _window_mean(small, side)
        variance = np.maximum(_window_mean(small * small, side) - mean * mean, 0)
        base_slope = variance / (variance + self.edge_counts**2)
        slope = self.gain + (1 - self.gain) * _window_mean(base_slope, side)
        offset = (1 - self.gain) * _window_mean((1 - base_slope) * mean, side)
        return _widened(slope, columns), _widened(offset, columns)


def _apply(counts: Floats, slope: Floats, offset: Floats, most: int) -> Counts:
    """Return counts slope + offset, clipped to 0 .. most and rounded; the rows of slope and offset are fewer."""
    rows, columns = counts.shape
    out = np.empty((rows, columns), np.uint16)
    if COMPILED:
        kernels.enhance(np.ascontiguousarray(counts), slope, offset, columns, most, out)
        return out
    at = np.clip((np.arange(rows) + 0.5) * (len(slope) / rows) - 0.5, 0, len(slope) - 1)
    first = at.astype(np.int64)
    second, part = np.minimum(first + 1, len(slope) - 1), (at - first).astype(np.float32)[:, np.newaxis]
    line, added = (each[first] + part * (each[second] - each[first]) for each in (slope, offset))
    np.copyto(out, np.clip(counts * line + added, 0, np.float32(most)) + np.float32(0.5), casting="unsafe")
    return out


def _window_mean(values: Floats, side: int) -> Floats:
    return np.asarray(cv2.blur(values, (side, side), borderType=cv2.BORDER_REFLECT))


def _widened(values: Floats, columns: int) -> Floats:
    """Return rows of a coarse grid with all columns, float32."""
    size = columns, len(values)
    return np.ascontiguousarray(cv2.resize(values.astype(np.float32), size, interpolation=cv2.INTER_LINEAR))
