"""What is new in each pixel of a frame: where there was a compiler, added in the pass that draws it."""

from __future__ import annotations

import cv2

from irsim._native import COMPILED, kernels
from irsim.camera.noise_base import FrameContext
from irsim.camera.scratch import scratch
from irsim.rng import Address, kernel_arguments, normals
from irsim.types import Floats


def grain_address(frame_context: FrameContext) -> tuple[int, *tuple[Address, ...]]:
    """By what a frame's grain is drawn: of no noise's name, so that one that is switched off leaves the others as they
    are, but for its part of the sigma."""
    return frame_context.seed, "noise", "white", frame_context.index


def add_grain(signal: Floats, sigma: float, frame_context: FrameContext) -> None:
    """signal += sigma times the unit normals of a frame's grain, in place; (rows, cols) float32, C-contiguous."""
    if COMPILED:
        kernels.add_normals(*kernel_arguments(*grain_address(frame_context)), signal, sigma)
        return
    drawn = normals(signal.shape, *grain_address(frame_context), out=scratch(signal.shape, "drawn"))
    cv2.scaleAdd(drawn, sigma, signal, dst=signal)
