"""Figures of a detector: probability of detection against false alarms.

A detection is on a target where its centre is within the larger of 3 px (DNANet's rule for centroids) and half the
diagonal of the true box. Several detections on one target are one hit and no false alarm. Ignored targets, by the rule
of `irtrack.metrics.comparison`, and detections on them do not count. A target counts once in each frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from irsim.types import SHOWN, Floats, TargetTruth, Truth
from irtrack.metrics.comparison import Numbers
from irtrack.metrics.figures import Figure
from irtrack.metrics.masks import CENTROID_PX
from irtrack.tracks import DetectionSet

RATES = (0.01, 0.1, 1.0, 10.0)
"""False alarms a frame at which the probability of detection is reported."""

CONDITIONS = ("size", "scr", "visible", "nearest")
"""Larger side of the box, px; SCR; visible fraction; distance of the nearest other target in diagonals of the box."""


def radius(target: TargetTruth) -> float:
    """Return the distance from a target's centre within which a detection is on it, px."""
    return float(max(CENTROID_PX, np.hypot(target.box.w, target.box.h) / 2))


def is_to_be_found(target: TargetTruth) -> bool:
    """Return whether a target is in view, and not hidden."""
    return target.in_view is not False and not (target.visible is not None and target.visible < SHOWN)


@dataclass(frozen=True, eq=False)
class DetectionFigures:
    """Scores of targets and of false alarms over k frames.

    frames, rate_hz
    frame, number (t,)   frame (0 .. k-1) and number of the target, for each target in each frame
    score (t,)           largest score of a detection on it, -inf without one
    error (t,)           distance to the centre of the nearest detection on it, px; nan without one
    condition (t, 4)     columns `CONDITIONS` of the target in that frame, nan where unknown
    false_frame, false_score (f,)   frame and score of each false alarm
    names                ids of the targets
    """

    frames: int
    rate_hz: float
    frame: Numbers
    number: Numbers
    score: Floats
    error: Floats
    false_frame: Numbers
    false_score: Floats
    names: tuple[str, ...]
    condition: Floats

    @classmethod
    def of(cls, truths: Iterable[Truth], found: DetectionSet, rate_hz: float) -> DetectionFigures:
        """Return the scores of detections against the ground truth of the frames that the detector saw."""
        by_frame = {each.index: each for each in truths}
        ends = np.searchsorted(found.frame, found.frames, side="right")
        names: dict[str, int] = {}
        rows: list[tuple[float, ...]] = []
        false: list[tuple[Numbers, Floats]] = []
        begin = 0
        for place, (index, end) in enumerate(zip(found.frames.tolist(), ends.tolist(), strict=True)):
            centers = np.column_stack([found.cx[begin:end], found.cy[begin:end]])
            scores = found.score[begin:end]
            begin = end
            on_target = np.zeros(len(scores), bool)
            targets = by_frame[index].targets if index in by_frame else ()
            nearest = _nearest(np.array([each.center for each in targets]).reshape(-1, 2))
            for each, apart_from in zip(targets, nearest, strict=True):
                apart = np.hypot(centers[:, 0] - each.center[0], centers[:, 1] - each.center[1])
                on = apart <= radius(each)
                on_target |= on
                if is_to_be_found(each):
                    best = float(scores[on].max()) if on.any() else -np.inf
                    error = float(apart[on].min()) if on.any() else np.nan
                    known = (np.nan if value is None else value for value in (each.scr, each.visible))
                    condition = (max(each.box.w, each.box.h), *known, apart_from / each.box.diagonal)
                    rows.append((place, names.setdefault(each.id, len(names)), best, error, *condition))
            false.append((np.full(int((~on_target).sum()), place), scores[~on_target]))
        table = np.array(rows, dtype=np.float64).reshape(-1, 8)
        return cls(
            len(found.frames),
            rate_hz,
            table[:, 0].astype(np.int64),
            table[:, 1].astype(np.int64),
            table[:, 2],
            table[:, 3],
            np.concatenate([frame for frame, _ in false]) if false else np.zeros(0, np.int64),
            np.concatenate([scores for _, scores in false]) if false else np.zeros(0),
            tuple(names),
            table[:, 4:],
        )

    @property
    def pd(self) -> float:
        """Share of the targets that have a detection, at the detector's own threshold."""
        return _share(np.isfinite(self.score))

    @property
    def false_alarms(self) -> float:
        """False alarms a frame, at the detector's own threshold."""
        return len(self.false_score) / self.frames if self.frames else np.nan

    @property
    def false_alarms_s(self) -> float:
        """False alarms a second."""
        return self.false_alarms * self.rate_hz

    def pd_at(self, rate: float) -> float:
        """Return the share of targets found at a threshold that leaves `rate` false alarms a frame at most.

        Where the detector's own threshold leaves fewer false alarms, the share is that at its own threshold.
        """
        allowed = int(rate * self.frames + 1e-9)
        if allowed >= len(self.false_score):
            return self.pd
        threshold = np.sort(self.false_score)[::-1][allowed]  # score of the highest false alarm to exclude
        return _share(self.score > threshold)

    @cached_property
    def first_detection(self) -> float:
        """Mean number of frames from a target's first frame to its first detection; to the end where it has none."""
        delays = []
        for number in range(len(self.names)):
            own = self.number == number
            hits = self.frame[own & np.isfinite(self.score)]
            delays.append((hits.min() if len(hits) else self.frames) - self.frame[own].min())
        return float(np.mean(delays)) if delays else np.nan

    @property
    def rmse(self) -> float:
        """Root mean square distance, px, from detected targets to the nearest detection on each."""
        known = self.error[~np.isnan(self.error)]
        return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan


def _nearest(centers: Floats) -> list[float]:
    """Return the distance of the nearest other centre of (n, 2), inf for a single one."""
    apart = np.hypot(*np.moveaxis(centers[:, None] - centers[None], -1, 0))
    np.fill_diagonal(apart, np.inf)
    nearest: list[float] = apart.min(axis=1, initial=np.inf).tolist()
    return nearest


def roc(target_score: Floats, false_score: Floats, frames: int) -> tuple[Floats, Floats]:
    """Return false alarms a frame (p,), rising from 0, and the probability of detection at each (p,).

    The scores are those of `DetectionFigures`. The last point is at the detector's own threshold.
    """
    false, hits = np.sort(false_score)[::-1], np.sort(target_score[np.isfinite(target_score)])[::-1]
    above = np.searchsorted(-hits, -np.append(false, -np.inf), side="left")
    return np.arange(len(false) + 1) / max(frames, 1), above / max(len(target_score), 1)


def _share(flags: npt.NDArray[np.bool_]) -> float:
    return float(flags.mean()) if len(flags) else np.nan


DETECTION_FIGURES: dict[str, Figure] = {
    "pd": Figure(lambda figures: figures.pd, "", "more", 1.0),
    "false_alarms": Figure(lambda figures: figures.false_alarms, "1/frame", "less"),
    "false_alarms_s": Figure(lambda figures: figures.false_alarms_s, "1/s", "less"),
    "pd_001": Figure(lambda figures: figures.pd_at(RATES[0]), "", "more", 1.0),
    "pd_01": Figure(lambda figures: figures.pd_at(RATES[1]), "", "more", 1.0),
    "pd_1": Figure(lambda figures: figures.pd_at(RATES[2]), "", "more", 1.0),
    "pd_10": Figure(lambda figures: figures.pd_at(RATES[3]), "", "more", 1.0),
    "first_detection": Figure(lambda figures: figures.first_detection, "frames", "less"),
    "detection_rmse": Figure(lambda figures: figures.rmse, "px", "less"),
}
"""Figures of a detector by name; `pd_01`: at 0.1 false alarms a frame."""
