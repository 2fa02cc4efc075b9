"""The values of tracking: Estimate, Track, and the Tracker protocol.

Coordinates follow `irsim.types`: px, x right, y down, the centre of the top-left pixel is (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, get_args

import numpy as np

from irsim.errors import counted
from irsim.types import Box, Floats, Frame, Input
from irtrack.cards import track_card

LEAST_PX = 5.0
"""No side of a box counts as shorter, when a track starts and when boxes are compared: a point target's own
box holds too little to go by."""

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
    covariance: Floats | None = field(default=None, repr=False)
    neff: float | None = None
    particles: Floats | None = field(default=None, repr=False)
    weights: Floats | None = field(default=None, repr=False)

    @property
    def box(self) -> Box:
        return Box(*self.center, *self.size)


def fault(estimate: object) -> str | None:
    """What is wrong with what a tracker says, and what is allowed; None where it is a legal `Estimate`."""
    if not isinstance(estimate, Estimate):
        return f"step gave (state, {type(estimate).__name__}); allowed: (state, Estimate)"
    if estimate.status not in get_args(Status):
        return f"the status {estimate.status!r}; allowed: {', '.join(get_args(Status))}"
    for name, shape in _SHAPES.items():
        value = getattr(estimate, name)
        if value is None and name not in ("center", "size"):
            continue
        try:
            numbers = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            return f"the {name} {' '.join(repr(value).split())}; allowed: numbers"
        if len(numbers.shape) != len(shape) or any(
            n not in (None, m) for n, m in zip(shape, numbers.shape, strict=True)
        ):
            wanted = ", ".join("any" if n is None else str(n) for n in shape)
            return f"the {name} has the shape {numbers.shape}; allowed: ({wanted})"
        if not np.isfinite(numbers).all():
            return f"the {name} {' '.join(str(value).split())}; allowed: finite numbers"
        if name in ("center", "size") and np.abs(numbers).max() > FARTHEST_PX:
            return f"the {name} {' '.join(str(value).split())}; allowed: within {FARTHEST_PX:g} px"
    if min(estimate.size) <= 0:
        return f"the size {estimate.size}; allowed: above 0"
    if estimate.covariance is not None and min(np.diagonal(estimate.covariance)) < 0:
        return f"the covariance {np.asarray(estimate.covariance).tolist()}; allowed: variances of 0 or more"
    if estimate.weights is not None:
        return _fault_of_weights(estimate.weights, estimate.particles)
    return None


FARTHEST_PX = 1e6
"""Beyond it no centre and no size means a place in a picture, and squares of errors drown all others."""

_SHAPES: dict[str, tuple[int | None, ...]] = {
    "center": (2,),
    "size": (2,),
    "score": (),
    "velocity": (2,),
    "covariance": (2, 2),
    "neff": (),
    "particles": (None, None),
    "weights": (None,),
}
"""Shapes of what an Estimate holds; None: any length."""


def _fault_of_weights(weights: Floats, particles: Floats | None) -> str | None:
    if particles is None or len(particles) != len(weights):
        there = "no particles" if particles is None else counted(len(particles), "particle")
        return f"{counted(len(weights), 'weight')} for {there}; allowed: one for each"
    if np.min(weights) < 0 or abs(np.sum(weights) - 1) > 1e-6:
        return f"the weights sum to {np.sum(weights):g}, the least is {np.min(weights):g}; allowed: 0 or more, sum 1"
    return None


class Tracker(Protocol):
    """A tracker is a frozen value of parameters with two pure functions.

    The state is a value too: `step` returns a new one and leaves the old one, the frame and the box
    untouched, so that a copied or pickled state resumes exactly. A tracker that promises this says
    `resumable = True`; of one that says nothing no step is ever done again. The generator of frame k is
    `irsim.rng.stream(seed, name, target, k)`, name being the tracker's own, whatever its label.
    """

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Any:
        """The state after the first frame, where the target is in `box`."""
        ...

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, Estimate]:
        """The state and the estimate after the next frame."""
        ...


def resumable(tracker: Tracker) -> bool:
    """Whether a tracker promises that a copied or pickled state resumes exactly."""
    return bool(getattr(tracker, "resumable", False))


class PlainTracker(Protocol):
    """A tracker as most people write one; `irtrack.trackers.adapters` says what it may answer."""

    def start(self, image: Any, box: Box, /) -> object:
        """Begin on an image (rows, cols) with the target in `box`."""
        ...

    def step(self, image: Any, /) -> Any:
        """Where the target is in the next image."""
        ...


GivenTracker = Tracker | PlainTracker | type[Tracker] | type[PlainTracker]
"""What Python code may give where a tracker is wanted."""


class Estimates:
    """What has n estimates, and gives their fields as arrays."""

    estimates: tuple[Estimate, ...]

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


@dataclass(frozen=True, eq=False)
class Track(Estimates):
    """A tracker's run over a source: the start box as estimate of the start frame, then each step.

    source, source_hash   of the Source
    tracker               label in tables;  config: its name and parameters
    target                id of the target followed, None where a box was given
    start                 index of the first frame;  start_box: the box given there
    indices               (n,) frame indices;  times (n,) s
    estimates             n of them, the first is the start box itself
    step_ms, cpu_ms       (n,) wall time, and CPU time of the process, of each init or step, ms
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
    cpu_ms: np.ndarray

    def __repr__(self) -> str:
        followed = self.target or "a given box"
        return f"Track({self.tracker} on {self.source}: {followed}, frames {self.indices[0]} to {self.indices[-1]})"

    def _repr_html_(self) -> str:
        facts = {
            "source": self.source,
            "target": self.target or "a given box",
            "frames": f"{self.indices[0]} to {self.indices[-1]}",
            "seed": self.tracker_seed,
            "time": f"{np.median(self.step_ms):.3g} ms a frame (median)",
        }
        return track_card(self.tracker, facts, self.centers, self.statuses)
