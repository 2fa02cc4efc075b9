"""Targets and tracks of many frames side by side, and their best matching frame by frame.

Rule of matching, named in every result: `distance`, the similarity 1 - d / (2 r) at a centre error of d px, where r is
the larger of 5 px and the diagonal of the true box, so that 0.5 is the bound of `irtrack.metrics.lost`; or `iou`, the
intersection over union of boxes, with sides of at least 5 px.

Rule of ignored targets: a target that is absent, out of the picture or less than half visible is ignored. A track on an
ignored target is neither right nor wrong in that frame: the pair is removed before all counts.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from irsim.types import SHOWN, Floats, Truth
from irtrack.tracks import TrackSet
from irtrack.types import LEAST_PX

Matching = Literal["distance", "iou"]
Numbers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

MATCH = 0.5
"""Least similarity of a match in CLEAR MOT and IDF1 (MOTChallenge)."""
CUTOFF_PX = 20.0
"""Distance of centres, px, beyond which pairs without a similarity above 0 are not listed."""
ROUNDING = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, slots=True, eq=False)
class Presence:
    """Rows of targets or tracks: frame (r,) and number (r,), both from 0 on; box (r, 4): cx, cy, w, h px."""

    frame: Numbers
    number: Numbers
    box: Floats

    def take(self, rows: np.ndarray) -> Presence:
        """Return the rows selected by a mask or by indices."""
        return Presence(self.frame[rows], self.number[rows], self.box[rows])


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Pairs of a target and a track in a frame: their numbers, similarity 0..1 and distance of centres px, (p,)."""

    frame: Numbers
    target: Numbers
    track: Numbers
    similarity: Floats
    distance: Floats

    def take(self, rows: np.ndarray) -> Pairs:
        """Return the pairs selected by a mask or by indices."""
        return Pairs(*(getattr(self, name)[rows] for name in Pairs.__slots__))


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Targets that are not ignored, confirmed tracks, and near pairs of target and track, over k frames.

    names, ids   of the targets and tracks, by number
    """

    frames: int
    targets: Presence
    tracks: Presence
    pairs: Pairs
    names: tuple[str, ...]
    ids: Numbers

    @classmethod
    def of(cls, truths: Iterable[Truth], tracks: TrackSet, matching: Matching = "distance") -> Comparison:
        """Return the comparison of confirmed tracks with the ground truth of the frames that the tracker saw."""
        place = {index: row for row, index in enumerate(tracks.frames.tolist())}
        names: dict[str, int] = {}
        rows: list[tuple[float, ...]] = []
        for truth in truths:
            row = place.get(truth.index)
            if row is not None:
                for each in truth.targets:
                    ignored = each.in_view is False or (each.visible is not None and each.visible < SHOWN)
                    box = each.box
                    number = names.setdefault(each.id, len(names))
                    rows.append((row, number, each.center[0], each.center[1], box.w, box.h, ignored))
        table = np.array(rows, dtype=np.float64).reshape(-1, 7)
        targets = Presence(table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2:6])
        ids, numbers = np.unique(tracks.id[tracks.confirmed], return_inverse=True)
        boxes = np.column_stack([each[tracks.confirmed] for each in (tracks.cx, tracks.cy, tracks.w, tracks.h)])
        frame = np.searchsorted(tracks.frames, tracks.frame[tracks.confirmed])
        found = Presence(frame.astype(np.int64), numbers.astype(np.int64), boxes)
        return _without_ignored(len(place), targets, table[:, 6] > 0, found, matching, tuple(names), ids)


def _without_ignored(
    frames: int,
    targets: Presence,
    ignored: Flags,
    tracks: Presence,
    matching: Matching,
    names: tuple[str, ...],
    ids: Numbers,
) -> Comparison:
    pairs = near_pairs(frames, targets, tracks, matching)
    if ignored.any():
        marked = _marks(frames, targets.take(ignored), len(names))
        hits = best(pairs.take(pairs.similarity >= MATCH - ROUNDING))
        dropped = _marks(frames, hits_on(hits, marked), len(ids))
        targets, tracks = targets.take(~ignored), tracks.take(~dropped[tracks.frame, tracks.number])
        pairs = pairs.take(~marked[pairs.frame, pairs.target] & ~dropped[pairs.frame, pairs.track])
    return Comparison(frames, targets, tracks, pairs, names, ids)


def _marks(frames: int, rows: Presence, count: int) -> Flags:
    marks = np.zeros((frames, count), bool)
    marks[rows.frame, rows.number] = True
    return marks


def hits_on(hits: Pairs, marked: Flags) -> Presence:
    """Return the tracks of pairs whose targets are marked (k, n)."""
    some = hits.take(marked[hits.frame, hits.target])
    return Presence(some.frame, some.track, np.zeros((len(some.frame), 4)))


def near_pairs(frames: int, targets: Presence, tracks: Presence, matching: Matching) -> Pairs:
    """Return all pairs in the same frame with a similarity above 0 or a distance within `CUTOFF_PX`."""
    target_rows, track_rows = _by_frame(frames, targets.frame), _by_frame(frames, tracks.frame)
    a, b = targets.box[target_rows][:, :, None], tracks.box[track_rows][:, None]
    reach = CUTOFF_PX
    if len(targets.box) and len(tracks.box):
        sizes = np.maximum(targets.box[:, 2:].max(), LEAST_PX), np.maximum(tracks.box[:, 2:].max(), LEAST_PX)
        reach = max(reach, 3.0 * sizes[0] if matching == "distance" else sum(sizes))
    near = (np.abs(a[..., 0] - b[..., 0]) < reach) & (np.abs(a[..., 1] - b[..., 1]) < reach)
    near &= (target_rows >= 0)[:, :, None] & (track_rows >= 0)[:, None]
    frame, i, j = np.nonzero(near)
    one, other = target_rows[frame, i], track_rows[frame, j]
    distance, similarity = similarities(targets.box[one], tracks.box[other], matching)
    kept = (similarity > 0) | (distance < CUTOFF_PX)
    pairs = Pairs(frame, targets.number[one], tracks.number[other], similarity, distance)
    return pairs.take(kept)


def _by_frame(frames: int, frame: Numbers) -> Numbers:
    """Return the row numbers of each frame (k, n), padded with -1; n: the largest number of rows in a frame."""
    order = np.argsort(frame, kind="stable")
    counts = np.bincount(frame, minlength=frames)
    column = np.arange(len(frame)) - np.repeat(np.cumsum(counts) - counts, counts)
    rows = np.full((frames, int(counts.max(initial=0))), -1)
    rows[frame[order], column] = order
    return rows


def similarities(a: Floats, b: Floats, matching: Matching) -> tuple[Floats, Floats]:
    """Return distances of centres, px, and similarities (p,) of target boxes and track boxes (p, 4) cx, cy, w, h."""
    distance = np.hypot(a[:, 0] - b[:, 0], a[:, 1] - b[:, 1])
    if matching == "distance":
        radius = np.maximum(np.hypot(a[:, 2], a[:, 3]), LEAST_PX)
        return distance, np.maximum(1 - distance / (2 * radius), 0.0)
    shared = np.ones(len(a))
    wide = np.maximum(a[:, 2:], LEAST_PX), np.maximum(b[:, 2:], LEAST_PX)
    for axis in (0, 1):
        low = np.maximum(a[:, axis] - wide[0][:, axis] / 2, b[:, axis] - wide[1][:, axis] / 2)
        high = np.minimum(a[:, axis] + wide[0][:, axis] / 2, b[:, axis] + wide[1][:, axis] / 2)
        shared *= np.maximum(high - low, 0.0)
    return distance, shared / (wide[0].prod(axis=1) + wide[1].prod(axis=1) - shared)


def best(pairs: Pairs, values: Floats | None = None) -> Pairs:
    """Return the pairs that make the sum of positive values (default: similarities) largest in each frame.

    Each target and each track is in at most one pair of a frame. Pairs without a rival are taken as they are, the
    others by scipy's assignment.
    """
    values = pairs.similarity if values is None else values
    contested = rivalled(pairs)
    chosen = [np.flatnonzero(~contested & (values > 0))]
    rest = np.flatnonzero(contested & (values > 0))
    frames, starts = np.unique(pairs.frame[rest], return_index=True)  # pairs are in order of frames
    for rows in np.split(rest, starts[1:]) if len(frames) else []:
        chosen.append(rows[assigned(pairs.target[rows], pairs.track[rows], values[rows])])
    return pairs.take(np.sort(np.concatenate(chosen)))


def rivalled(pairs: Pairs) -> Flags:
    """Return whether the target or the track of a pair is in another pair of its frame, (p,)."""
    rivalled = np.zeros(len(pairs.frame), bool)
    for number in (pairs.target, pairs.track):
        key = pairs.frame * (int(number.max(initial=0)) + 1) + number
        rivalled |= np.bincount(key)[key] > 1 if len(key) else rivalled
    return rivalled


def assigned(rows: Numbers, columns: Numbers, values: Floats) -> Numbers:
    """Return the indices of the pairs (row, column) with the largest sum of positive values; each row and column
    once."""
    from scipy.optimize import linear_sum_assignment  # 0.3 s to import

    _, i = np.unique(rows, return_inverse=True)
    _, j = np.unique(columns, return_inverse=True)
    place = np.full((int(i.max(initial=-1)) + 1, int(j.max(initial=-1)) + 1), -1)
    table = np.zeros(place.shape)
    place[i, j], table[i, j] = np.arange(len(rows)), values
    found = place[linear_sum_assignment(table, maximize=True)]
    return np.asarray(found[(found >= 0) & (values[found] > 0)])
