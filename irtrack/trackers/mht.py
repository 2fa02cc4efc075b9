"""`mht`: multiple hypothesis tracking, which decides on doubtful detections some frames later.

A global hypothesis assigns every detection so far to a target or to false alarms. For each of its targets it has one
leaf of a tree: a track with a filter of its own. The k best assignments of a frame's detections to a hypothesis' leaves
give the next hypotheses (I. Cox, S. Hingorani, "An efficient implementation of Reid's multiple hypothesis tracking
algorithm", IEEE TPAMI 18(2), 1996), which share their leaves. N frames back, all leaves must agree with the best
hypothesis; the others are pruned (N-scan: T. Kurien, in "Multitarget-Multisensor Tracking", ed. Y. Bar-Shalom, 1990,
chapter 3).

The score of a leaf is the log-likelihood ratio of "a target gave these detections" to "all are false" (S. Blackman, R.
Popoli, "Design and Analysis of Modern Tracking Systems", 1999, section 6.2). A hypothesis is as likely as the product
of 1 + exp(score) over its leaves: each is a target or not.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import log, log1p
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.types import Floats
from irtrack.filters.data_association import k_best
from irtrack.filters.multiple_model import update
from irtrack.trackers.ego_motion import View
from irtrack.trackers.multi_target import MultiTargetTracker, TrackTable, updated_table
from irtrack.types import Detections

Rows = npt.NDArray[np.int64]

MISSED, UNBORN = -1, -2
"""Entries of a leaf's history: a frame without detection; a frame before its first detection."""
MARGIN = 12.0
"""Hypotheses less likely than the best by a factor of exp(12), 160,000, are dropped."""
CANDIDATE_DROP = 5.0
"""A candidate whose score is this far below that of a new one is deleted: three successive misses at P_D = 0.9."""


@dataclass(frozen=True, slots=True, eq=False)
class Leaves:
    """n leaves: their tracks, whose id is that of the tree; scores (n,); and histories (n, N+1), the detection of each
    in the last N+1 frames, the newest last."""

    tracks: TrackTable
    score: Floats
    history: Rows

    def take(self, rows: np.ndarray) -> Leaves:
        """Return the leaves selected by a mask or by indices."""
        return Leaves(self.tracks.take(rows), self.score[rows], self.history[rows])


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """Global hypothesis: rows of its leaves, and its log probability up to a constant."""

    rows: Rows
    weight: float


@dataclass(frozen=True, slots=True, eq=False)
class HypothesisState:
    """State: leaves; hypotheses, the best first; tracks of the best hypothesis; other fields as in `ManyState`."""

    leaves: Leaves
    hypotheses: tuple[Hypothesis, ...]
    tracks: TrackTable
    next_id: int
    clutter_score: float
    memory: Any
    size: tuple[int, int]
    view: View | None = None

    def moved(self, homography: Floats) -> HypothesisState:
        """Return the state after the camera moved the whole scene by a homography (3, 3) of pixels."""
        leaves = replace(self.leaves, tracks=self.leaves.tracks.moved(homography))
        return replace(self, leaves=leaves, tracks=self.tracks.moved(homography))


class MHT(MultiTargetTracker):
    """Multiple hypotheses with N-scan pruning: doubtful detections are decided `scans` frames later.

    Trees of tracks under global hypotheses, by the k best assignments (Reid 1979; Cox, Hingorani 1996; Blackman,
    Popoli 1999, section 16.3). A step returns the tracks of the best hypothesis so far. Tracks are confirmed by their
    score, not by `confirm_hits` of `confirm_frames`.
    """

    source: ClassVar[str] = "Reid 1979; Cox, Hingorani 1996"

    most_detections: Annotated[int, Field(ge=1, le=10_000)] = 60
    """Largest number of detections used in a frame; those of the highest scores are used."""
    scans: Annotated[int, Field(ge=1, le=20)] = 3
    """Number of frames after which a decision is final: N of N-scan."""
    hypotheses: Annotated[int, Field(ge=1, le=1000)] = 20
    """Largest number of global hypotheses."""
    new_target: Annotated[float, Field(gt=0, lt=1)] = 0.02
    """Density of new targets over that of false detections."""
    confirm_score: Annotated[float, Field(gt=0, le=100)] = 9.2
    """Least score of a confirmed track; 9.2: odds of 10,000 to 1."""

    def begin(self, found: Detections, size: tuple[int, int], memory: Any = None) -> HypothesisState:
        """Return the state after the first detections: each starts a tree."""
        leaves = self._new_leaves(found, np.arange(len(found)), 0)
        everything = Hypothesis(np.arange(len(found)), 0.0)
        score = float(found.scores.mean()) if len(found) else 0.0
        return HypothesisState(leaves, (everything,), leaves.tracks, len(found), score, memory, size)

    def advance(self, state: HypothesisState, found: Detections) -> HypothesisState:
        """Return the state after the detections of the next frame: grow the trees, rank hypotheses, prune."""
        before = state.leaves.tracks
        tracks = replace(before, states=self.bank.predict(before.states), age=before.age + 1)
        leaves = replace(state.leaves, tracks=tracks)
        missed_ratio = log(1 - self.detection_probability)
        seen = leaves.score[:, None] + self.log_ratios(tracks, found, state.clutter_score) + missed_ratio
        missed = leaves.score + missed_ratio
        grown = self._ranked(state.hypotheses, leaves.score, seen, missed)
        leaves, hypotheses = self._next_leaves(leaves, found, grown, seen, missed, state.next_id)
        leaves, hypotheses = _pruned(leaves, hypotheses, self._lives(leaves, state.size))
        agreeing = _agrees(leaves, hypotheses[0])
        leaves, hypotheses = _pruned(leaves, [each for each in hypotheses if agreeing[each.rows].all()], agreeing)
        best = leaves.take(hypotheses[0].rows)
        free = best.history[best.history[:, -2] == UNBORN, -1] if self.scans else np.zeros(0, np.int64)
        clutter_score = state.clutter_score
        if len(free):
            mean = float(found.scores[free].mean())
            clutter_score = mean if clutter_score == 0 else 0.9 * clutter_score + 0.1 * mean
        return HypothesisState(
            *(leaves, hypotheses, best.tracks, state.next_id + len(found), clutter_score),
            *(state.memory, state.size, state.view),
        )

    def _ranked(
        self, hypotheses: Sequence[Hypothesis], score: Floats, seen: Floats, missed: Floats
    ) -> list[tuple[float, Rows, Rows]]:
        """Return the best next hypotheses: log probability, rows of leaves, and the detection of each (or MISSED).

        seen (n, m), missed (n,): scores of the leaves after a detection, and after a miss.
        """
        count = seen.shape[1]
        fresh = log1p(self.new_target)  # a detection that starts a tree
        gain = np.logaddexp(0, seen) - np.logaddexp(0, missed)[:, None] - fresh
        gain[~np.isfinite(seen)] = -np.inf
        change = np.logaddexp(0, missed) - np.logaddexp(0, score)
        choices = _ClusterChoices(gain, self.hypotheses)
        found: list[tuple[float, Rows, Rows]] = []
        bases = [each.weight + float(change[each.rows].sum()) + count * fresh for each in hypotheses]
        least = -np.inf  # least log probability of a next hypothesis
        for base, hypothesis in sorted(zip(bases, hypotheses, strict=True), key=lambda each: -each[0]):
            for value, taken in choices.best(hypothesis.rows, base, least):
                found.append((value, hypothesis.rows, taken))
            found.sort(key=lambda each: -each[0])
            del found[self.hypotheses :]
            if found:
                least = max(found[0][0] - MARGIN, found[-1][0] if len(found) == self.hypotheses else -np.inf)
        return [each for each in found if each[0] > found[0][0] - MARGIN]

    def _next_leaves(
        self,
        leaves: Leaves,
        found: Detections,
        grown: Sequence[tuple[float, Rows, Rows]],
        seen: Floats,
        missed: Floats,
        next_id: int,
    ) -> tuple[Leaves, tuple[Hypothesis, ...]]:
        """Return the leaves that the hypotheses need, each once, and the hypotheses on them."""
        count = len(found)
        keys = [rows * (count + 1) + taken + 1 for _, rows, taken in grown]
        unique, inverse = np.unique(np.concatenate(keys), return_inverse=True)
        parents, taken = unique // (count + 1), unique % (count + 1) - 1
        hit = taken != MISSED
        tracks = leaves.tracks.take(parents)
        after = update(tracks.states.take(hit), found.centers[taken[hit]], self.noise)
        states = replace(
            tracks.states, **{n: getattr(tracks.states, n).copy() for n in ("mean", "covariance", "probability")}
        )
        states.mean[hit], states.covariance[hit], states.probability[hit] = (
            after.mean,
            after.covariance,
            after.probability,
        )
        level, size = tracks.level.copy(), tracks.size.copy()
        level[hit], size[hit] = found.scores[taken[hit]], found.sizes[taken[hit]]
        score = missed[parents]
        score[hit] = seen[parents[hit], taken[hit]]
        history = np.concatenate([leaves.history[parents, 1:], taken[:, None]], axis=1)
        born = self._new_leaves(found, np.arange(count), next_id)
        tracks = updated_table(tracks, states, hit, level, size)
        tracks = replace(tracks, confirmed=tracks.confirmed | (score >= self.confirm_score))
        whole = Leaves(
            tracks.joined(born.tracks), np.concatenate([score, born.score]), np.concatenate([history, born.history])
        )
        hypotheses, place = [], 0
        for weight, rows, columns in grown:
            own = inverse[place : place + len(rows)]
            place += len(rows)
            free = np.setdiff1d(np.arange(count), columns)
            hypotheses.append(Hypothesis(np.concatenate([own, len(unique) + free]), weight))
        return whole, tuple(hypotheses)

    def _new_leaves(self, found: Detections, free: Rows, next_id: int) -> Leaves:
        history = np.full((len(free), self.scans + 1), UNBORN)
        history[:, -1] = free
        return Leaves(self._started(found, free, next_id), np.full(len(free), log(self.new_target)), history)

    def _lives(self, leaves: Leaves, size: tuple[int, int]) -> npt.NDArray[np.bool_]:
        """Return which leaves stay: confirmed ones by the rules of all trackers, candidates by their score."""
        candidate = ~leaves.tracks.confirmed
        kept = self._in_reach(leaves.tracks, size)
        return np.asarray(kept & ~(candidate & (leaves.score < log(self.new_target) - CANDIDATE_DROP)))


class _ClusterChoices:
    """The best assignments of the detections of a frame to the leaves of hypotheses, cluster by cluster.

    Leaves that share no detection, directly or through other leaves, are assigned independently of each other. A
    cluster is ranked once for all hypotheses that contain it.

    gain (n, m): gain of a leaf's log probability by a detection, -inf outside its gate;  k  number of assignments
    """

    def __init__(self, gain: Floats, k: int) -> None:
        self._gain, self._k = gain, k
        self._gated = [np.flatnonzero(row).tolist() for row in np.isfinite(gain)]
        self._ranked: dict[tuple[int, ...], list[tuple[float, tuple[int, ...]]]] = {}

    def best(self, rows: Rows, base: float, least: float) -> Iterator[tuple[float, Rows]]:
        """Yield the best assignments to leaves whose log probability, base + gain, is above `least`: this value, and
        the detection of each leaf or MISSED."""
        places = {row: place for place, row in enumerate(rows.tolist())}
        parts = [(cluster, self._of(cluster)) for cluster in self._clusters(places)]
        first = np.full(len(rows), MISSED)
        for cluster, ranked in parts:
            base += ranked[0][0]
            first[[places[row] for row in cluster]] = ranked[0][1]
        # The k best assignments differ from the best one only by choices among the k - 1 least losses of all clusters.
        losses = [
            (ranked[0][0] - gain, number, taken)
            for number, (_, ranked) in enumerate(parts)
            for gain, taken in ranked[1:]
            if base - ranked[0][0] + gain > least
        ]
        options: dict[int, list[tuple[float, tuple[int, ...]]]] = {}
        for loss, number, taken in sorted(losses)[: self._k - 1]:
            options.setdefault(number, []).append((loss, taken))
        sums: list[tuple[float, dict[int, tuple[int, ...]]]] = [(0.0, {})]
        for number, others in options.items():
            more = [(total + loss, {**own, number: taken}) for total, own in sums for loss, taken in others]
            sums = sorted(sums + [each for each in more if base - each[0] > least], key=lambda each: each[0])[: self._k]
        for loss, changed in sums:
            if base - loss > least:
                columns = first.copy()
                for number, taken in changed.items():
                    columns[[places[row] for row in parts[number][0]]] = taken
                yield base - loss, columns

    def _clusters(self, rows: Iterable[int]) -> list[tuple[int, ...]]:
        """Return the groups of leaves with a detection in their gates that share detections."""
        group_of: dict[int, list[int]] = {}  # by detection
        for row in rows:
            group = [row]
            for other in {id(each): each for each in map(group_of.get, self._gated[row]) if each}.values():
                group += other
            for leaf in group:
                group_of.update(dict.fromkeys(self._gated[leaf], group))
        return [tuple(sorted(each)) for each in {id(each): each for each in group_of.values()}.values()]

    def _of(self, cluster: tuple[int, ...]) -> list[tuple[float, tuple[int, ...]]]:
        """Return the best assignments within a cluster: gain, and the detection of each leaf or MISSED."""
        if cluster not in self._ranked:
            if len(cluster) == 1:
                row = self._gain[cluster[0]]
                ranked = [(float(row[column]), (column,)) for column in self._gated[cluster[0]]]
                ranked = sorted([*ranked, (0.0, (MISSED,))], key=lambda each: -each[0])[: self._k]
            else:
                columns = sorted({column for row in cluster for column in self._gated[row]})
                cost = np.full((len(cluster), len(columns) + len(cluster)), np.inf)
                cost[:, : len(columns)] = -self._gain[np.ix_(cluster, columns)]
                np.fill_diagonal(cost[:, len(columns) :], 0.0)
                choices = [*columns, *[MISSED] * len(cluster)]
                worst = next(k_best(cost, 1)).cost + MARGIN
                ranked = [
                    (-each.cost, tuple(choices[column] for column in each.columns.tolist()))
                    for each in k_best(cost, self._k, worst)
                ]
            self._ranked[cluster] = [each for each in ranked if each[0] > ranked[0][0] - MARGIN]
        return self._ranked[cluster]


def _agrees(leaves: Leaves, best: Hypothesis) -> npt.NDArray[np.bool_]:
    """Return which leaves agree with the best hypothesis about the detections of the oldest frame kept (N-scan).

    A leaf whose tree is in the best hypothesis must have the same detection; a leaf of another tree must have none that
    the best hypothesis assigns to a target.
    """
    decided = leaves.history[:, 0]
    chosen = dict(zip(leaves.tracks.id[best.rows].tolist(), decided[best.rows].tolist(), strict=True))
    owner = {detection: tree for tree, detection in chosen.items() if detection >= 0}
    return np.array(
        [
            detection == chosen[tree] if tree in chosen else detection not in owner
            for tree, detection in zip(leaves.tracks.id.tolist(), decided.tolist(), strict=True)
        ],
        dtype=bool,
    )


def _pruned(
    leaves: Leaves, hypotheses: Sequence[Hypothesis], kept: npt.NDArray[np.bool_]
) -> tuple[Leaves, tuple[Hypothesis, ...]]:
    """Return the kept leaves that a hypothesis uses, and the hypotheses without the other leaves.

    Hypotheses that become equal are joined, with the sum of their probabilities. Weights are relative to the best.
    """
    joint: dict[bytes, tuple[Rows, float]] = {}
    for each in hypotheses:
        rows = np.sort(each.rows[kept[each.rows]])
        same = joint.get(rows.tobytes())
        joint[rows.tobytes()] = (rows, each.weight if same is None else float(np.logaddexp(same[1], each.weight)))
    used = np.zeros(len(kept), bool)
    for rows, _ in joint.values():
        used[rows] = True
    place = np.cumsum(used) - 1
    best = max(weight for _, weight in joint.values())
    ranked = sorted(joint.values(), key=lambda each: -each[1])
    return leaves.take(used), tuple(Hypothesis(place[rows], weight - best) for rows, weight in ranked)
