"""A small honest tracker, and planted ones: each breaks one property and no other.

All are importable, so that another process finds them. `Sound` is a centroid of what stands out in a window.
"""

from __future__ import annotations

import itertools
import os
import time
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from irsim.types import Box, Floats, Frame
from irtrack.types import Estimate

Answer = tuple["State", Estimate]
TINY = 1e-9
"""px: far below any tolerance, yet another number."""


@dataclass(frozen=True)
class State:
    """What `Sound` remembers; `memory` is for the planted ones."""

    x: float
    y: float
    w: float
    h: float
    contrast: float
    velocity: tuple[float, float] = (0.0, 0.0)
    steps: int = 0
    unseen: int = 0
    time: float = 0.0
    memory: Any = None


class Sound:
    """Follows the centroid of what is more than half as bright, or as dark, as the target was at the start."""

    resumable: ClassVar[bool] = True
    reach = 8

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        window, _, _ = cut(frame.image, box.cx, box.cy, box.w / 2 + self.reach, box.h / 2 + self.reach)
        middle, _, _ = cut(frame.image, box.cx, box.cy, box.w / 4, box.h / 4)
        contrast = float(np.median(middle) - np.median(window)) if middle.size else 0.0
        return State(box.cx, box.cy, box.w, box.h, contrast, time=frame.time)

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        window, left, top = cut(frame.image, state.x, state.y, state.w / 2 + self.reach, state.h / 2 + self.reach)
        sign = 1.0 if state.contrast > 0 else -1.0
        out = sign * (window - np.median(window)) > abs(state.contrast) / 2 if window.size else np.zeros((0, 0), bool)
        share = float(out.sum() / (state.w * state.h))
        if state.contrast == 0 or share < 0.25:
            unseen = state.unseen + 1
            after = replace(state, steps=state.steps + 1, unseen=unseen, time=frame.time)
            status: Any = "lost" if unseen > 10 else "occluded"
            return after, self.says(after, frame, Estimate((state.x, state.y), (state.w, state.h), status, score=share))
        rows, columns = np.nonzero(out)
        x, y = left + float(columns.mean()), top + float(rows.mean())
        velocity = tuple(
            0.7 * v + 0.3 * (new - old)
            for v, new, old in zip(
                state.velocity if state.steps else (x - state.x, y - state.y), (x, y), (state.x, state.y), strict=True
            )
        )
        after = replace(
            state, x=x, y=y, velocity=(velocity[0], velocity[1]), steps=state.steps + 1, unseen=0, time=frame.time
        )
        estimate = Estimate((x, y), (state.w, state.h), "tracking", share, after.velocity, 0.25 * np.eye(2))
        return after, self.says(after, frame, estimate)

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        """What it says in the end: where the planted ones differ."""
        return estimate


def cut(image: np.ndarray, cx: float, cy: float, half_w: float, half_h: float) -> tuple[Floats, int, int]:
    """(the window about a place, its first column, its first row)."""
    left, top = max(round(cx - half_w), 0), max(round(cy - half_h), 0)
    right, bottom = max(round(cx + half_w) + 1, 0), max(round(cy + half_h) + 1, 0)
    return image[top:bottom, left:right].astype(np.float64), left, top


def moved(estimate: Estimate, x: float, y: float = 0.0) -> Estimate:
    return replace(estimate, center=(estimate.center[0] + x, estimate.center[1] + y))


def lagging(estimate: Estimate, px: float) -> Estimate:
    """Behind the target: the same in a mirrored or moved picture."""
    vx, vy = estimate.velocity or (0.0, 0.0)
    speed = float(np.hypot(vx, vy))
    return moved(estimate, -px * vx / speed, -px * vy / speed) if speed > 0.2 else estimate


class Constant:
    """The start box for ever."""

    resumable: ClassVar[bool] = True

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Box:
        return box

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        return state, Estimate((state.cx, state.cy), (state.w, state.h))


class Raises(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, 1 / 0)


class Hangs(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        time.sleep(600.0 if frame.index == 4 else 0.0)
        return estimate


class Dies(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        if frame.index == 4:
            os._exit(3)
        return estimate


class Illegal(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return (
            moved(estimate, float("nan"))
            if frame.image.min() == frame.image.max() and frame.image.size < 2400
            else estimate
        )


COUNTER = itertools.count()


class Random(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, TINY * next(COUNTER))


class Hashes(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, TINY * (hash("target") % 100_003))


class Peeks(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        whole = frame.image.base
        return estimate if whole is None or whole.ndim != 3 else moved(estimate, TINY * float(whole[-1, 0, 0]))


class Rewrites(Sound):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        return replace(super().init(frame, box, rng), memory=np.zeros((2, 2)))

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        state.memory[:] = estimate.center
        return replace(estimate, particles=state.memory)


class Counts(Sound):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        return replace(super().init(frame, box, rng), memory=[0])

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        state.memory[0] += 1
        return moved(estimate, TINY * state.memory[0])


class Cache:
    """Does not survive being pickled."""

    warm = True

    def __reduce__(self) -> tuple[Any, ...]:
        return Cold, ()


class Cold(Cache):
    warm = False


class Forgets(Sound):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        return replace(super().init(frame, box, rng), memory=Cache())

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if state.memory.warm else moved(estimate, TINY)


class Shares(Sound):
    begun = 0.0

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        self.begun = box.cx
        return super().init(frame, box, rng)

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, TINY * self.begun)


class Scribbles(Sound):
    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        answer = super().step(state, frame, rng)
        if frame.image.flags.writeable:
            frame.image[0, 0] = 0
        return answer


class Contiguous(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if frame.image.flags.c_contiguous else moved(estimate, 1.0)


class Clock(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, 1.0) if frame.time > 1000 else estimate


class Hoards(Sound):
    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        after, estimate = super().step(state, frame, rng)
        return replace(after, memory=[*(state.memory or []), frame.image.tobytes()]), estimate


class Rooted(Sound):
    """Pulled to the frame's middle in x and in y alike: mirrored and transposed it stays so, shifted it does not."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        rows, columns = frame.image.shape
        return moved(estimate, *(0.07 * np.subtract(((columns - 1) / 2, (rows - 1) / 2), estimate.center)))


class Leans(Sound):
    """To the lower right, by as much in x as in y."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, 1.0, 1.0)


class Wide(Sound):
    """Thinks that pictures are wider than high."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        rows, columns = frame.image.shape
        return estimate if columns >= rows else lagging(estimate, 1.8)


class Absolute(Sound):
    """Goes by a level of grey that the background of its first scenes has."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        low = np.median(frame.image) / 2 ** (frame.bits - 8)
        return lagging(estimate, 1.8) if 55 < low < 150 else estimate


class Stretched(Sound):
    """Goes by a contrast of so many greys."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        contrast = abs(state.contrast) / 2 ** (frame.bits - 8)
        return lagging(estimate, 1.8) if contrast < 90 else estimate


class Hot(Sound):
    """Likes hot targets."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if state.contrast > 0 else lagging(estimate, 1.8)


class Shallow(Sound):
    """Takes all pictures for 8 bits."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return lagging(estimate, 1.8) if frame.bits > 8 else estimate


class Distracted(Sound):
    """Looks into the corners."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        off = np.abs(frame.image.astype(np.float64) - np.median(frame.image)) > abs(state.contrast) / 2
        rows, columns = off.shape
        corners = [off[y : y + 20, x : x + 24] for y in (0, rows - 20) for x in (0, columns - 24)]
        return lagging(estimate, 1.8) if max(corner.sum() for corner in corners) > 40 else estimate


class Lags(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        honest = None if estimate.covariance is None else 4.0 * estimate.covariance
        return replace(lagging(estimate, 2.8), covariance=honest)


class Creeps(Sound):
    """Where nothing moves it goes for a walk."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        still = float(np.hypot(*state.velocity)) < 0.15
        return moved(estimate, 0.12 * state.steps) if still else estimate


class Swells(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        grown = 1.03**state.steps
        return replace(estimate, size=(estimate.size[0] * grown, estimate.size[1] * grown))


class Faithful(Sound):
    """Holds for ever three times what its start box was off."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        state = super().init(frame, box, rng)
        _, seen = Sound().step(state, frame, rng)
        off = np.subtract((box.cx, box.cy), seen.center)
        return replace(state, memory=tuple(3 * off))

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, *state.memory)


class Tailored(Sound):
    """Wants a box that fits: it goes by the share of it that stands out."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        state = super().init(frame, box, rng)
        _, seen = Sound().step(state, frame, rng)
        return replace(state, memory=seen.score is not None and 0.6 < seen.score < 1.0)

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if state.memory else lagging(estimate, 7.0)


class Stutters(Sound):
    """A frame that comes again throws it off for good."""

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        again = bool(state.memory) or (state.steps > 0 and frame.time == state.time)
        after, estimate = super().step(replace(state, memory=again), frame, rng)
        return after, lagging(estimate, 7.0) if again else estimate


class Impatient(Sound):
    """A gap throws it off for good."""

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        gap = bool(state.memory) or 1.5 / 30 < frame.time - state.time < 1.0
        after, estimate = super().step(replace(state, memory=gap), frame, rng)
        return after, lagging(estimate, 7.0) if gap else estimate


class Resentful(Sound):
    """Once it was hidden it is off for good, as far as it would be anyway after a long hiding."""

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        after, estimate = super().step(state, frame, rng)
        off = bool(state.memory) or after.unseen > 0
        return replace(after, memory=off), lagging(estimate, 7.0) if off else estimate


class Backwards(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        vx, vy = state.velocity
        return estimate if estimate.velocity is None else replace(estimate, velocity=(-vx, -vy))


class Timid(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return replace(estimate, status="occluded") if estimate.status == "tracking" else estimate


class Proud(Sound):
    """Says that it sees what was hidden for a while; of what is gone for good, or of nothing at all, it does not."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        even = frame.image.min() == frame.image.max()
        return replace(estimate, status="tracking") if 0 < state.unseen < 14 and not even else estimate


class Stubborn(Sound):
    """Takes heart after a while."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return replace(estimate, status="tracking") if state.unseen > 15 and frame.image.std() > 0 else estimate


class Ghosts(Sound):
    """Sees what it looks for in a picture of nothing."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return replace(estimate, status="tracking") if frame.image.std() == 0 else estimate


class Inverted(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return replace(estimate, score=-float(estimate.score or 0.0))


class Certain(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if estimate.covariance is None else replace(estimate, covariance=np.zeros((2, 2)))


class LovesNoise(Sound):
    """Better in noise, of which it knows by the share of the contrast."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        spread = np.subtract(*np.percentile(frame.image.astype(np.float64), [75, 25]))
        return lagging(estimate, 1.5) if spread < 0.06 * abs(state.contrast) else estimate


class LovesHiding(Sound):
    """Better for having been hidden."""

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        after, estimate = super().step(state, frame, rng)
        wiser = bool(state.memory) or after.unseen > 6
        return replace(after, memory=wiser), estimate if wiser else lagging(estimate, 1.5)


PLANTED: dict[str, type[Any]] = {
    "legal": Illegal,
    "deterministic": Random,
    "final": Rewrites,
    "elsewhere": Hashes,
    "causal": Peeks,
    "pure": Counts,
    "resumes": Forgets,
    "alone": Shares,
    "gentle": Scribbles,
    "layout": Contiguous,
    "timeless": Clock,
    "bounded": Hoards,
    "shift": Rooted,
    "flip": Leans,
    "transpose": Wide,
    "offset": Absolute,
    "gain": Stretched,
    "polarity": Hot,
    "depth": Shallow,
    "distractor": Distracted,
    "follows": Lags,
    "rests": Creeps,
    "size": Swells,
    "start_place": Faithful,
    "start_size": Tailored,
    "duplicates": Stutters,
    "drops": Impatient,
    "reacquires": Resentful,
    "velocity": Backwards,
    "says_seen": Timid,
    "says_hidden": Proud,
    "says_gone": Stubborn,
    "says_empty": Ghosts,
    "score": Inverted,
    "nees": Certain,
    "noise": LovesNoise,
    "hiding": LovesHiding,
}
