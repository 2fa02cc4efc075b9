"""Things that hide targets: opaque, at a range, fixed in angle."""

from __future__ import annotations

from abc import abstractmethod

from irsim.kinds import NamedKind, Positive
from irsim.sprite import Sprite
from irsim.stage import Stage
from irsim.types import Floats


class Occluder(NamedKind):
    """Something between the camera and the targets behind it."""

    range_m: Positive
    """Metres from the camera; it hides what is farther."""

    @abstractmethod
    def draw(self, rotation: Floats, stage: Stage) -> Sprite | None:
        """The occluder as seen by a camera turned by `rotation` (3, 3) (first camera to camera)."""
