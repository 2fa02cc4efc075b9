"""A level flight that noses over into a dive."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.kinds import TOP_SPEED, Degrees, NotNegative, Positive, Triple
from irsim.motion.arcs import arcs
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.base import MetrePath
from irsim.motion.turns import level
from irsim.stage import Stage
from irsim.types import Floats


class Dive(MetrePath):
    """Level at constant speed, then over an arc into a straight dive, and out of it again if wanted."""

    start_m: Triple
    """Where it is at frame 0, m."""
    speed_m_s: Annotated[Positive, TOP_SPEED] = 200.0
    """Along its way, metres a second."""
    heading_deg: Degrees = 90.0
    """Degrees: 0 level away along the first pointing (north), 90 to the right (east)."""
    at_frame: NotNegative = 30.0
    """Frame at which it noses over."""
    angle_deg: Annotated[float, Field(gt=0, le=90)] = 30.0
    """How steep the dive is, degrees below level."""
    pull_g: Positive = 3.0
    """Acceleration across its way while it noses over and pulls out, in g: the arcs' radius is v^2 / (pull g)."""
    pull_out_frame: NotNegative | None = None
    """Frame at which it begins to pull out, to level; not at all where not given."""

    @model_validator(mode="after")
    def _in_order(self) -> Dive:
        if self.pull_out_frame is not None and self.pull_out_frame <= self.at_frame:
            raise PydanticCustomError(
                "dive",
                "it pulls out before it dives; allowed: a frame after at_frame {first}",
                {"first": self.at_frame, "at": ("pull_out_frame",)},
            )
        return self

    def positions(self, frames: Floats, stage: Stage, name: str) -> Floats:
        rate = self.pull_g * STANDARD_GRAVITY / self.speed_m_s / stage.rate_hz
        took = math.radians(self.angle_deg) / rate
        over = self.at_frame + took
        legs = [(self.at_frame, over, rate)]
        if self.pull_out_frame is not None:
            out = max(self.pull_out_frame, over)
            legs.append((out, out + took, -rate))
        ahead, down = arcs(frames, legs, self.speed_m_s / stage.rate_hz).T
        start = self.to_first(np.array(self.start_m), stage)
        return np.asarray(start + level(ahead, np.zeros_like(ahead), -down, self.heading_deg, stage))
