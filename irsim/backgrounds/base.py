"""What a background is: layers from far to near, each a transmittance and an emission."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from irsim.backgrounds.chart import Chart
from irsim.kinds import Kind
from irsim.stage import Stage
from irsim.types import Floats

Names = Iterator[tuple[str, tuple[str | int, ...]]]
"""Names of a background's parts, each with its place in it."""

Slices = tuple[slice, slice]
"""A patch of a picture: its rows and columns."""


@dataclass(frozen=True, eq=False)
class Gaze:
    """One frame's pointing: time in s, and the chart of the directions that the pixels see.

    key: the pointing of a frame nearby, its chart with a margin. What is painted for it need only be
    moved for this one (see `irsim.backgrounds.painting`).
    place: how far right, below and ahead of its first place the camera is, m; level, ahead is the
    azimuth of the first pointing.
    """

    time: float
    chart: Chart
    key: Gaze | None = None
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Layer(Protocol):
    """Something that fills the picture at a range: L <- L * transmittance + emission."""

    @property
    def name(self) -> str: ...

    @property
    def range_m(self) -> float: ...

    def light(self, gaze: Gaze) -> tuple[Floats | None, Floats]:
        """(transmittance, None where opaque; emission in W/m2/sr), each (rows, cols) float32.

        The caller must not write to them: a layer may keep them for the next frame.
        """
        ...


class Veil(Layer, Protocol):
    """A layer that fills the picture by itself, which is quicker than to give what it takes."""

    def veil(self, under: Floats, light: Floats, gaze: Gaze, behind: Sequence[Slices]) -> list[Floats]:
        """light <- under * transmittance + emission; the transmittance of patches, (rows, columns) each.

        under: (rows, cols) of the same type, which may be the light itself.
        """
        ...


def veiled(under: Floats, light: Floats, passed: Floats, emission: Floats, behind: Sequence[Slices]) -> list[Floats]:
    """light <- under * passed + emission, as `Veil.veil`; `passed` of patches (rows, columns)."""
    np.multiply(under, passed, out=light)
    light += emission
    return [passed[patch] for patch in behind]


@dataclass(frozen=True, eq=False)
class Changed:
    """A layer whose light something changes; its name and range stay."""

    layer: Layer

    @property
    def name(self) -> str:
        return self.layer.name

    @property
    def range_m(self) -> float:
        return self.layer.range_m


class Background(Kind):
    """What is behind the targets."""

    noisy: ClassVar[bool] = False
    """Does its light hold a camera's noise already?"""

    @abstractmethod
    def layers(self, stage: Stage) -> Sequence[Layer]:
        """The layers, the farthest first; the first is opaque."""

    def names(self) -> Names:
        """Name and place of each layer that can be switched off (the opaque one cannot)."""
        yield from ()

    def refuses(self, size: tuple[int, int], bits: int) -> str | None:
        """Why a camera of that size (columns, rows) and depth cannot look at it; None where it can."""
        return None


FARTHEST = float(np.inf)
"""Range of what lies behind every target, m."""
