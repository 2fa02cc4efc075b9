"""From counts to the 8-bit picture: automatic gain control (AGC)."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
import numpy.typing as npt

from irsim.kinds import Kind
from irsim.types import Image


class Agc(Kind):
    """A way from counts to 8 bits."""

    @abstractmethod
    def display(self, counts: Image, bits: int) -> npt.NDArray[np.uint8]:
        """(rows, cols) uint8 picture of `counts` (uint8 or uint16, `bits` deep)."""
