"""Normals added to a frame: where there was a compiler each in the pass that draws it."""

from __future__ import annotations

import cv2

from irsim.compiled import COMPILED, kernels
from irsim.detector.scratch import scratch
from irsim.rng import Address, begun, normals
from irsim.types import Floats


def add_normals(signal: Floats, scale: float, seed: int, *address: Address) -> None:
    """signal += scale times the unit normals of an address, in place; (rows, cols) float32, C-contiguous."""
    if COMPILED:
        kernels.add_normals(*begun(seed, *address), signal, scale)
        return
    drawn = normals(signal.shape, seed, *address, out=scratch(signal.shape, "drawn"))
    cv2.scaleAdd(drawn, scale, signal, dst=signal)
