"""What a shape is, and the view that it is drawn in."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar, NamedTuple

from irsim.config.base import Kind, Switches
from irsim.geometry.context import SceneContext
from irsim.geometry.sprite import Sprite
from irsim.motion.attitude import ARROW, Posture
from irsim.targets.flicker import FLICKERS, Flicker, Steady
from irsim.types import Floats

Angles = tuple[float, float, float]


class View(NamedTuple):
    """How the camera sees a target in one frame.

    position  (3,) m, camera frame
    attitude  (3, 3) body vectors (x forward, y right, z down) to camera vectors
    time      s since frame 0: how moving parts lie
    name      the target's id: what is random about it is addressed by it
    age       s since its path began: how a flare burns; inf where the path has no beginning
    """

    position: Floats
    attitude: Floats
    context: SceneContext
    time: float = 0.0
    name: str = ""
    age: float = math.inf


class Shape(Kind):
    """A target's geometry and temperatures."""

    switches: ClassVar[Switches] = {"flicker": ("flicker", Steady())}

    alike: ClassVar[Mapping[str, int]] = {}
    """Keys that say how often a second parts of it turn or swing, and in how many places of a turn they look alike."""

    lies: ClassVar[Posture] = ARROW
    """How its kind lies along its path."""
    grounded: ClassVar[bool] = False
    """Does its kind stand on the ground, or float on the sea?"""
    fastest_m_s: ClassVar[float | None] = None
    """How fast the fastest of its kind are known to go over the ground, m/s; None where that says nothing."""
    poses: ClassVar[tuple[Angles, ...]] = ((90.0, 0.0, 0.0), (50.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    """Yaw, pitch, roll, degrees, that it is often seen at: pictures use them."""
    behind_k: ClassVar[float] = 262.0
    """Temperature that is often behind it, kelvin: pictures use it."""
    from_above_deg: ClassVar[float] = 0.0
    """How steeply down it is often looked at, degrees (below 0: from below): pictures use it."""

    flicker: Annotated[Flicker, FLICKERS] = Steady()
    """How its brightness changes over time."""

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that it is read from."""
        return ()

    @property
    def doubt(self) -> tuple[str, str] | None:
        """A key, and why what it says is legal but may not be meant."""
        return None

    @property
    def posture(self) -> Posture:
        """How it lies along its path."""
        return self.lies

    def brightness(self, view: View) -> float:
        """The factor that its flicker makes all its light by."""
        return self.flicker.factor(view.time, view.context.seed, view.name)

    @property
    def stands_for(self) -> str:
        """Its class in truth, where the scenario gives none."""
        return self.kind

    @abstractmethod
    def draw(self, view: View) -> Sprite | None:
        """The target alone, at its exact sub-pixel place; None where it is behind the camera."""
