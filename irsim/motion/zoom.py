"""A camera that zooms."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import Several
from irsim.config.quantities import NotNegative
from irsim.geometry.context import SceneContext
from irsim.motion.base import Pointing
from irsim.types import Floats

Knot = Annotated[tuple[NotNegative, Annotated[float, Field(ge=1, le=50)]], Field(strict=False)]


class Zoom(Pointing):
    """A focal length that changes with time: `ifov_mrad` over the factor; constant before the first frame and
    after the last given, and between them evenly in its logarithm, as a zoom lens is driven."""

    factors: Annotated[Several[Knot], Field(min_length=1)] = ((0.0, 1.0),)
    """List of [frame, factor], factors from 1: `ifov_mrad` is the widest view."""

    @model_validator(mode="after")
    def _frames_rise(self) -> Zoom:
        if any(b[0] <= a[0] for a, b in pairwise(self.factors)):
            raise PydanticCustomError("zoom", "the frames do not rise; allowed: rising frames", {"at": ("factors",)})
        return self

    def zooms(self, frames: Floats, context: SceneContext) -> Floats:
        knots, factors = np.array(self.factors).T
        return np.asarray(np.exp(np.interp(frames, knots, np.log(factors))))
