"""Planted trackers of many: each breaks one property and no other."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from planted_contract import TINY, Cache

from irsim.types import Frame
from irtrack.trackers.gnn import GNN
from irtrack.tracks import TrackFrame
from irtrack.types import Detections

Answer = tuple[Any, TrackFrame]


@dataclass(frozen=True, slots=True, eq=False)
class Remembering:
    """State of the shipped tracker, and the memory of a planted one."""

    inner: Any
    memory: Any


class Sound(GNN):
    """A shipped tracker, whose answer is that of `says`; `found`: the detections of the frame."""

    def init(self, frame: Frame, rng: np.random.Generator) -> Any:
        return Remembering(super().init(frame, rng), self.remembers(frame))

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> Answer:
        after, tracks = super().step(state.inner, frame, rng)
        found = self.detector_used.step(state.inner.memory, frame)[1]
        return Remembering(after, state.memory), self.says(state.memory, frame, found, tracks)

    def remembers(self, frame: Frame) -> Any:
        return None

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return tracks


def moved(tracks: TrackFrame, x: float) -> TrackFrame:
    return replace(tracks, centers=tracks.centers + np.array([x, 0.0]))


class Illegal(Sound):
    """NaN boxes in small pictures."""

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return moved(tracks, np.nan) if frame.image.size < 2400 else tracks


COUNTER = itertools.count()


class Random(Sound):
    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return moved(tracks, TINY * next(COUNTER))


class Hashes(Sound):
    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return moved(tracks, TINY * (hash("target") % 100_003))


class Peeks(Sound):
    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        whole = frame.image.base
        return tracks if whole is None or whole.ndim != 3 else moved(tracks, TINY * float(whole[-1, 0, 0]))


class Counts(Sound):
    def remembers(self, frame: Frame) -> Any:
        return [0]

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        memory[0] += 1
        return moved(tracks, TINY * memory[0])


class Forgets(Sound):
    def remembers(self, frame: Frame) -> Any:
        return Cache()

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return tracks if memory.warm else moved(tracks, TINY)


BEGUN = [0.0]


class Shares(Sound):
    def remembers(self, frame: Frame) -> Any:
        BEGUN[0] = float(frame.image[0, 0])

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return moved(tracks, TINY * BEGUN[0])


class Scribbles(Sound):
    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        if frame.image.flags.writeable:
            frame.image[0, 0] = 0
        return tracks


class Contiguous(Sound):
    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return tracks if frame.image.flags.c_contiguous or frame.image.base is None else moved(tracks, 1.0)


class Clock(Sound):
    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return moved(tracks, 1.0) if frame.time > 1000 else tracks


def is_given(found: Detections) -> bool:
    """Return whether detections are given, not of pictures: these have no covariances."""
    return found.covariances is None


class Swaps(Sound):
    """Gives new numbers in frame 18 of pictures."""

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return tracks if is_given(found) or frame.index < 18 else replace(tracks, ids=tracks.ids + 1000)


def is_after_death(frame: Frame, found: Detections) -> bool:
    """Return whether one of three targets is gone from the picture."""
    return not is_given(found) and frame.index >= 20 and len(found) == 2


class Reuses(Sound):
    """Two tracks exchange their numbers after a third target has gone."""

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        ids, sure = tracks.ids.copy(), np.flatnonzero(tracks.confirmed)[:2]
        if is_after_death(frame, found):
            ids[sure] = ids[sure[::-1]]
        return replace(tracks, ids=ids)


class Twins(Sound):
    """Two tracks of one number then."""

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return replace(tracks, ids=np.ones_like(tracks.ids)) if is_after_death(frame, found) else tracks


class Narrows(Sound):
    """Numbers of another type then."""

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return replace(tracks, ids=tracks.ids.astype(np.uint16)) if is_after_death(frame, found) else tracks


def is_sorted(found: Detections) -> bool:
    """Return whether the first three detections are those of the targets, as given before they are shuffled."""
    return bool((found.scores[:3] > 12).all()) and bool((np.diff(found.centers[:3, 0]) > 0).all())


class Ordered(Sound):
    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        return tracks if not is_given(found) or len(found) < 3 or is_sorted(found) else moved(tracks, 0.1)


class Renames(Sound):
    """New numbers in each frame whose detections come in another order."""

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        odd = is_given(found) and 3 <= len(found) < 100 and not is_sorted(found) and not is_doubled(found)
        return replace(tracks, ids=tracks.ids + 1000 * frame.index) if odd else tracks


def is_doubled(found: Detections) -> bool:
    return len(found) > 1 and bool((found.centers[0] == found.centers[1]).all())


class Doubles(Sound):
    """A track for each detection that comes twice."""

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        if not is_given(found) or not is_doubled(found):
            return tracks
        return TrackFrame(
            np.concatenate([tracks.ids, tracks.ids + 1000]),
            np.tile(tracks.centers, (2, 1)),
            np.tile(tracks.sizes, (2, 1)),
            np.tile(tracks.scores, 2),
            tracks.statuses * 2,
            np.tile(tracks.confirmed, 2),
        )


class Loyal(Sound):
    """A track stays for ever where there are no detections."""

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        stays = TrackFrame(
            np.array([7]),
            np.full((1, 2), 5.0),
            np.full((1, 2), 5.0),
            np.ones(1),
            ("occluded",),
            np.ones(1, bool),
        )
        return stays if is_given(found) and not len(found) else tracks


class Overwhelmed(Sound):
    """Fails in a crowd."""

    def says(self, memory: Any, frame: Frame, found: Detections, tracks: TrackFrame) -> TrackFrame:
        if len(found) > 1000:
            raise MemoryError("too many")
        return tracks


PLANTED: dict[str, type[Sound]] = {
    "legal": Illegal,
    "deterministic": Random,
    "elsewhere": Hashes,
    "causal": Peeks,
    "pure": Counts,
    "resumes": Forgets,
    "alone": Shares,
    "gentle": Scribbles,
    "layout": Contiguous,
    "timeless": Clock,
    "follows": Swaps,
    "ids": Reuses,
    "order": Ordered,
    "relabel": Renames,
    "duplicates": Doubles,
    "empty": Loyal,
    "crowd": Overwhelmed,
}
