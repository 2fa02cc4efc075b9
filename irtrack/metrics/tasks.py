"""Tasks of a run, and the figures of each task.

single   one target from a given box;  many   all targets, without a box, from frame 0;  detect   detections alone
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from irsim.types import Floats, Truth
from irtrack.metrics.comparison import Comparison
from irtrack.metrics.detection import DETECTION_FIGURES, DetectionFigures
from irtrack.metrics.figures import Figure
from irtrack.metrics.multiple import MANY_FIGURES, NOBODY, ManyFigures
from irtrack.metrics.score import FIGURES
from irtrack.tracks import DetectionSet, TrackSet

Task = Literal["single", "many", "detect"]

_TIMES = {
    "ms_median": Figure(None, "ms", "less"),
    "cpu_ms_median": Figure(None, "ms", "less"),
}

FIGURES_OF: Mapping[Task, Mapping[str, Figure]] = {
    "single": FIGURES,
    "many": {**MANY_FIGURES, **_TIMES},
    "detect": {**DETECTION_FIGURES, **_TIMES},
}
"""Figures of each task by name."""

ALL_FIGURES: Mapping[str, Figure] = {name: each for task in FIGURES_OF.values() for name, each in task.items()}
"""Figures of all tasks; a name shared by tasks has one meaning."""

RANKED_BY: Mapping[Task, tuple[str, ...]] = {
    "single": ("lost", "off_share", "error_held"),
    "many": ("gospa", "switches", "hota"),
    "detect": ("pd_1", "pd_01", "false_alarms"),
}
"""Figures by which trackers of a task are ranked, the most important first."""


def task_scores(
    found: TrackSet | DetectionSet, truths: Sequence[Truth], rate_hz: float
) -> tuple[dict[str, float | None], dict[str, np.ndarray]]:
    """Return the figures of tracks of many targets, matched by distance of centres (`Comparison`), or of detections.

    The second value holds arrays for charts: matches (k, n), the id of each target's track, present (k, n) and names
    (n,) of the targets; or target_score, false_score, target_frame,
    target_number and target_condition: `score`, ... of `DetectionFigures`.
    """
    if isinstance(found, TrackSet):
        many = ManyFigures(Comparison.of(truths, found), rate_hz)
        ids = np.append(many.comparison.ids, NOBODY)
        arrays = {
            "matches": ids[many.matches],
            "present": many.present,
            "names": np.array(many.comparison.names, dtype=np.str_),
        }
        return _scores(many, MANY_FIGURES, found.step_ms, found.cpu_ms), arrays
    figures = DetectionFigures.of(truths, found, rate_hz)
    arrays = {
        "target_score": figures.score,
        "false_score": figures.false_score,
        "target_frame": figures.frame,
        "target_number": figures.number,
        "target_condition": figures.condition,
    }
    return _scores(figures, DETECTION_FIGURES, found.step_ms, found.cpu_ms), arrays


def _scores(
    figures: object, described: Mapping[str, Figure], step_ms: Floats, cpu_ms: Floats
) -> dict[str, float | None]:
    values = {name: _known(each.of, figures) for name, each in described.items()}
    for name, times in (("ms_median", step_ms), ("cpu_ms_median", cpu_ms)):
        values[name] = float(np.median(times[1:])) if len(times) > 1 else None
    return values


def _known(of: Callable[[Any], Any] | None, figures: object) -> float | None:
    value = np.nan if of is None else float(of(figures))
    return value if np.isfinite(value) else None
