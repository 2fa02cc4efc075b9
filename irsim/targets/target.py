"""A target of a scenario: its shape, its path, and its absences."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import Name, Part, Several, Switches
from irsim.config.quantities import Stretch, Triple, Turning
from irsim.motion import PATHS, Path
from irsim.targets import SHAPES, Shape


class Target(Part):
    """An object to track, or a distractor."""

    switches: ClassVar[Switches] = {"spin": ("spin_deg_s", (0.0, 0.0, 0.0)), "absences": ("absent", ())}

    id: Name
    """Its name in ground truth, overrides and --without."""
    cls: Name | None = None
    """Its class in the ground truth; default: the shape's kind (flares and hot spots: decoy)."""
    shape: Annotated[Shape, SHAPES]
    """Its appearance."""
    path: Annotated[Path, PATHS]
    """Its motion."""
    attitude_deg: Triple = (0.0, 0.0, 0.0)
    """Yaw, pitch, roll added to the attitude along its path, degrees."""
    spin_deg_s: Annotated[tuple[Turning, Turning, Turning], Field(strict=False)] = (0.0, 0.0, 0.0)
    """Rates of yaw, pitch, roll, degrees a second."""
    contrast: Annotated[float, Field(ge=0, le=2)] = 1.0
    """Factor of its difference to the background; below 1 it is fainter, 0 is invisible."""
    absent: Several[Stretch] = ()
    """List of [first, last] frames, both counted, in which it is absent: not drawn, and without ground truth."""

    @model_validator(mode="after")
    def _absences_are_ranges(self) -> Target:
        for index, (first, last) in enumerate(self.absent):
            if last < first:
                raise PydanticCustomError(
                    "absent",
                    "frame {last} is before frame {first}; allowed: [first, last]",
                    {"first": first, "last": last, "at": ("absent", index)},
                )
        return self

    def exists(self, frame: int) -> bool:
        """Return True if it is present in a frame."""
        absent = self.absent and any(first <= frame <= last for first, last in self.absent)
        return frame >= self.path.begins and not absent
