"""A source of random pictures for the tests of recordings, and their comparison."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from irsim.types import Box, Frame, Input, Pose, Source, TargetTruth, Truth

FULL = TargetTruth(
    id="jet",
    center=(10.123456789012345, 7.0),
    box=Box(10.25, 7.0, 8.5, 6.0),
    cls="body",
    signal_center=(10.5, 7.25),
    velocity=(1.5, -0.25),
    attitude=(10.0, -5.0, 180.0),
    range_m=2500.5,
    visible=0.75,
    occluders=("pole", "cloud"),
    crossing=False,
    in_view=True,
    contrast_k=-3.5,
)
BARE = TargetTruth(id="dot", center=(3.0, 4.0), box=Box(3.0, 4.0, 2.0, 2.0), accuracy_px=1.0)
POSE = Pose(370.1234567890123, -0.5, 1e-17, 3.1e-4, (1.5, -2.25, 0.125))


@dataclass(frozen=True)
class Noise(Source):
    """A source of random pictures whose truth has every field or hardly any; `jet` is absent at times."""

    count: int = 7
    size: tuple[int, int] = (32, 24)
    bits: int = 14
    has_truth: bool = True
    follow: str | None = "dot"
    name: str = "noise"
    hash: str = "abc"
    rate_hz: float = 30.0
    seed: int = 0

    def __len__(self) -> int:
        return self.count

    def frame(self, index: int, input: Input = "counts") -> Frame:
        rng = np.random.default_rng((self.seed, index))
        values = rng.integers(0, 2**self.bits, self.size[::-1])
        image = values.astype(np.uint8) if self.bits <= 8 else values.astype(np.uint16)
        return Frame(image, index, index / self.rate_hz, self.bits)

    def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        yield from (self.frame(index) for index in range(start, self.count if stop is None else stop))

    def truths(self, start: int = 0, stop: int | None = None) -> Iterator[Truth]:
        for index in range(start, self.count if stop is None else stop):
            targets, pose = ((BARE,), None) if index % 3 == 2 else ((FULL, BARE), POSE)
            yield Truth(index, index / self.rate_hz, targets, pose)


def same_frames(first: Iterator[Frame], second: Iterator[Frame]) -> bool:
    return all(
        one.index == other.index
        and one.time == other.time
        and one.bits == other.bits
        and one.image.dtype == other.image.dtype
        and np.array_equal(one.image, other.image)
        for one, other in zip(first, second, strict=True)
    )
