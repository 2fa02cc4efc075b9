"""`lbp_mean_shift`: mean shift on the joint histogram of grey levels and local binary patterns."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, ClassVar

from pydantic import Field

from irsim.types import Box, Floats, Frame
from irtrack.features.histogram import histogram
from irtrack.features.lbp import TexturePicture
from irtrack.trackers.appearance import Appearance
from irtrack.trackers.mean_shift import MeanShift

LEVELS = 256
"""Grey levels of the scale on which `offset` is given."""


class LBPMeanShift(MeanShift):
    """Mean shift on a joint histogram of grey level and local binary pattern, started from the last position.

    Wang 2007, of which only the title is available (mean shift on LBP). Built from its parts: patterns by
    `irtrack.features.lbp`, the mode search of `mean_shift` (Comaniciu, Ramesh, Meer 2003), and histograms of 8 grey
    levels times 10 patterns, as in J. Ning, L. Zhang, D. Zhang, C. Wu, "Robust object tracking using joint
    color-texture histogram", IJPRAI 23(7), 2009, who keep the five patterns of edges and corners only. Chosen here: the
    unit of `offset`, so that frames of another gain or bit depth give the same patterns.
    """

    source: ClassVar[str] = "Wang 2007; Ojala, Pietikainen, Maenpaa 2002; Comaniciu, Ramesh, Meer 2003"

    bins: int = Field(default=8, ge=2, le=25)
    """Grey levels of the joint histogram, each with 10 patterns."""
    offset: Annotated[float, Field(ge=0, le=LEVELS)] = 3.0
    """Least excess of a neighbour over the middle pixel, in 256 levels of the grey range (`bins_range`); with the full
    range of 8 bits, in counts."""

    def appearance(self, frame: Frame, box: Box) -> tuple[Appearance, Floats]:
        """Return the target's appearance in its first frame, and its joint histogram (10 bins,) there."""
        plain, _ = super().appearance(frame, box)
        levels = plain.quantiser
        offset = self.offset * (levels.high - levels.low) / LEVELS
        picture = TexturePicture(levels, offset, self._high_pass(frame.image, box))
        appearance = replace(
            plain,
            quantiser=picture.joint,
            background=replace(plain.background, quantiser=picture.joint),
            high_pass=picture,
        )
        center = (box.cx, box.cy)
        return appearance, histogram(picture(frame.image), center, plain.window, plain.kernel, picture.joint)[0]
