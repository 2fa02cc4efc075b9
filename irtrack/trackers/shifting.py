"""What the trackers share that climb by mean shift."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from irsim.types import Floats, Image
from irtrack.features.mean_shift import Shifted, mean_shift
from irtrack.trackers.base import Ratio
from irtrack.trackers.grey import Appearance, GreyPart


class ShiftPart(GreyPart):
    """A tracker whose windows climb to where they are most like the reference."""

    kernel: Literal["gaussian", "epanechnikov"] = "epanechnikov"
    """k of the histogram that judges a place; windows always climb by Epanechnikov's."""
    bandwidth: Annotated[float, Field(ge=0.1, le=5)] = 1.0
    """Bandwidth of the climbing window, in half sizes of the start box."""
    iterations: int = Field(default=20, ge=1, le=1000)
    """Steps of a climb at most (Comaniciu, Meer 2002, section 6: 20)."""
    eps: Ratio = 0.1
    """A climb ends with a step shorter than this, px."""

    def climbed(self, appearance: Appearance, picture: Image, centers: Floats, reference: Floats) -> Shifted:
        """Where windows from centres (N, 2) px come to rest."""
        h = appearance.half_sizes(self.bandwidth)
        return mean_shift(picture, centers, h, appearance.quantiser, reference, self.iterations, self.eps)
