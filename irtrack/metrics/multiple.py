"""Figures of trackers of many targets: CLEAR MOT, identities, HOTA, GOSPA, OSPA, starts and false tracks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack.metrics.comparison import CUTOFF_PX, MATCH, ROUNDING, Comparison, Numbers, Pairs, assigned, best, rivalled
from irtrack.metrics.figures import Figure

HOTA_ALPHAS = np.arange(1, 20) / 20
"""Localisation thresholds of HOTA: 0.05 to 0.95 (Luiten et al., section 3.3)."""
ORDER = 2
"""Order p of GOSPA and OSPA. Their cutoff c is `CUTOFF_PX`, the widest threshold of the precision plots of single
targets (Wu, Lim, Yang, CVPR 2013)."""
NOBODY = -1


@dataclass(frozen=True)
class ManyFigures:
    """Figures of one comparison, computed on first access; nan where undefined.

    rate_hz: frames a second
    """

    comparison: Comparison
    rate_hz: float

    @cached_property
    def matches(self) -> Numbers:
        """Track (k, n) that CLEAR MOT matches with each target in each frame, or `NOBODY`.

        K. Bernardin, R. Stiefelhagen, "CLEAR MOT metrics", EURASIP J. Image Video Process. 2008, section 2.1: a pair of
        the previous frame is kept while it is similar enough; all others are matched for the largest similarity.
        """
        found = np.full((self.comparison.frames, len(self.comparison.names)), NOBODY)
        pairs = self._similar
        contested = rivalled(pairs)
        alone = pairs.take(~contested)
        found[alone.frame, alone.target] = alone.track
        before = dict(zip(self._judged[1:].tolist(), self._judged[:-1].tolist(), strict=True))
        left = np.flatnonzero(contested)
        frames, starts = np.unique(pairs.frame[left], return_index=True)
        for index, rows in zip(frames.tolist(), np.split(left, starts[1:]), strict=False):
            targets, tracks, values = pairs.target[rows], pairs.track[rows], pairs.similarity[rows]
            if index in before:
                values = values + 1000.0 * (found[before[index], targets] == tracks)
            taken = assigned(targets, tracks, values)
            found[index, targets[taken]] = tracks[taken]
        return found

    @cached_property
    def _similar(self) -> Pairs:
        pairs = self.comparison.pairs
        return pairs.take(pairs.similarity >= MATCH - ROUNDING)

    @cached_property
    def _judged(self) -> Numbers:
        """Frames with a target and a track; other frames do not break the continuity of CLEAR MOT."""
        each = self.comparison
        return np.intersect1d(each.targets.frame, each.tracks.frame)

    @cached_property
    def present(self) -> npt.NDArray[np.bool_]:
        """True in each frame in which a target is present and not ignored, (k, n)."""
        present = np.zeros((self.comparison.frames, len(self.comparison.names)), bool)
        present[self.comparison.targets.frame, self.comparison.targets.number] = True
        return present

    @property
    def misses(self) -> int:
        return len(self.comparison.targets.frame) - self._hits

    @property
    def false(self) -> int:
        """Positions of tracks without a target, summed over frames."""
        return len(self.comparison.tracks.frame) - self._hits

    @cached_property
    def _hits(self) -> int:
        return int((self.matches != NOBODY).sum())

    @cached_property
    def switches(self) -> int:
        """Number of times that the track of a target differs from its last track."""
        changes = 0
        for column in self.matches.T:
            own = column[column != NOBODY]
            changes += int((own[1:] != own[:-1]).sum())
        return changes

    @cached_property
    def fragments(self) -> int:
        """Number of times that a target is matched again after a miss; frames without targets or tracks are skipped."""
        seen = self.matches[self._judged] != NOBODY
        begun = seen.copy()
        begun[1:] &= ~seen[:-1]
        return int(np.maximum(begun.sum(axis=0) - 1, 0).sum())

    @property
    def mota(self) -> float:
        """1 - (misses + false + switches) / targets."""
        return 1 - _ratio(self.misses + self.false + self.switches, len(self.comparison.targets.frame))

    @property
    def recall(self) -> float:
        return _ratio(self._hits, len(self.comparison.targets.frame))

    @property
    def precision(self) -> float:
        return _ratio(self._hits, len(self.comparison.tracks.frame))

    @cached_property
    def idf1(self) -> float:
        """2 IDTP / (targets + tracks): each target has one track over all frames.

        E. Ristani, F. Solera, R. Zou, R. Cucchiara, C. Tomasi, "Performance measures and a data set for multi-target,
        multi-camera tracking", ECCV Workshops 2016, eqs. 5 to 10.
        """
        each = self.comparison
        together = self._summed(self._similar, np.ones(len(self._similar.frame)))
        rows, columns = np.nonzero(together)
        kept = assigned(rows, columns, together[rows, columns])
        return _ratio(2 * together[rows[kept], columns[kept]].sum(), len(each.targets.frame) + len(each.tracks.frame))

    def _summed(self, pairs: Pairs, values: Floats) -> Floats:
        """Return the sums (n, m) of values of pairs, by target and track."""
        shape = len(self.comparison.names), len(self.comparison.ids)
        sums = np.bincount(pairs.target * shape[1] + pairs.track, values, shape[0] * shape[1])
        return sums.astype(np.float64).reshape(shape)

    @cached_property
    def _hota(self) -> tuple[float, float, float]:
        """HOTA, DetA, AssA: J. Luiten et al., "HOTA", IJCV 129, 2021, eqs. 3 to 16."""
        each, pairs = self.comparison, self.comparison.pairs
        if not len(each.targets.frame) + len(each.tracks.frame):
            return np.nan, np.nan, np.nan
        targets = np.bincount(each.targets.number, minlength=len(each.names)).astype(np.float64)
        tracks = np.bincount(each.tracks.number, minlength=len(each.ids)).astype(np.float64)
        lives = targets[:, None] + tracks[None]
        # A pair's share in a frame: its similarity over the sum of similarities of its target and of its track.
        rivals = sum(_sums_by(pairs.frame, number, pairs.similarity) for number in (pairs.target, pairs.track))
        alike = self._summed(pairs, _shares(pairs.similarity, rivals - pairs.similarity))
        alignment = alike / np.maximum(lives - alike, ROUNDING)
        hits = best(pairs, alignment[pairs.target, pairs.track] * pairs.similarity)
        detection, association = np.zeros(len(HOTA_ALPHAS)), np.zeros(len(HOTA_ALPHAS))
        for k, alpha in enumerate(HOTA_ALPHAS):
            reached = hits.take(hits.similarity >= alpha - ROUNDING)
            counts = self._summed(reached, np.ones(len(reached.frame)))
            total = counts.sum()
            association[k] = (counts * counts / np.maximum(lives - counts, 1)).sum() / max(total, 1.0)
            detection[k] = total / (targets.sum() + tracks.sum() - total)
        means = (np.sqrt(detection * association), detection, association)
        return tuple(float(each.mean()) for each in means)  # type: ignore[return-value]  # the tuple has three elements

    @property
    def hota(self) -> float:
        return self._hota[0]

    @property
    def deta(self) -> float:
        """Detection accuracy of HOTA."""
        return self._hota[1]

    @property
    def assa(self) -> float:
        """Association accuracy of HOTA."""
        return self._hota[2]

    @cached_property
    def _near(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Sum of d^p over the matched pairs (k,), their number (k,), numbers of targets and of tracks (k,)."""
        each = self.comparison
        near = each.pairs.take(each.pairs.distance < CUTOFF_PX)
        near = best(near, CUTOFF_PX**ORDER - near.distance**ORDER)
        sums = np.bincount(near.frame, near.distance**ORDER, each.frames).astype(np.float64)
        counts = [
            np.bincount(rows.frame, minlength=each.frames).astype(np.float64)
            for rows in (near, each.targets, each.tracks)
        ]
        return sums, counts[0], counts[1], counts[2]

    @property
    def gospa_frames(self) -> Floats:
        """GOSPA distance (k,) px of each frame, with alpha = 2.

        A. Rahmathullah, A. Garcia-Fernandez, L. Svensson, "Generalized optimal sub-pattern assignment metric", FUSION
        2017, proposition 1.
        """
        near, pairs, targets, tracks = self._near
        return np.asarray((near + CUTOFF_PX**ORDER / 2 * (targets + tracks - 2 * pairs)) ** (1 / ORDER))

    @property
    def ospa_frames(self) -> Floats:
        """OSPA distance (k,) px of each frame; 0 between two empty sets.

        D. Schuhmacher, B.-T. Vo, B.-N. Vo, "A consistent metric for performance evaluation of multi-object filters",
        IEEE Trans. Signal Processing 56(8), 2008, eq. 3.
        """
        near, pairs, targets, tracks = self._near
        most = np.maximum(targets, tracks)
        return np.asarray(((near + CUTOFF_PX**ORDER * (most - pairs)) / np.maximum(most, 1)) ** (1 / ORDER))

    @property
    def gospa(self) -> float:
        return _mean(self.gospa_frames)

    @property
    def ospa(self) -> float:
        return _mean(self.ospa_frames)

    @cached_property
    def start_delay(self) -> float:
        """Mean number of frames from a target's first frame to its first match; to the end where it has none."""
        present, seen = self.present, self.matches != NOBODY
        some = present.any(axis=0)
        first = np.where(seen.any(axis=0), seen.argmax(axis=0), len(seen)) - present.argmax(axis=0)
        return _mean(first[some].astype(np.float64))

    @property
    def found(self) -> float:
        """Share of the targets that are matched in any frame."""
        some = self.present.any(axis=0)
        return _mean((self.matches != NOBODY).any(axis=0)[some].astype(np.float64))

    @property
    def kept(self) -> float:
        """Share of the targets with one identity: in half of their frames or more, never with another track."""
        seen, present = self.matches != NOBODY, self.present
        some = present.any(axis=0)
        if not present.size:
            return np.nan
        first = self.matches[seen.argmax(axis=0), np.arange(present.shape[1])]
        one = (~seen | (self.matches == first)).all(axis=0)
        return _mean((one & (seen.sum(axis=0) >= present.sum(axis=0) / 2))[some].astype(np.float64))

    @cached_property
    def false_tracks(self) -> int:
        """Confirmed tracks that have a target in less than half of their counted frames."""
        lives = np.bincount(self.comparison.tracks.number, minlength=len(self.comparison.ids))
        hits = np.bincount(self.matches[self.matches != NOBODY], minlength=len(lives))
        return int(((lives > 0) & (hits < lives / 2)).sum())

    @property
    def false_tracks_min(self) -> float:
        """False tracks a minute."""
        return _ratio(self.false_tracks * 60 * self.rate_hz, self.comparison.frames)


def _sums_by(frame: Numbers, number: Numbers, values: Floats) -> Floats:
    """Return for each pair the sum of the values of all pairs with the same frame and the same number, (p,)."""
    key = frame * (int(number.max(initial=0)) + 1) + number
    return np.asarray(np.bincount(key, values)[key]) if len(key) else values


def _shares(parts: Floats, wholes: Floats) -> Floats:
    return np.asarray(np.divide(parts, wholes, out=np.zeros_like(parts), where=wholes > 0))


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole else np.nan


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else np.nan


MANY_FIGURES: dict[str, Figure] = {
    "hota": Figure(lambda figures: figures.hota, "", "more", 1.0),
    "deta": Figure(lambda figures: figures.deta, "", "more", 1.0),
    "assa": Figure(lambda figures: figures.assa, "", "more", 1.0),
    "idf1": Figure(lambda figures: figures.idf1, "", "more", 1.0),
    "mota": Figure(lambda figures: figures.mota, "", "more", 1.0),
    "recall": Figure(lambda figures: figures.recall, "", "more", 1.0),
    "precision": Figure(lambda figures: figures.precision, "", "more", 1.0),
    "switches": Figure(lambda figures: figures.switches, "", "less"),
    "fragments": Figure(lambda figures: figures.fragments, "", "less"),
    "misses": Figure(lambda figures: figures.misses, "", "less"),
    "false": Figure(lambda figures: figures.false, "", "less"),
    "gospa": Figure(lambda figures: figures.gospa, "px", "less"),
    "ospa": Figure(lambda figures: figures.ospa, "px", "less", CUTOFF_PX),
    "found": Figure(lambda figures: figures.found, "", "more", 1.0),
    "kept": Figure(lambda figures: figures.kept, "", "more", 1.0),
    "start_delay": Figure(lambda figures: figures.start_delay, "frames", "less"),
    "false_tracks": Figure(lambda figures: figures.false_tracks, "", "less"),
    "false_tracks_min": Figure(lambda figures: figures.false_tracks_min, "1/min", "less"),
}
"""Figures of a tracker of many by name."""
