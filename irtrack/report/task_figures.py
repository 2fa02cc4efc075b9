"""Figures of detectors over the runs of a source: ROC with a bootstrap band, time to first detection, conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irsim.rng import stream
from irsim.types import Floats
from irtrack.metrics import Survival, kaplan_meier
from irtrack.metrics.attributes import LOW_SCR, NEAR
from irtrack.metrics.ceiling import Ceiling
from irtrack.metrics.detection import CONDITIONS, roc

RATES = np.geomspace(1e-2, 1e2, 60)
"""False alarms a frame at which ROC curves are drawn."""
CONDITION_RATE = 1.0
"""False alarms a frame of the threshold at which targets of each condition are counted."""
DRAWS = 2000
SMALL_PX, LARGE_PX, HIGH_SCR = 3.0, 9.0, 10.0
"""Limits of small and large targets, px (DNANet and SIRST call targets below 9 x 9 px small), and of a high SCR."""

Arrays = Sequence[Mapping[str, np.ndarray]]
"""Arrays of the runs of one detector, as `irtrack.metrics.tasks.task_scores` gives them."""

RULES: dict[str, tuple[str, float, float]] = {
    f"size < {SMALL_PX:g} px": ("size", 0.0, SMALL_PX),
    f"{SMALL_PX:g} to {LARGE_PX:g} px": ("size", SMALL_PX, LARGE_PX),
    f"≥ {LARGE_PX:g} px": ("size", LARGE_PX, np.inf),
    f"SCR < {LOW_SCR:g}": ("scr", 0.0, LOW_SCR),
    f"{LOW_SCR:g} to {HIGH_SCR:g}": ("scr", LOW_SCR, HIGH_SCR),
    f"≥ {HIGH_SCR:g}": ("scr", HIGH_SCR, np.inf),
    "partly hidden": ("visible", 0.0, 1.0),
    "clutter": ("nearest", 0.0, NEAR),
}
"""Condition by name: the column of `irtrack.metrics.detection.CONDITIONS`, in size, and its bounds (low, high)."""


@dataclass(frozen=True, slots=True)
class ConditionRow:
    """Targets of one condition: their number over all runs and frames, and the share found with its interval.

    The threshold of each run leaves `CONDITION_RATE` false alarms a frame, or is the detector's own. `low`, `high` are
    None for a single run.
    """

    condition: str
    targets: int
    pd: float
    low: float | None
    high: float | None


def bootstrap(parts: Floats, wholes: Floats) -> tuple[Floats, Floats, Floats]:
    """Return sum(parts) / sum(wholes) over the runs, parts and wholes (runs, n), with its 95 % percentile interval, of
    whole runs drawn with replacement (Davison, Hinkley, "Bootstrap Methods", 1997, section 5.3)."""
    count = len(parts)
    drawn = stream(0, "bootstrap", count).multinomial(count, np.full(count, 1 / count), DRAWS).astype(np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        draws = (drawn @ parts) / (drawn @ wholes)
        mean = parts.sum(axis=0) / wholes.sum(axis=0)
    low, high = np.nanpercentile(draws, (2.5, 97.5), axis=0) if count > 1 else (mean, mean)
    return mean, np.asarray(low), np.asarray(high)


def roc_band(runs: Arrays) -> tuple[Floats, Floats, Floats] | None:
    """Return the probability of detection at `RATES`, mean over the runs and its interval; None without targets.

    For `matched_filter_ideal`, this is its ceiling.
    """
    curves = []
    for each in runs:
        if "d2" in each:
            if len(each["d2"]):
                curves.append(Ceiling(each["d2"], each["share"]).pd_at(RATES))
        elif len(each["target_score"]):
            rates, found = roc(each["target_score"], each["false_score"], len(each["frames"]))
            curves.append(found[np.maximum(np.searchsorted(rates, RATES, side="right") - 1, 0)])
    return bootstrap(np.array(curves), np.ones((len(curves), len(RATES)))) if curves else None


def first_detections(runs: Arrays) -> Survival | None:
    """Return the share of targets not yet detected against frames from their first one (Kaplan-Meier: a target that is
    never detected ends with its last frame); None where no run has these times."""
    waits: list[float] = []
    detected: list[bool] = []
    for each in runs:
        if "target_number" not in each:
            continue
        for number in np.unique(each["target_number"]).tolist():
            own = each["target_number"] == number
            frames, hits = each["target_frame"][own], np.isfinite(each["target_score"][own])
            detected.append(bool(hits.any()))
            waits.append(float((frames[hits].min() if hits.any() else frames.max()) - frames.min()))
    return kaplan_meier(waits, detected) if waits else None


def by_condition(runs: Arrays) -> tuple[ConditionRow, ...]:
    """Return a row for each of `RULES` that some target meets, over all runs of a detector."""
    known = [each for each in runs if "target_condition" in each]
    if not known:
        return ()
    hits = [each["target_score"] > _threshold(each) for each in known]
    rows = []
    for name, (column, low, high) in RULES.items():
        place = CONDITIONS.index(column)
        values = [np.abs(each["target_condition"][:, place]) for each in known]
        marked = [(each >= low) & (each < high) for each in values]
        total = np.array([[each.sum()] for each in marked], dtype=np.float64)
        if total.sum():
            found = np.array([[(hit & each).sum()] for hit, each in zip(hits, marked, strict=True)], dtype=np.float64)
            mean, least, most = (float(each[0]) for each in bootstrap(found, total))
            several = int((total > 0).sum()) > 1
            rows.append(
                ConditionRow(name, int(total.sum()), mean, least if several else None, most if several else None)
            )
    return tuple(rows)


def _threshold(arrays: Mapping[str, np.ndarray]) -> float:
    """Return the score above which a detection counts, so that `CONDITION_RATE` false alarms a frame are left."""
    allowed = int(CONDITION_RATE * len(arrays["frames"]) + 1e-9)
    false = np.sort(arrays["false_score"])[::-1]
    return float(false[allowed]) if allowed < len(false) else -np.inf
