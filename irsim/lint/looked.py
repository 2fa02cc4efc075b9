"""Frames at which warnings look."""

from __future__ import annotations

import numpy as np

from irsim.targets.target import Target
from irsim.types import Floats

WATCHED = 200
"""Of a long scenario so many, evenly spread."""


def watched(frames: int, most: int = WATCHED) -> Floats:
    """Numbers of all of so many frames, or of `most` evenly spread ones."""
    return np.unique(np.linspace(0, frames - 1, min(frames, most)).round())


def existing(target: Target, frames: Floats) -> Floats:
    """Those of the frames in which a target is there."""
    return frames[[target.exists(int(frame)) for frame in frames]]
