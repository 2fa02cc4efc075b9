"""Filters of point measurements: bearings, ranges, places, with glint, missed and false plots."""

from irtrack.points.gaussian import GaussianFilter
from irtrack.points.particles import PointPF
from irtrack.points.sensor import Observer, PointSensor
from irtrack.points.table import FILTERS, PointRuns, compare, filter_of
from irtrack.points.world import PointEstimates, World

__all__ = [
    "FILTERS",
    "GaussianFilter",
    "Observer",
    "PointEstimates",
    "PointPF",
    "PointRuns",
    "PointSensor",
    "World",
    "compare",
    "filter_of",
]
