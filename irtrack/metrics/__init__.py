"""Figures from tracks: arrays in, values out; no file is opened here."""

from irtrack.metrics.attributes import ATTRIBUTES, Attribute
from irtrack.metrics.breaking import Breaking, breaking_point
from irtrack.metrics.by_attribute import AttributeRow, by_attribute
from irtrack.metrics.centre import (
    PRECISION_NORM,
    PRECISION_PX,
    area,
    centre_errors,
    mean_abs,
    normalised_errors,
    precision_curve,
    rmse,
)
from irtrack.metrics.consistency import nees, nees_interval
from irtrack.metrics.honesty import false_lost, false_tracking, hidden_tracking, lost_late
from irtrack.metrics.interval import mean_interval, share, wilson
from irtrack.metrics.long_term import LongTerm, long_term
from irtrack.metrics.loss import LOSS_RULE, loss, off_frames
from irtrack.metrics.multi import Clear, Gospa, Hota, Scene, clear_mot, gospa, hota, idf1
from irtrack.metrics.overlap import SUCCESS, overlaps, success_curve, success_rate, widened
from irtrack.metrics.paired import LEAST_SCENES, Difference, paired_difference, scenes_for
from irtrack.metrics.reacquire import Return, returns
from irtrack.metrics.reference import Reference
from irtrack.metrics.scoring import FIGURES, CentreFigures, Score, score, score_trace
from irtrack.metrics.survival import Survival, kaplan_meier
from irtrack.metrics.trace import Trace
from irtrack.metrics.vot import AnchorRun, Vot, expected_overlap, vot

__all__ = [
    "ATTRIBUTES",
    "FIGURES",
    "LEAST_SCENES",
    "LOSS_RULE",
    "PRECISION_NORM",
    "PRECISION_PX",
    "SUCCESS",
    "AnchorRun",
    "Attribute",
    "AttributeRow",
    "Breaking",
    "CentreFigures",
    "Clear",
    "Difference",
    "Gospa",
    "Hota",
    "LongTerm",
    "Reference",
    "Return",
    "Scene",
    "Score",
    "Survival",
    "Trace",
    "Vot",
    "area",
    "breaking_point",
    "by_attribute",
    "centre_errors",
    "clear_mot",
    "expected_overlap",
    "false_lost",
    "false_tracking",
    "gospa",
    "hidden_tracking",
    "hota",
    "idf1",
    "kaplan_meier",
    "long_term",
    "loss",
    "lost_late",
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
