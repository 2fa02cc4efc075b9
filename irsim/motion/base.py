"""What a path and a camera motion are."""

from __future__ import annotations

from abc import abstractmethod

from irsim.kinds import Kind, NamedKind
from irsim.stage import Stage
from irsim.types import Floats


class Path(Kind):
    """Where a target is. Subclasses have a closed form, or integrate from frame 0 onward, so that a
    position never depends on how many frames are asked for."""

    @abstractmethod
    def positions(self, frames: Floats, stage: Stage, name: str) -> Floats:
        """(n, 3) m in the first camera frame, at frame numbers (n,) that may be fractional.

        `name` is the target's id: it addresses the path's randomness.
        """


class Pointing(NamedKind):
    """A motion of the camera; the motions of a list add up."""

    @abstractmethod
    def turns(self, frames: Floats, stage: Stage) -> Floats:
        """(n, 3) rad at frame numbers (n,): azimuth (right), elevation (up), roll (clockwise)."""
