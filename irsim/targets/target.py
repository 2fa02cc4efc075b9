"""A target of a scenario: what it looks like, where it goes, and when it is there."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import Name, Part, Several, Switches
from irsim.config.quantities import Stretch, Triple, Turning
from irsim.motion import PATHS, Path
from irsim.targets import SHAPES, Shape


class Target(Part):
    """Something to be tracked, or to be mistaken for it."""

    switches: ClassVar[Switches] = {"spin": ("spin_deg_s", (0.0, 0.0, 0.0)), "absences": ("absent", ())}

    id: Name
    """Its name in truth, overrides and --without."""
    cls: Name | None = None
    """Its class in truth; the shape's kind where not given (of flares and hot spots: decoy)."""
    shape: Annotated[Shape, SHAPES]
    """What it looks like."""
    path: Annotated[Path, PATHS]
    """Where it goes."""
    attitude_deg: Triple = (0.0, 0.0, 0.0)
    """Yaw, pitch, roll added to the attitude that its path gives, degrees."""
    spin_deg_s: Annotated[tuple[Turning, Turning, Turning], Field(strict=False)] = (0.0, 0.0, 0.0)
    """Rates of the same three, degrees a second."""
    contrast: Annotated[float, Field(ge=0, le=2)] = 1.0
    """Factor of its difference to what is behind it: fainter, for a neighbour of like grey; 0 is invisible."""
    absent: Several[Stretch] = ()
    """List of [first, last] frame between which, both counted, it is not there: not drawn, and no truth."""

    @model_validator(mode="after")
    def _absences_are_stretches(self) -> Target:
        for index, (first, last) in enumerate(self.absent):
            if last < first:
                raise PydanticCustomError(
                    "absent",
                    "frame {last} is before frame {first}; allowed: [first, last]",
                    {"first": first, "last": last, "at": ("absent", index)},
                )
        return self

    def exists(self, frame: int) -> bool:
        """Is it there in that frame?"""
        absent = self.absent and any(first <= frame <= last for first, last in self.absent)
        return frame >= self.path.begins and not absent
