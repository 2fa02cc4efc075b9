"""Ground seen from above: a temperature field in angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.backgrounds.base import FARTHEST, Background, Gaze, Layer
from irsim.backgrounds.painting import Painting
from irsim.backgrounds.texture import Tile, power_law, tile_side
from irsim.kinds import Kelvin, NotNegative, Positive
from irsim.radiometry import radiance
from irsim.stage import Stage
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class Terrain:
    """The opaque layer of the ground."""

    painting: Painting
    name: str = "ground"
    range_m: float = FARTHEST

    def light(self, gaze: Gaze) -> tuple[None, Floats]:
        return None, self.painting.seen(gaze)[0]


class Ground(Background):
    """Terrain whose temperature varies about a mean; with `spread_k: 0` it is flat."""

    mean_k: Kelvin = 290.0
    """Mean temperature, K."""
    spread_k: NotNegative = 3.0
    """Standard deviation of temperature, K."""
    beta: Annotated[float, Field(ge=0, le=6)] = 2.6
    """Slope of the 2-D power spectrum f^-beta (real ground: 2.2 to 3)."""
    correlation_mrad: Positive = 20.0
    """Size of the largest features, mrad."""
    stretch: Annotated[float, Field(ge=0.1, le=10)] = 1.5
    """How much wider than high features are."""

    def layers(self, stage: Stage) -> Sequence[Layer]:
        geometry = stage.geometry
        field = power_law(
            tile_side(geometry.size),
            self.beta,
            self.correlation_mrad * 1e-3 / geometry.ifov_rad,
            self.stretch,
            stage.seed,
            "ground",
        )
        kelvin = np.maximum(self.mean_k + self.spread_k * field, 1.0)
        light = radiance(stage.band, kelvin).astype(np.float32)
        return [Terrain(Painting((Tile.of(light, geometry.size, stage.psf_px),)))]
