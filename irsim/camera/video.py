"""Video as an uncooled camera core delivers it.

counts -> temporal noise reduction -> detail enhancement -> gain control to 8 bits -> encoding and decoding

Each stage is off by default. Recordings keep the counts; `irsim` computes the video from them, so that frames before
and after any stage can be had from one recording.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated

import numpy as np

from irsim.camera.agc import Agc, Picture, Plateau, Statistics
from irsim.camera.agc_local import CURVES, Clahe
from irsim.camera.detail import DetailEnhancement
from irsim.camera.encoding import H264, EncodedSequence
from irsim.camera.temporal_filter import FilterSequence, TemporalFilter
from irsim.config.base import Family
from irsim.types import Image


class Video(Agc):
    """Video of a camera core: optional stages around another AGC."""

    noise_reduction: TemporalFilter | None = None
    """Recursive filter over time."""
    detail: DetailEnhancement | None = None
    """Detail enhancement."""
    base: Annotated[Agc, Family("agc", Agc, {**CURVES.kinds, "clahe": Clahe})] = Plateau()
    """AGC that displays the result."""
    encoding: H264 | None = None
    """Lossy encoding."""

    @property
    def memory(self) -> int:
        return self.base.memory

    def fixed_range(self, bits: int) -> tuple[int, int] | None:
        return self.base.fixed_range(bits)

    def display(self, counts: Image, bits: int) -> Picture:
        picture = self.base.display(self.processed(bits)(0, lambda index: counts), bits)
        return picture if self.encoding is None else EncodedSequence(self.encoding).frame(0, lambda index: picture)

    def statistics(self, counts: Image, bits: int) -> Statistics:
        """Return the statistics of processed counts."""
        return self.base.statistics(counts, bits)

    def picture(self, counts: Image, bits: int, statistics: Sequence[Statistics]) -> Picture:
        """Return the picture, before encoding, of processed counts."""
        return self.base.picture(counts, bits, statistics)

    def processed(self, bits: int) -> Callable[[int, Callable[[int], Image]], Image]:
        sequence = None if self.noise_reduction is None else FilterSequence(self.noise_reduction)
        enhancement = self.detail or DetailEnhancement(gain=1)

        def frame(index: int, counts: Callable[[int], Image]) -> Image:
            if sequence is not None:
                return enhancement.enhance(sequence.frame(index, counts), bits)
            return counts(index) if self.detail is None else self.detail.enhance(counts(index).astype(np.float32), bits)

        return frame

    def delivered(self) -> Callable[[int, Callable[[int], Picture]], Picture] | None:
        return None if self.encoding is None else EncodedSequence(self.encoding).frame
