"""Metrics of tracks against ground truth, functions from arrays to values."""

from irtrack.metrics.attributes import ATTRIBUTES, Attribute, AttributeRow, by_attribute
from irtrack.metrics.centre_error import (
    PRECISION_NORM,
    PRECISION_PX,
    area,
    centre_errors,
    mean_abs,
    normalised_errors,
    precision_curve,
    rmse,
)
from irtrack.metrics.comparison import Comparison
from irtrack.metrics.detection import DETECTION_FIGURES, DetectionFigures
from irtrack.metrics.longterm import LongTerm, long_term
from irtrack.metrics.lost import LOSS_RULE, loss, off_frames
from irtrack.metrics.masks import MaskSums, mask_sums
from irtrack.metrics.multiple import MANY_FIGURES, ManyFigures
from irtrack.metrics.overlap import SUCCESS, overlaps, success_curve, success_rate, widened
from irtrack.metrics.score import FIGURES, CentreFigures, Score, score, score_trace
from irtrack.metrics.statistics import (
    LEAST_SCENES,
    Breaking,
    Difference,
    breaking_point,
    mean_interval,
    paired_difference,
    scenes_for,
    share,
    wilson,
)
from irtrack.metrics.status import (
    Return,
    false_lost,
    false_tracking,
    hidden_tracking,
    lost_late,
    nees,
    nees_interval,
    returns,
)
from irtrack.metrics.survival import Survival, kaplan_meier
from irtrack.metrics.trace import Reference, Trace
from irtrack.metrics.vot import AnchorRun, Vot, expected_overlap, vot

__all__ = [
    "ATTRIBUTES",
    "DETECTION_FIGURES",
    "FIGURES",
    "LEAST_SCENES",
    "LOSS_RULE",
    "MANY_FIGURES",
    "PRECISION_NORM",
    "PRECISION_PX",
    "SUCCESS",
    "AnchorRun",
    "Attribute",
    "AttributeRow",
    "Breaking",
    "CentreFigures",
    "Comparison",
    "DetectionFigures",
    "Difference",
    "LongTerm",
    "ManyFigures",
    "MaskSums",
    "Reference",
    "Return",
    "Score",
    "Survival",
    "Trace",
    "Vot",
    "area",
    "breaking_point",
    "by_attribute",
    "centre_errors",
    "expected_overlap",
    "false_lost",
    "false_tracking",
    "hidden_tracking",
    "kaplan_meier",
    "long_term",
    "loss",
    "lost_late",
    "mask_sums",
    "mean_abs",
    "mean_interval",
    "nees",
    "nees_interval",
    "normalised_errors",
    "off_frames",
    "overlaps",
    "paired_difference",
    "precision_curve",
    "returns",
    "rmse",
    "scenes_for",
    "score",
    "score_trace",
    "share",
    "success_curve",
    "success_rate",
    "vot",
    "widened",
    "wilson",
]
