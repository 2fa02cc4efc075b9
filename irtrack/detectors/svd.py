"""`svd`: the frame without its largest singular parts."""

from __future__ import annotations

from typing import Any, ClassVar, cast

import cv2
from pydantic import Field

from irsim.rng import stream
from irtrack.detectors.base import Side, SingleFrameDetector
from irtrack.detectors.peaks import Picture
from irtrack.features.svd import largest_parts


class SVD(SingleFrameDetector):
    """Background suppressed by singular values: the mean over a small square of A - sum_i s_i u_i v_i'.

    D. Cui, J. Zheng, X. Li 2011 (see `irtrack.features.svd`), of which only the summary is available: the defaults of
    `components` and `side` are choices of irtrack. The parts come from a random projection with one fixed stream, so
    that equal frames have equal responses.
    """

    source: ClassVar[str] = "Cui, Zheng, Li 2011"

    components: int = Field(default=5, ge=1, le=50)
    """Number of largest singular values removed."""
    side: Side = 3
    """Side of the square over which the residual is averaged, px, odd."""

    @property
    def smoothing(self) -> float:
        """Standard deviation of a uniform square of `side`, px."""
        return self.side / 12**0.5

    @property
    def reach(self) -> int:
        return self.side + 1

    def response(self, picture: Picture) -> Picture:
        parts = largest_parts(cast(Any, picture), self.components, stream(0, "detector", "svd"))
        residual = parts.less(self.components)
        return cv2.blur(residual, (self.side, self.side), borderType=cv2.BORDER_REFLECT_101)  # type: ignore[return-value]  # OpenCV's stubs know no element types
