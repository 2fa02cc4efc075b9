"""What a noise is."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated

from pydantic import Field

from irsim.kinds import NamedKind
from irsim.types import Floats

Ratio = Annotated[float, Field(ge=0, le=1000)]
"""A sigma in units of the camera's NETD."""


class Noise(NamedKind):
    """One term of the detector's noise, in units of the camera's NETD (sigma of the white term)."""

    @abstractmethod
    def pattern(self, index: int, shape: tuple[int, int], rate_hz: float, seed: int) -> Floats:
        """Frame `index`'s noise, broadcastable to `shape` (rows, cols), float32, in units of NETD.

        Addressed by (seed, self.name, index): the same whatever frames were asked for before. The
        caller must not write to it.
        """
