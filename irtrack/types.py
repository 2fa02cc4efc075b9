"""The values of tracking: Estimate, Track, Detections, and the protocols of trackers and detectors.

Coordinates follow `irsim.types`: px, x right, y down, the centre of the top-left pixel is (0, 0).
"""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import groupby
from types import MethodType
from typing import Any, Literal, Protocol, get_args, get_type_hints

import numpy as np

from irsim.notebook import card
from irsim.types import Box, Floats, Frame, Input

LEAST_PX = 5.0
"""Least side of start boxes and of boxes whose overlap is measured, px: the box of a point target has too few
pixels."""

Status = Literal["tracking", "occluded", "lost"]
"""State that a tracker reports: target seen, position predicted through an occlusion, track lost."""


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Output of a tracker after one frame.

    center      (x, y) px, finite
    size        (w, h) px
    status      see `Status`
    score       similarity or confidence, of any scale; None where the tracker has none
    velocity    (vx, vy) px per frame
    covariance  (2, 2) px^2 of the centre
    neff        effective number of particles
    particles   (N, d) with x, y first;  weights (N,), summing to one
    id, cls     number of the target, and its class; None where the tracker knows none
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
    id: int | None = None
    cls: str | None = None

    @property
    def box(self) -> Box:
        return Box(*self.center, *self.size)


FARTHEST_PX = 1e6
"""Largest centre and size, px: beyond it, squares of errors would exceed the precision of sums."""


class Tracker(Protocol):
    """Tracker: frozen parameters with two pure functions.

    `step` returns a new state and leaves the old one, the frame and the box unchanged, so that a copied or pickled
    state resumes exactly. A tracker that guarantees this has `resumable = True`; steps of other trackers are never
    repeated. The random generator of frame k is `irsim.rng.stream(seed, name, target, k)`, with the tracker's name, not
    its label.

    A tracker or detector with the attribute ``needs = ("pose",)`` gets frames with the camera's pose, runs only on
    sources that have it, and is marked in tables.
    """

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Any:
        """Return the state after the first frame, in which the target is in `box`."""
        ...

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, Estimate]:
        """Return the state and the estimate after the next frame."""
        ...


def resumable(tracker: Tracker) -> bool:
    """Return whether a tracker promises that a copied or pickled state resumes exactly."""
    return bool(getattr(tracker, "resumable", False))


class PlainTracker(Protocol):
    """Tracker with its state inside, as most are written; see `irtrack.trackers.adapters` for its answers.

    An argument `image` that is annotated as `irsim.types.Frame` gets the `Frame` (`plain_view`).
    """

    def start(self, image: Any, box: Box, /) -> object:
        """Begin on an image (rows, cols) with the target in `box`."""
        ...

    def step(self, image: Any, /) -> Any:
        """Return the position of the target in the next image."""
        ...


def plain_view(call: Callable[..., Any], frame: Frame) -> Any:
    """Return the argument of a plain tracker's or detector's function for a frame, a copy that may be written on.

    It is the image (rows, cols); the `Frame` with time, index and bits where the first argument is annotated so, or
    where the frame has a camera pose, which the tracker then needs.
    """
    image = frame.image.copy()
    function = call.func if isinstance(call, partial) else call
    is_method = isinstance(function, MethodType)
    function = function.__func__ if isinstance(function, MethodType) else function
    if not inspect.isroutine(function) and not isinstance(function, type):
        function, is_method = type(function).__call__, True
    is_whole = frame.pose is not None or _takes_frame(function, int(is_method))
    return replace(frame, image=image) if is_whole else image


@cache
def _takes_frame(function: Any, place: int) -> bool:
    """Return whether the argument at a position is annotated as `Frame`; cached, since inspection takes .1 ms."""
    try:
        names = list(inspect.signature(function).parameters)
        return get_type_hints(function).get(names[place]) is Frame
    except Exception:  # annotations may be any text, and builtins have no signature
        return False


GivenTracker = Tracker | PlainTracker | type[Tracker] | type[PlainTracker]
"""Objects that Python code may pass as a tracker."""


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """One detection in a frame.

    score        confidence of any scale; a larger score is more certain
    cls          class, such as "drone"; None where the detector does not classify
    covariance   (2, 2) px^2 of the centre; None where it is unknown
    """

    box: Box
    score: float
    cls: str | None = None
    covariance: Floats | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class Detections:
    """Detections of one frame as arrays; iteration gives each as a `Detection`.

    centers      (n, 2) px
    sizes        (n, 2) px, width and height
    scores       (n,)
    covariances  (n, 2, 2) px^2 of the centres; None where they are unknown
    classes      n classes, each None where unknown; None where the detector does not classify
    """

    centers: Floats
    sizes: Floats
    scores: Floats
    covariances: Floats | None = None
    classes: tuple[str | None, ...] | None = None

    @classmethod
    def of(cls, detections: Iterable[Detection]) -> Detections:
        """Return the arrays of single detections; covariances only where each has one."""
        rows = tuple(detections)
        covariances = [row.covariance for row in rows if row.covariance is not None]
        return cls(
            np.array([(row.box.cx, row.box.cy) for row in rows], dtype=np.float64).reshape(-1, 2),
            np.array([(row.box.w, row.box.h) for row in rows], dtype=np.float64).reshape(-1, 2),
            np.array([row.score for row in rows], dtype=np.float64),
            np.array(covariances, dtype=np.float64) if rows and len(covariances) == len(rows) else None,
            tuple(row.cls for row in rows) if any(row.cls is not None for row in rows) else None,
        )

    def __len__(self) -> int:
        return len(self.scores)

    def __iter__(self) -> Iterator[Detection]:
        for k in range(len(self)):
            yield Detection(
                Box(*self.centers[k].tolist(), *self.sizes[k].tolist()),
                float(self.scores[k]),
                None if self.classes is None else self.classes[k],
                None if self.covariances is None else self.covariances[k],
            )

    def take(self, rows: np.ndarray) -> Detections:
        """Return the detections selected by a boolean mask or by indices, in that order."""
        places = np.flatnonzero(rows) if rows.dtype == bool else rows
        return Detections(
            self.centers[places],
            self.sizes[places],
            self.scores[places],
            None if self.covariances is None else self.covariances[places],
            None if self.classes is None else tuple(self.classes[k] for k in places.tolist()),
        )


class Detector(Protocol):
    """Frozen parameters with a pure function from a frame to its detections."""

    def step(self, state: Any, frame: Frame) -> tuple[Any, Detections]:
        """Return the memory after a frame, and its detections; the memory before the first frame is None.

        The state (memory) of a detector of single frames stays None. The old state and the frame stay unchanged.
        """
        ...


class Estimates:
    """Base of classes with n estimates, whose fields it returns as arrays."""

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
    """Result of a tracker on a source: the start box as estimate of the start frame, then the estimate of each step.

    source, source_hash   of the Source
    tracker               label in tables;  config: its name and parameters
    target                id of the target followed, None where a box was given
    start                 index of the first frame;  start_box: the box given there
    indices               (n,) frame indices;  times (n,) s
    estimates             n estimates, of which the first is the start box itself
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
        counts = Counter(self.statuses)
        said = ", ".join(f"{status} in {counts[status]}" for status in get_args(Status) if counts[status])
        return card(self.tracker, {**facts, "it says": said}, _trajectory(self.centers, self.statuses))


COLOURS = {"tracking": "#0072b2", "occluded": "#e69f00", "lost": "#d55e00"}
"""Colour of each status (palette of Okabe and Ito)."""


def _trajectory(centers: Floats, statuses: Sequence[str]) -> str:
    """Return the trajectory of centres (n, 2) px as SVG: lines coloured by status, from a dot at the start."""
    low, high = centers.min(axis=0), centers.max(axis=0)
    margin = max(0.06 * float((high - low).max()), 4.0)
    (left, top), (width, height) = low - margin, high - low + 2 * margin
    lines = []
    for status, run in groupby(range(len(centers)), key=lambda k: statuses[k]):
        places = list(run)
        joined = centers[max(places[0] - 1, 0) : places[-1] + 1]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in joined)
        lines.append(f'<polyline points="{points}" stroke="{COLOURS[status]}" vector-effect="non-scaling-stroke"/>')
    x, y = centers[0]
    dot = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{margin / 4:.1f}" fill="{COLOURS["tracking"]}"/>'
    words = ", ".join(f'<span style="color: {color}">{status}</span>' for status, color in COLOURS.items())
    return (
        f'<figure style="margin: 0"><svg viewBox="{left:.1f} {top:.1f} {width:.1f} {height:.1f}" '
        f'style="display: block; width: {min(320, 240 * width / height):.0f}px; max-width: 100%; '
        f'background: rgba(128, 128, 128, .12)">'
        f'<g fill="none" stroke-width="2">{"".join(lines)}</g>{dot}</svg>'
        f'<figcaption style="font-size: 85%">its way: {words}</figcaption></figure>'
    )
