"""A case: one tracker, what was drawn for it, and how it walks through clips."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import strategies as st

from irsim import strategies
from irsim.rng import stream
from irsim.types import Floats
from irtrack.properties.clip import CAMERA, FRAMES, SIZE, Clip, rendered
from irtrack.types import Estimate, Estimates, Tracker, fault

SIGMAS = 4.0
"""How many standard errors beyond what is allowed a mean has to be before it counts.

Of a tracker that is off by just what is allowed, chance takes a mean further, to either side, once in 193 with the
8 seeds of a ci check and once in 2,700 with the 32 of a nightly one; less is rarer. The errors come from those seeds
themselves, so this is Student's t: 2 * scipy.stats.t.sf(4, 7) = .00519, 2 * scipy.stats.t.sf(4, 31) = .00037.
"""


class Broken(Exception):  # noqa: N818 - a finding, not an error of the program
    """The property does not hold; the text says what was seen and what was allowed."""


class NotAsked(Exception):  # noqa: N818 - an answer, not an error of the program
    """The property says nothing of this tracker; the text says why."""


@dataclass(frozen=True, eq=False)
class Walk(Estimates):
    """What a tracker said of the n frames after the first."""

    estimates: tuple[Estimate, ...]

    @property
    def tracking(self) -> np.ndarray:
        """(n,) whether it says that it sees the target."""
        return np.array([status == "tracking" for status in self.statuses])


def walk(tracker: Tracker, clip: Clip, seed: int = 0) -> Walk:
    """The tracker over a clip; Broken for what is no legal estimate. The generator of frame k is that of (seed, k)."""
    state = tracker.init(clip.frame(0), clip.box, stream(seed, "check", 0))
    estimates = []
    for k in range(1, len(clip)):
        state, estimate = tracker.step(state, clip.frame(k), stream(seed, "check", k))
        wrong = fault(estimate)
        if wrong is not None:
            raise Broken(f"frame {k}: {wrong}")
        estimates.append(estimate)
    return Walk(tuple(estimates))


class Case:
    """One example of one property: draws, by name, and walks.

    seeds   how many seeds of the tracker, or of the scene, a mean is taken over
    drawn   name -> what was drawn
    clips   the clips that were drawn
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
        """A patch that moves straight before an even sky, with little noise; changes go to `strategies.documents`.

        speed: the least and the highest severity of its speed.
        """
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

    def walks(self, clip: Clip) -> list[Walk]:
        """With several seeds; one alone where the seed changes nothing."""
        first, second = (walk(self.tracker, clip, seed) for seed in (0, 1))
        if same(first, second):
            return [first]
        return [first, second, *(walk(self.tracker, clip, seed) for seed in range(2, self.seeds))]

    def centers(self, clip: Clip) -> Floats:
        """(seeds, n, 2) px."""
        return np.stack([each.centers for each in self.walks(clip)])


def numbers(estimate: Estimate) -> list[Any]:
    """An estimate as plain values, which compare exactly."""
    fields = (getattr(estimate, name) for name in Estimate.__slots__)
    return [np.asarray(field).tolist() if isinstance(field, np.ndarray | tuple) else field for field in fields]


def same(one: Walk, other: Walk) -> bool:
    return list(map(numbers, one.estimates)) == list(map(numbers, other.estimates))


def expect_same(one: Walk, other: Walk, how: str) -> None:
    """Broken where two walks differ in any bit."""
    for k, pair in enumerate(zip(one.estimates, other.estimates, strict=True), 1):
        if numbers(pair[0]) != numbers(pair[1]):
            raise Broken(f"{how}: frame {k} differs: {_at(pair[0].center)}, not {_at(pair[1].center)} px")


def expect_near(found: Floats, wanted: Floats, tolerance: float, how: str) -> None:
    """Broken where places (seeds, n, 2) are not what is wanted (the same, or (n, 2)).

    Of a tracker whose seed changes nothing each frame must lie within the tolerance. Of others the mean
    over frames must, less `SIGMAS` standard errors over the seeds, which see the same noise both times.
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


def expect_above(values: Floats, least: float, what: str) -> None:
    """Broken where the mean of independent values is surely below the least that is allowed."""
    mean = float(np.mean(values))
    error = float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0
    if mean + SIGMAS * error < least:
        raise Broken(f"{what}: {mean:.3g} ± {error:.2g} over {len(values)}; allowed: {least:g} or more")


def _at(place: tuple[float, float]) -> str:
    return f"({place[0]:.9g}, {place[1]:.9g})"
