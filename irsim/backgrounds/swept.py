"""Layers over which the camera sweeps while a frame is exposed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irsim.backgrounds.base import Changed, ViewDirection, opaque, veiled
from irsim.types import Floats, Slices


@dataclass(frozen=True, eq=False)
class Swept(Changed):
    """A layer's mean over several gazes of a frame, evenly spread."""

    gazes: tuple[ViewDirection, ...]

    def light(self, view_direction: ViewDirection) -> tuple[Floats | None, Floats]:
        passed, emission, _ = self.parts([])
        return passed, emission

    def veil(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """See `SemiTransparentLayer`; the transmittance of patches at each gaze, (n, rows, columns)."""
        passed, emission, patches = self.parts(behind)
        if passed is None:
            raise opaque(self.name)
        veiled(under, light, passed, emission, ())
        return patches

    def parts(self, behind: Sequence[Slices]) -> tuple[Floats | None, Floats, list[Floats]]:
        """What is let through, the light, and what is let through of patches at each gaze."""
        weight = np.float32(1 / len(self.gazes))
        passed: Floats | None = None
        emission: Floats | None = None
        patches: list[list[Floats]] = [[] for _ in behind]
        for each in self.gazes:
            through, own = self.layer.light(each)
            emission = own * weight if emission is None else emission + own * weight
            if through is not None:
                passed = through * weight if passed is None else passed + through * weight
                for kept, patch in zip(patches, behind, strict=True):
                    kept.append(through[patch].copy())
        assert emission is not None
        return passed, emission, [np.stack(kept) for kept in patches if kept]
