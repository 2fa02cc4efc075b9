"""Noise kinds of a user's own: silent, but one lets no process go on before a second one is there, and one fails."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

from irsim.camera.noise_base import Additive, FrameContext
from irsim.render.division import TRIED
from irsim.types import Floats

PATIENCE_S = 120.0


class Rendezvous(Additive):
    """Each process leaves its id in `folder`, at each scene that it works out but for those that one renders before
    others have any, and waits for another's."""

    folder: str

    def pattern(self, frame_context: FrameContext) -> Floats:
        return np.zeros((1, 1), np.float32)

    def pattern_variance(self, frame_context: FrameContext, fixed: bool) -> float:
        if frame_context.index < TRIED:
            return 0.0
        folder = Path(self.folder)
        (folder / str(os.getpid())).touch()
        end = time.monotonic() + PATIENCE_S
        while len(list(folder.iterdir())) < 2:
            if time.monotonic() > end:
                raise TimeoutError("no second process came")
            time.sleep(0.01)
        return 0.0


class Failing(Additive):
    """One frame cannot be rendered."""

    at: int

    def pattern(self, frame_context: FrameContext) -> Floats:
        if frame_context.index == self.at:
            raise ValueError(f"frame {self.at} cannot be")
        return np.zeros((1, 1), np.float32)

    def pattern_variance(self, frame_context: FrameContext, fixed: bool) -> float:
        return 0.0
