"""A target of a scenario: shape, path and absences."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from irsim.config.base import Name, Part, Several, Switches
from irsim.config.quantities import Stretch, Triple, Turning
from irsim.motion import PATHS, Path
from irsim.targets import SHAPES, Shape
from irsim.targets.base import wrong_value


class Target(Part):
    """An object to track, or a distractor."""

    switches: ClassVar[Switches] = {"spin": ("spin_deg_s", (0.0, 0.0, 0.0)), "absences": ("absent", ())}

    id: Name
    """Name in the ground truth, in overrides and for --without."""
    cls: Name | None = None
    """Class in the ground truth; default: the kind of the shape, or decoy for flares and hot spots."""
    shape: Annotated[Shape, SHAPES]
    """Shape and temperatures."""
    path: Annotated[Path, PATHS]
    """Path of the target."""
    attitude_deg: Triple = (0.0, 0.0, 0.0)
    """[yaw, pitch, roll] added to the attitude along the path, degrees."""
    spin_deg_s: Annotated[tuple[Turning, Turning, Turning], Field(strict=False)] = (0.0, 0.0, 0.0)
    """Rates of [yaw, pitch, roll], degrees a second."""
    contrast: Annotated[float, Field(ge=0, le=2)] = 1.0
    """Factor on the difference from the background: below 1 fainter, 0 invisible."""
    absent: Several[Stretch] = ()
    """List of [first, last] frames, inclusive, in which the target is absent: neither drawn nor in the ground truth."""

    @model_validator(mode="after")
    def _absences_are_ranges(self) -> Target:
        for index, (first, last) in enumerate(self.absent):
            if last < first:
                raise wrong_value(f"frame {last} is before frame {first}; allowed: [first, last]", "absent", index)
        return self

    def exists(self, frame: int) -> bool:
        """Return True if the target is present in a frame."""
        absent = self.absent and any(first <= frame <= last for first, last in self.absent)
        return frame >= self.path.begins and not absent
