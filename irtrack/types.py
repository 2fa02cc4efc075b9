"""The values of tracking: Estimate, Track, and the Tracker protocol.

Coordinates follow `irsim.types`: px, x right, y down, the centre of the top-left pixel is (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol

import numpy as np

from irsim.types import Box, Floats, Frame, Input

Status = Literal["tracking", "occluded", "lost"]
"""What a tracker says of itself: it sees the target, it predicts through a hiding, it has lost it."""


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """What a tracker says after one frame.

    center      (x, y) px, finite
    size        (w, h) px
    status      see `Status`
    score       similarity or confidence of the tracker's own scale; None where it has none
    velocity    (vx, vy) px per frame
    covariance  (2, 2) px^2 of the centre
    neff        effective number of particles
    particles   (N, d) with x, y first;  weights (N,), summing to one
    """

    center: tuple[float, float]
    size: tuple[float, float]
    status: Status = "tracking"
    score: float | None = None
    velocity: tuple[float, float] | None = None
    covariance: Floats | None = None
    neff: float | None = None
    particles: Floats | None = None
    weights: Floats | None = None

    @property
    def box(self) -> Box:
        return Box(*self.center, *self.size)


class Tracker(Protocol):
    """A tracker is a frozen value of parameters with two pure functions.

    The state is a value too: `step` returns a new one and leaves the old one, the frame and the box
    untouched, so that a copied or pickled state resumes exactly. A tracker that cannot promise this
    says `resumable = False`. The generator of frame k is `irsim.rng.stream(seed, name, target, k)`, name
    being the tracker's own, whatever its label.
    """

    resumable: ClassVar[bool]

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Any:
        """The state after the first frame, where the target is in `box`."""
        ...

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, Estimate]:
        """The state and the estimate after the next frame."""
        ...


@dataclass(frozen=True, eq=False)
class Track:
    """A tracker's run over a source: the start box as estimate of the start frame, then each step.

    source, source_hash   of the Source
    tracker               label in tables;  config: its name and parameters
    target                id of the target followed, None where a box was given
    start                 index of the first frame;  start_box: the box given there
    indices               (n,) frame indices;  times (n,) s
    estimates             n of them, the first is the start box itself
    step_ms               (n,) wall time of each init or step, ms
    """

    source: str
    source_hash: str
    tracker: str
    config: dict[str, Any]
    target: str | None
    start: int
    start_box: Box
    input: Input
    scene_seed: int | None
    tracker_seed: int
    indices: np.ndarray
    times: np.ndarray
    estimates: tuple[Estimate, ...]
    step_ms: np.ndarray

    @property
    def centers(self) -> Floats:
        """(n, 2) px."""
        return np.array([estimate.center for estimate in self.estimates], dtype=np.float64)

    @property
    def sizes(self) -> Floats:
        """(n, 2) px."""
        return np.array([estimate.size for estimate in self.estimates], dtype=np.float64)

    @property
    def statuses(self) -> tuple[Status, ...]:
        return tuple(estimate.status for estimate in self.estimates)
