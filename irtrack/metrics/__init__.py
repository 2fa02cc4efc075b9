"""Figures from tracks: arrays in, values out; no file is opened here."""

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
from irtrack.metrics.interval import wilson
from irtrack.metrics.loss import LOSS_RULE, loss, off_frames
from irtrack.metrics.overlap import SUCCESS, overlaps, success_curve, widened
from irtrack.metrics.reference import Reference
from irtrack.metrics.scoring import FIGURES, CentreFigures, Score, score

__all__ = [
    "FIGURES",
    "LOSS_RULE",
    "PRECISION_NORM",
    "PRECISION_PX",
    "SUCCESS",
    "CentreFigures",
    "Reference",
    "Score",
    "area",
    "centre_errors",
    "loss",
    "mean_abs",
    "normalised_errors",
    "off_frames",
    "overlaps",
    "precision_curve",
    "rmse",
    "score",
    "success_curve",
    "widened",
    "wilson",
]
