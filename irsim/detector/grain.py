"""Normals added to a frame: where there was a compiler each in the pass that draws it."""

from __future__ import annotations

import cv2
import numpy as np

from irsim.compiled import COMPILED, kernels
from irsim.detector.scratch import scratch
from irsim.rng import Address, begun, normals, outer
from irsim.types import Floats


def add_normals(signal: Floats, scale: float, seed: int, *address: Address) -> None:
    """signal += scale times the unit normals of an address, in place; (rows, cols) float32, C-contiguous."""
    if COMPILED:
        add_outer(signal, scale, kernels.add_normals(*begun(seed, *address), signal, scale))
        return
    drawn = normals(signal.shape, seed, *address, out=scratch(signal.shape, "drawn"))
    cv2.scaleAdd(drawn, scale, signal, dst=signal)


def add_outer(signal: Floats, scale: float, found: bytes) -> None:
    """signal += scale times the normals that a compiled loop left out, as it says by `found`; in place."""
    places, tails = outer(found)
    if places.size:
        flat = signal.reshape(-1)
        flat[places] = np.ravel(cv2.scaleAdd(tails, scale, flat[places]))  # a column in OpenCV 4
