"""The values that pass between rooms: Band, Box, Frame, TargetTruth, Truth, and the Source protocol.

Conventions, everywhere in irsim and irtrack
    x points right, y down; the centre of the top-left pixel is (0, 0), so pixel i covers
    [i - 1/2, i + 1/2]. Lengths are in px, times in seconds, velocities in px per frame.
    A target is a centre (cx, cy) and a full size (w, h). Images are indexed [row, column].
    None means: not known (imported truth knows little more than boxes).
"""

from irsim.types.source import CameraFacts, Display, Source
from irsim.types.values import (
    MEDIAN_TO_SIGMA,
    SHOWN,
    BackgroundClass,
    Band,
    BandName,
    Bools,
    Box,
    Counts,
    Curve,
    Floats,
    Frame,
    Image,
    Indices,
    Input,
    Slices,
    TargetTruth,
    Truth,
    arrays_frozen,
)

__all__ = [
    "MEDIAN_TO_SIGMA",
    "SHOWN",
    "BackgroundClass",
    "Band",
    "BandName",
    "Bools",
    "Box",
    "CameraFacts",
    "Counts",
    "Curve",
    "Display",
    "Floats",
    "Frame",
    "Image",
    "Indices",
    "Input",
    "Slices",
    "Source",
    "TargetTruth",
    "Truth",
    "arrays_frozen",
]
