"""Base class of target shapes, and the view in which a shape is drawn."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar, NamedTuple

from pydantic_core import PydanticCustomError

from irsim.config.base import Kind, Switches
from irsim.geometry.context import SceneContext
from irsim.geometry.sprite import Sprite
from irsim.motion.attitude import ARROW, Posture
from irsim.targets.flicker import FLICKERS, Flicker, Steady
from irsim.types import Floats

Angles = tuple[float, float, float]
"""Yaw, pitch, roll, degrees."""


def wrong_value(reason: str, *at: str | int) -> PydanticCustomError:
    """Return the validation error for a value, at the path of keys `at`."""
    return PydanticCustomError("target", "{reason}", {"reason": reason, "at": at})


class View(NamedTuple):
    """Pose of a target relative to the camera in one frame.

    position  (3,) m, camera frame
    attitude  (3, 3) rotation from body vectors (x forward, y right, z down) to camera vectors
    context   scene context, with the zoom of this frame
    time      s since frame 0, for moving parts and flicker
    name      the target's id, which addresses its random streams
    age       s since the start of its path, for flares; inf on a path without a start
    """

    position: Floats
    attitude: Floats
    context: SceneContext
    time: float = 0.0
    name: str = ""
    age: float = math.inf


class Shape(Kind):
    """Geometry and temperatures of a target."""

    switches: ClassVar[Switches] = {"flicker": ("flicker", Steady())}

    rotational_symmetry: ClassVar[Mapping[str, int]] = {}
    """Keys of rotation or oscillation rates, Hz, each with the number of identical positions in one turn or cycle."""
    default_posture: ClassVar[Posture] = ARROW
    """Law for the attitude of targets of the kind along their paths."""
    grounded: ClassVar[bool] = False
    """True if the kind stands on the ground or floats on the sea."""
    max_speed_m_s: ClassVar[float | None] = None
    """Highest known ground speed of the kind, m/s; None if not applicable."""
    picture_poses: ClassVar[tuple[Angles, ...]] = ((90.0, 0.0, 0.0), (50.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    """Typical attitudes for pictures in the documentation."""
    picture_background_k: ClassVar[float] = 262.0
    """Typical background temperature for pictures, kelvin."""
    picture_depression_deg: ClassVar[float] = 0.0
    """Typical downward viewing angle for pictures, degrees; negative from below."""

    flicker: Annotated[Flicker, FLICKERS] = Steady()
    """Change of the brightness over time; default: constant."""

    @property
    def files(self) -> tuple[Path, ...]:
        """Files from which the shape is read."""
        return ()

    @property
    def warning(self) -> tuple[str, str] | None:
        """(key, reason) of a value that is allowed but implausible; None without one."""
        return None

    @property
    def posture(self) -> Posture:
        """Law for the attitude of the target along its path."""
        return self.default_posture

    def brightness(self, view: View) -> float:
        """Return the factor on the radiance due to flicker."""
        return self.flicker.factor(view.time, view.context.seed, view.name)

    @property
    def default_class(self) -> str:
        """Class in the ground truth unless the scenario sets one."""
        return self.kind

    @abstractmethod
    def draw(self, view: View) -> Sprite | None:
        """Return the sprite of the target at its exact sub-pixel position; None if it is behind the camera."""
