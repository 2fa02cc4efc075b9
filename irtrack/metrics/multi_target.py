"""Multi-target metrics: CLEAR MOT, IDF1, HOTA, GOSPA."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from irsim.types import Box, Floats
from irtrack.types import LEAST_PX

MATCH = 0.5
"""Least similarity (overlap) of a match in CLEAR MOT and IDF1 (MOTChallenge)."""

HOTA_ALPHAS = np.arange(1, 20) / 20
"""Localisation thresholds of HOTA: 0.05 to 0.95 (Luiten et al., section 3.3)."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One frame: identities of its n targets and of the m tracks that report a position in it, and their similarity.

    similarity   (n, m) 0..1, of each target and each track
    """

    targets: tuple[str, ...]
    tracks: tuple[str, ...]
    similarity: Floats

    @classmethod
    def of(cls, targets: dict[str, Box], tracks: dict[str, Box]) -> Scene:
        """Return the frame of true and tracked boxes by identity; similarity: overlap, sides at least `LEAST_PX`."""
        rows = [[a.at_least(LEAST_PX).iou(b.at_least(LEAST_PX)) for b in tracks.values()] for a in targets.values()]
        return cls(tuple(targets), tuple(tracks), np.array(rows, dtype=np.float64).reshape(len(targets), len(tracks)))


@dataclass(frozen=True, slots=True)
class Clear:
    """Counts over a sequence: matched pairs, missed targets, false tracks, identity switches."""

    matches: int
    misses: int
    false: int
    switches: int

    @property
    def mota(self) -> float:
        """1 - (misses + false + switches) / targets; nan where there is no target."""
        targets = self.matches + self.misses
        return 1 - (self.misses + self.false + self.switches) / targets if targets else np.nan


def clear_mot(scenes: Sequence[Scene], least: float = MATCH) -> Clear:
    """Return the counts of CLEAR MOT.

    Bernardin and Stiefelhagen, "CLEAR MOT metrics", EURASIP J. Image Video Process. 2008, section 2.1. A pair matched
    in the previous frame stays matched while its similarity is at least `least`; the other targets and tracks are
    matched for the largest number of matches, then for the largest similarity. A target matched to another track than
    at its last match counts as an identity switch.
    """
    last: dict[str, str] = {}
    before: dict[str, str] = {}
    matches = misses = false = switches = 0
    for scene in scenes:
        kept = {
            (i, scene.tracks.index(before[target]))
            for i, target in enumerate(scene.targets)
            if before.get(target) in scene.tracks
        }
        kept = {pair for pair in kept if scene.similarity[pair] >= least}
        free = np.where(scene.similarity >= least, 1 + scene.similarity / (1 + scene.similarity.size), 0.0)
        for i, j in kept:
            free[i, :], free[:, j] = 0.0, 0.0
        pairs = kept | set(_matched(free))
        before = {scene.targets[i]: scene.tracks[j] for i, j in pairs}
        switches += sum(last.get(target, track) != track for target, track in before.items())
        last |= before
        matches += len(pairs)
        misses += len(scene.targets) - len(pairs)
        false += len(scene.tracks) - len(pairs)
    return Clear(matches, misses, false, switches)


def idf1(scenes: Sequence[Scene], least: float = MATCH) -> float:
    """Return IDF1 = 2 IDTP / (targets + tracks), 0..1, over all frames; nan without boxes.

    Ristani, Solera, Zou, Cucchiara, Tomasi, "Performance measures and a data set for multi-target,
    multi-camera tracking", ECCV Workshops 2016, eqs. 5 to 10: each target is assigned one track for all frames.
    """
    targets, tracks = _identities(scenes)
    together = np.zeros((len(targets), len(tracks)))
    total = 0
    for scene in scenes:
        total += len(scene.targets) + len(scene.tracks)
        together[_places(scene, targets, tracks)] += scene.similarity >= least
    kept = sum(together[pair] for pair in _matched(together))
    return 2 * float(kept) / total if total else np.nan


@dataclass(frozen=True, slots=True)
class Hota:
    """HOTA, detection and association accuracy, each the mean over the thresholds; nan without boxes."""

    hota: float
    detection: float
    association: float


def hota(scenes: Sequence[Scene]) -> Hota:
    """Return HOTA: Luiten, Osep, Dendorfer, Torr, Geiger, Leal-Taixe, Leibe, "HOTA", IJCV 129 (2021), eqs. 3 to 16."""
    targets, tracks = _identities(scenes)
    shape = (len(targets), len(tracks))
    alike, seen, reported = np.zeros(shape), np.zeros(len(targets)), np.zeros(len(tracks))
    for scene in scenes:
        place = _places(scene, targets, tracks)
        # Each pair gets a share of the frame: its similarity over the sum of those of its target and its track.
        rivals = scene.similarity.sum(axis=0, keepdims=True) + scene.similarity.sum(axis=1, keepdims=True)
        rivals = rivals - scene.similarity
        alike[place] += np.divide(scene.similarity, rivals, out=np.zeros_like(rivals), where=rivals > 0)
        seen[place[0].ravel()] += 1
        reported[place[1].ravel()] += 1
    if not seen.sum() + reported.sum():
        return Hota(np.nan, np.nan, np.nan)
    either = seen[:, None] + reported[None, :] - alike
    alignment = np.divide(alike, either, out=np.zeros(shape), where=either > 0)
    counts = np.zeros((len(HOTA_ALPHAS), *shape))
    for scene in scenes:
        place = _places(scene, targets, tracks)
        for i, j in _matched(alignment[place] * scene.similarity):
            reached = scene.similarity[i, j] >= HOTA_ALPHAS - np.finfo(np.float64).eps
            counts[reached, targets[scene.targets[i]], tracks[scene.tracks[j]]] += 1
    hits = counts.sum(axis=(1, 2))
    union = np.maximum(seen[:, None] + reported[None, :] - counts, 1)
    association = (counts * counts / union).sum(axis=(1, 2)) / np.maximum(hits, 1)
    detection = hits / (seen.sum() + reported.sum() - hits)
    return Hota(float(np.sqrt(detection * association).mean()), float(detection.mean()), float(association.mean()))


@dataclass(frozen=True, slots=True)
class Gospa:
    """GOSPA distance, px, and the terms of its p-th power: localisation, missed and false targets."""

    distance: float
    localisation: float
    missed: float
    false: float


def gospa(targets: Floats, estimates: Floats, c: float, p: float = 2.0) -> Gospa:
    """Return the GOSPA distance of estimates (m, 2) px of one frame from its targets (n, 2) px, with alpha = 2.

    Rahmathullah, Garcia-Fernandez, Svensson, "Generalized optimal sub-pattern assignment metric",
    FUSION 2017, definition 1 and proposition 1. `c`: distance from which on a target and an estimate count as a miss
    and a false target, px; `p`: order.
    """
    offsets = np.reshape(targets, (-1, 1, 2)) - np.reshape(estimates, (1, -1, 2))
    costs = np.minimum(np.hypot(offsets[..., 0], offsets[..., 1]), c) ** p
    near = [costs[pair] for pair in _matched(c**p - costs)]
    half = c**p / 2
    parts = float(sum(near)), half * (len(costs) - len(near)), half * (costs.shape[1] - len(near))
    return Gospa(sum(parts) ** (1 / p), *parts)


def _matched(values: Floats) -> Iterator[tuple[int, int]]:
    """Return the pairs (row, column) whose values above 0 have the largest sum."""
    from scipy.optimize import linear_sum_assignment  # 0.3 s to import

    rows, columns = linear_sum_assignment(values, maximize=True)
    return ((i, j) for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if values[i, j] > 0)


def _identities(scenes: Sequence[Scene]) -> tuple[dict[str, int], dict[str, int]]:
    """Return a number for each target and each track, by identity."""
    targets = {name: None for scene in scenes for name in scene.targets}
    tracks = {name: None for scene in scenes for name in scene.tracks}
    return {name: i for i, name in enumerate(targets)}, {name: i for i, name in enumerate(tracks)}


def _places(
    scene: Scene, targets: dict[str, int], tracks: dict[str, int]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the numbers of the targets (n, 1) and of the tracks (1, m) of a frame, as matrix indices."""
    rows = np.array([targets[name] for name in scene.targets], dtype=np.int64)
    columns = np.array([tracks[name] for name in scene.tracks], dtype=np.int64)
    return rows[:, None], columns[None, :]
