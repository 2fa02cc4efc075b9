"""What a background is: layers from far to near, each a transmittance and an emission."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from irsim.kinds import Kind
from irsim.stage import Stage
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class Gaze:
    """Where the camera looks in one frame: index, and the world rotation (3, 3) (world to camera)."""

    index: int
    rotation: Floats


class Layer(Protocol):
    """Something that fills the picture at a range: L <- L * transmittance + emission."""

    name: str
    range_m: float

    def light(self, gaze: Gaze) -> tuple[Floats | None, Floats]:
        """(transmittance or None where opaque, emission in W/m2/sr), each (rows, cols) float32.

        The caller must not write to them: a layer may keep them.
        """
        ...


class Background(Kind):
    """What is behind the targets."""

    @abstractmethod
    def layers(self, stage: Stage) -> Sequence[Layer]:
        """The layers, the farthest first; the first is opaque."""

    def names(self) -> tuple[str, ...]:
        """Names of the parts that can be switched off (the opaque layer cannot)."""
        return ()


