"""Test cases of properties: clips (short rendered scenes), walks (runs of a tracker over a clip), and comparisons."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

import irsim
from irsim import strategies
from irsim.rng import stream
from irsim.types import Box, Floats, Frame, Image
from irtrack.bench.plan import task_of
from irtrack.properties.subjects import FAULTS
from irtrack.types import LEAST_PX, Estimate, Estimates, Tracker

SIZE, FRAMES = (128, 96), 30
POINTS_SIZE, POINTS_FRAMES, POINTS_SPEED = (160, 128), 24, 1.2
APART = ((48.0, 42.0), (80.0, 64.0), (112.0, 86.0))
"""Places of three points in frame 0, px: far from each other and from the edges."""
SCR = 20.0
"""Signal-to-clutter ratio of the weakest point: far above the noise."""
BACKGROUND_GREY, TARGET_GREY = 51, 176
"""Grey levels of the uniform sky of 285 K and the patch of 305 K, by the AGC of `CAMERA`. They leave room for changes
of brightness and contrast and for the negative, without saturation."""
CAMERA: Mapping[str, Any] = {"agc": {"kind": "fixed", "low": 0, "high": 9000}}


@dataclass(frozen=True, eq=False)
class Clip:
    """Clip: frames, positions of the target, and the start box.

    images    (n, rows, cols), read-only;  times  (n,) s;  bits  bit depth of the images
    centers   (n, 2) px of the target, of m points (n, m, 2); nan where it is absent
    visible   (n,) visible fraction of the target, 0 where it is absent
    text      the scenario as YAML
    first     index of the first frame
    """

    images: Image
    times: Floats
    centers: Floats
    visible: Floats
    box: Box
    text: str
    bits: int = 8
    first: int = 0

    def __len__(self) -> int:
        return len(self.images)

    def frame(self, k: int) -> Frame:
        return Frame(self.images[k], self.first + k, float(self.times[k]), self.bits)

    @property
    def size(self) -> tuple[int, int]:
        """(columns, rows)."""
        return self.images.shape[2], self.images.shape[1]

    def with_images(self, change: Callable[[Image], Image], bits: int = 8) -> Clip:
        """Return the clip with changed images; `change` is a function of all images at once."""
        return replace(self, images=_frozen(np.ascontiguousarray(change(self.images))), bits=bits)

    def with_centers(self, move: Callable[[Floats], Floats], turned: bool = False) -> Clip:
        """Return the clip with changed target positions; `turned`: width and height of the box are exchanged."""
        (cx, cy), (w, h) = move(np.array([[self.box.cx, self.box.cy]]))[0], (self.box.w, self.box.h)
        return replace(self, centers=move(self.centers), box=Box(cx, cy, *((h, w) if turned else (w, h))))

    def select(self, indices: list[int]) -> Clip:
        """Return the clip of the frames at `indices`, in this order, with their times."""
        kept = {name: getattr(self, name)[indices] for name in ("times", "centers", "visible")}
        return replace(self, images=_frozen(self.images[indices]), **kept)


def _frozen(images: Any) -> Image:
    images.setflags(write=False)
    frozen: Image = images
    return frozen


def scene(seed: int, noise: int = 2, speed: int = 3, heading: int = 0, **changes: Any) -> dict[str, Any]:
    """Return a scene like those of `Case.clip`, at these severities: a patch of 14 x 10 px on a straight path."""
    path = strategies.scenes.straight(strategies.scenes.SPEEDS[speed], 45.0 * heading, SIZE, FRAMES)
    camera = {"size": list(SIZE), "ifov_mrad": 0.5, "range_k": [270.0, 330.0], "noise": [{"kind": "white"}]}
    return {
        "seed": seed,
        "frames": FRAMES,
        "camera": {**camera, "netd_mk": strategies.scenes.NETD_MK[noise], **CAMERA},
        "background": {"kind": "sky", "horizon_k": 285.0, "zenith_k": 285.0},
        "targets": [{"id": "target", "shape": dict(strategies.scenes.HOT_SPOT), "path": path}],
        "follow": "target",
    } | changes


def rendered(document: Mapping[str, Any]) -> Clip:
    """Return the clip of a scenario; equal scenarios are rendered once."""
    return _rendered(_text(document))


def _text(document: Mapping[str, Any]) -> str:
    scenario: irsim.Scenario = irsim.build(irsim.Scenario, document, "scene")
    return str(irsim.dumps(scenario, short=True))


def rendered_points(document: Mapping[str, Any]) -> Clip:
    """Return the clip of a scenario of several targets, as counts; equal scenarios are rendered once."""
    return _rendered_points(_text(document))


@lru_cache(maxsize=64)
def _rendered_points(text: str) -> Clip:
    source = irsim.open_source(irsim.loads(text))
    pairs = list(source.pairs(input="counts"))
    names = [target.id for target in irsim.loads(text).targets]
    far = (np.nan, np.nan)
    found = [[None if truth is None else truth.target(name) for name in names] for _, truth in pairs]
    centers = np.array([[far if each is None else each.center for each in row] for row in found])
    first = np.nan_to_num(centers[0, 0])
    return Clip(
        images=_frozen(np.stack([frame.image for frame, _ in pairs])),
        times=np.array([frame.time for frame, _ in pairs]),
        centers=centers,
        visible=np.ones(len(pairs)),
        box=Box(float(first[0]), float(first[1]), LEAST_PX, LEAST_PX),
        text=text,
        bits=source.bits,
    )


@lru_cache(maxsize=256)
def _rendered(text: str) -> Clip:
    pairs = list(irsim.open_source(irsim.loads(text)).pairs(input="display"))
    truths = [None if truth is None else truth.target("target") for _, truth in pairs]
    start = truths[0]
    assert start is not None
    far = np.array([np.nan, np.nan])
    return Clip(
        images=_frozen(np.stack([frame.image for frame, _ in pairs])),
        times=np.array([frame.time for frame, _ in pairs]),
        centers=np.array([far if truth is None else truth.center for truth in truths]),
        visible=np.array([0.0 if truth is None else truth.visible for truth in truths], dtype=np.float64),
        box=start.box,
        text=text,
    )


SIGMAS = 4.0
"""Standard errors by which a mean must exceed the tolerance before the property is broken.

A tracker at the tolerance fails by chance with probability 1/193 for the 8 seeds of a ci check, and 1/2,700 for the 32
of a nightly one, by Student's t: 2 * scipy.stats.t.sf(4, 7) = .00519, 2 * scipy.stats.t.sf(4, 31) = .00037.
"""


class Broken(Exception):  # noqa: N818 - a finding, not an error of the program
    """Raised where the property does not hold; the text states the result and the tolerance."""


class NotAsked(Exception):  # noqa: N818 - an answer, not an error of the program
    """Raised where the property does not apply to this tracker; the text states the reason."""


@dataclass(frozen=True, eq=False)
class Walk(Estimates):
    """Estimates of a run over a clip, for the n frames after the first.

    Those of a tracker of many are `TrackFrame`s, of a detector `Detections`.
    """

    estimates: tuple[Any, ...]

    @property
    def centers(self) -> Floats:
        """Centres of all estimates, (n, 2) px; of many targets (all rows, 2)."""
        if self.estimates and not isinstance(self.estimates[0], Estimate):
            return np.concatenate([each.centers for each in self.estimates])
        return super().centers

    @property
    def tracking(self) -> np.ndarray:
        """True in each frame in which the status is `tracking`, (n,)."""
        return np.array([status == "tracking" for status in self.statuses])


def walk(tracker: Tracker, clip: Clip, seed: int = 0) -> Walk:
    """Run the tracker over a clip, with generators seeded by (seed, frame); raise Broken for an invalid estimate."""
    state = tracker.init(clip.frame(0), clip.box, stream(seed, "check", 0))
    estimates = []
    for k in range(1, len(clip)):
        state, estimate = tracker.step(state, clip.frame(k), stream(seed, "check", k))
        wrong = FAULTS[task_of(tracker)](estimate)
        if wrong is not None:
            raise Broken(f"frame {k}: {wrong}")
        estimates.append(estimate)
    return Walk(tuple(estimates))


class Case:
    """Example on which one property is tested: drawn values, clips, and runs of the tracker.

    seeds   number of seeds, of the tracker or of the scene, over which means are taken
    drawn   drawn values by name
    clips   drawn clips
    """

    def __init__(self, tracker: Tracker, draw: Callable[[Any], Any], seeds: int) -> None:
        self.tracker = tracker
        self.seeds = seeds
        self.drawn: dict[str, Any] = {}
        self.clips: list[Clip] = []
        self._draw = draw

    def draw(self, name: str, strategy: st.SearchStrategy[Any]) -> Any:
        self.drawn[name] = self._draw(strategy)
        return self.drawn[name]

    def clip(self, speed: tuple[int, int] = (2, 4), **changes: Any) -> Clip:
        """Draw a clip of a patch on a straight path before a uniform sky, with little noise.

        speed     lowest and highest severity of the target's speed
        changes   arguments of `strategies.documents`

        A tracker of many or a detector gets a clip of `points` in its place.
        """
        if task_of(self.tracker) != "single":
            return self.points()
        nothing: st.SearchStrategy[list[Any]] = st.just([])
        easy: dict[str, Any] = {
            "size": SIZE,
            "frames": FRAMES,
            "camera": {**CAMERA, "noise": [{"kind": "white"}]},
            "path": strategies.straights(SIZE, FRAMES, st.integers(*speed)),
            "shape": st.just(strategies.scenes.HOT_SPOT),
            "background": strategies.skies(st.just(0)),
            "noise": strategies.noises(st.integers(1, 3)),
            "decoy": False,
            **dict.fromkeys(("motion", "faults", "occlusion", "crossing"), nothing),
        }
        clip = rendered(self._draw(strategies.documents(**easy | changes)))
        self.clips.append(clip)
        return clip

    def points(self, starts: Sequence[tuple[float, float]] = APART, scr: float = SCR, **absent: Any) -> Clip:
        """Draw a clip of points that move side by side, `p0`, `p1`, ..., in a uniform sky of white noise.

        starts   (x, y) px of each point in frame 0;  scr  of the last point, each before it 5 higher
        absent   frames in which a point is absent, by its name: ((first, last), ...)
        """
        heading = 45.0 * self.draw("heading", st.integers(0, 7))
        targets = [
            {
                "id": f"p{k}",
                "shape": {"kind": "point", "scr": scr + 5.0 * (len(starts) - 1 - k)},
                "path": {"kind": "straight", "start": list(start), "speed": POINTS_SPEED, "heading_deg": heading},
                **({"absent": absent[f"p{k}"]} if f"p{k}" in absent else {}),
            }
            for k, start in enumerate(starts)
        ]
        camera = {"size": list(POINTS_SIZE), "netd_mk": 60, "range_k": [270.0, 330.0], "noise": [{"kind": "white"}]}
        sky = {"kind": "sky", "horizon_k": 285.0, "zenith_k": 285.0}
        seed = self.draw("seed", st.integers(0, self.seeds // 4 - 1))  # few scenes, so that most are in the cache
        document = {"seed": seed, "frames": POINTS_FRAMES, "camera": camera, "background": sky, "targets": targets}
        clip = rendered_points(document)
        self.clips.append(clip)
        return clip

    def walks(self, clip: Clip) -> list[Walk]:
        """Run the tracker over a clip with each seed, or with one where the seed has no effect."""
        first, second = (walk(self.tracker, clip, seed) for seed in (0, 1))
        if same(first, second):
            return [first]
        return [first, second, *(walk(self.tracker, clip, seed) for seed in range(2, self.seeds))]

    def centers(self, clip: Clip) -> Floats:
        """Return the estimated centres (seeds, n, 2), px."""
        return np.stack([each.centers for each in self.walks(clip)])


def numbers(estimate: Any) -> list[Any]:
    """Return the values of an estimate as plain Python values, which compare exactly."""
    fields = [getattr(estimate, name) for name in type(estimate).__slots__]
    if not isinstance(estimate, Estimate):  # scores of tracks may be nan
        return [(each.shape, each.tobytes()) if isinstance(each, np.ndarray) else each for each in fields]
    return [np.asarray(field).tolist() if isinstance(field, np.ndarray | tuple) else field for field in fields]


def same(one: Walk, other: Walk) -> bool:
    return list(map(numbers, one.estimates)) == list(map(numbers, other.estimates))


def expect_same(one: Walk, other: Walk, how: str) -> None:
    """Raise Broken where the estimates of two runs differ in any bit."""
    for k, pair in enumerate(zip(one.estimates, other.estimates, strict=True), 1):
        if numbers(pair[0]) != numbers(pair[1]):
            if not isinstance(pair[0], Estimate):
                raise Broken(f"{how}: frame {k} differs: {len(pair[0])} and {len(pair[1])} rows")
            raise Broken(f"{how}: frame {k} differs: {_at(pair[0].center)}, not {_at(pair[1].center)} px")


def expect_near(found: Floats, wanted: Floats, tolerance: float, how: str) -> None:
    """Raise Broken where centres (seeds, n, 2) are more than `tolerance` px from `wanted`, (seeds, n, 2) or (n, 2).

    Without random numbers the distance in each frame must be within the tolerance. Otherwise the mean distance over the
    frames, minus `SIGMAS` standard errors over the seeds, must be within it.
    """
    off = found[:, : wanted.shape[-2]] - wanted if len(found) == len(wanted) or wanted.ndim == 2 else None
    if off is None:
        off = found.mean(axis=0, keepdims=True) - wanted.mean(axis=0)
    if len(off) == 1:
        distance = np.hypot(*off[0].T)
        worst = int(distance.argmax())
        if distance[worst] > tolerance:
            raise Broken(f"{how}: off by {distance[worst]:.2f} px at frame {worst + 1}; allowed: {tolerance:g}")
        return
    means = off.mean(axis=1)
    error = means.std(axis=0, ddof=1) / np.sqrt(len(means))
    excess = np.abs(means.mean(axis=0)) - SIGMAS * error
    if excess.max() > tolerance:
        seen = ", ".join(f"{mean:.2f} ± {sd:.2f}" for mean, sd in zip(means.mean(axis=0), error, strict=True))
        raise Broken(f"{how}: off by ({seen}) px in the mean of {len(means)} seeds; allowed: {tolerance:g}")


def expect_above(values: Floats, least: float, name: str) -> None:
    """Raise Broken where the mean of independent values is below `least` by more than `SIGMAS` standard errors."""
    mean = float(np.mean(values))
    error = float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0
    if mean + SIGMAS * error < least:
        raise Broken(f"{name}: {mean:.3g} ± {error:.2g} over {len(values)}; allowed: {least:g} or more")


def _at(place: tuple[float, float]) -> str:
    return f"({place[0]:.9g}, {place[1]:.9g})"
