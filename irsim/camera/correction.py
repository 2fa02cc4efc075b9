"""When the camera corrects its non-uniformity."""

from __future__ import annotations

from bisect import bisect_right
from typing import Annotated, ClassVar

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import Part, Several, Switches

Later = Annotated[int, Field(ge=1, le=10_000_000)]


class Correction(Part):
    """Non-uniformity corrections: each sets drift back to nothing, and the picture may stand still for it."""

    switches: ClassVar[Switches] = {"freeze": ("freeze_frames", 0)}

    frames: Several[Later] = ()
    """Frames at which a correction begins."""
    period_frames: Later | None = None
    """A correction begins at every multiple of so many frames, too."""
    freeze_frames: Annotated[int, Field(ge=0, le=10_000)] = 0
    """How many frames show the last picture before the correction again; truth goes on. Drift counts from the first of
    them, so that it is the same without the freeze; a real camera's, which corrects itself behind its shutter, from the
    last (a freeze of 0.5 s: a sigma of 4 % of what a drift of 600 s tends to)."""

    @model_validator(mode="after")
    def _picture_moves(self) -> Correction:
        if self.period_frames is not None and self.freeze_frames >= self.period_frames:
            raise PydanticCustomError(
                "always_frozen",
                "a picture that stands still for {freeze} of every {period} frames never moves; "
                "allowed: fewer than period_frames",
                {"freeze": self.freeze_frames, "period": self.period_frames, "at": ("freeze_frames",)},
            )
        return self

    def last(self, index: int) -> tuple[int, int]:
        """Frame of the last correction at or before `index` (0 where there was none), and how many there were."""
        period = self.period_frames
        single = sorted(frame for frame in set(self.frames) if period is None or frame % period)
        count = bisect_right(single, index)
        frame = single[count - 1] if count else 0
        if period is not None:
            frame, count = max(frame, index - index % period), count + index // period
        return frame, count

    def shown(self, index: int) -> int:
        """The frame whose picture is seen at frame `index`: an earlier one while the picture stands still."""
        while True:
            frame, count = self.last(index)
            if not count or index - frame >= self.freeze_frames:
                return index
            index = frame - 1
