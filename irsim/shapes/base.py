"""What a shape is, and the view that it is drawn in."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from irsim.kinds import Kind
from irsim.sprite import Sprite
from irsim.stage import Stage
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class View:
    """How the camera sees a target in one frame.

    position  (3,) m, camera frame
    attitude  (3, 3) body vectors (x forward, y right, z down) to camera vectors
    """

    position: Floats
    attitude: Floats
    stage: Stage


class Shape(Kind):
    """A target's geometry and temperatures."""

    banks: ClassVar[bool] = False
    """Does it lean into its turns, as an aircraft does?"""

    @abstractmethod
    def draw(self, view: View) -> Sprite | None:
        """The target alone, at its exact sub-pixel place; None where it is behind the camera."""
