"""What a tracker may take of wall time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Limit:
    """What a tracker may take of wall time, rendering apart: in a whole run, or for each frame of it."""

    seconds: float
    of: Literal["run", "frame"]

    def left(self, spent_s: float) -> float:
        """How long the next frame may take where the run has taken so long, s."""
        return self.seconds - spent_s * (self.of == "run")

    def exceeded(self) -> str:
        """What is said of a tracker that took longer."""
        what = "timed out" if self.of == "run" else "hangs"
        return f"{what}: more than {self.seconds:g} s in the tracker"


NO_LIMIT = Limit(math.inf, "run")
