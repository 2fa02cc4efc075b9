"""Annotations, display range and layout of a recording for the viewers Foxglove and Lichtblick."""

from __future__ import annotations

import json

import numpy as np
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation

from irsim.recording.messages import IMAGE, PREVIEW, TRUTH_BOXES, time_fields
from irsim.types import Box, Image, Truth

CORNER_PX = 0.5
"""Offset added to coordinates, px. Their origin in foxglove.PointsAnnotation is the corner of the top left pixel, in
irsim its centre."""

POINT_LIKE_PX = 5.0
"""Size, px, below which a target is marked by a circle, as the outline of a box would cover it."""

_CIRCLE_PX = 3 * POINT_LIKE_PX
_TEXT_PX = 10.0
_LINE_PX = 1.0

Rgba = dict[str, float]

# Colours of Okabe & Ito (2008), distinguishable for the colour-blind.
SEEN: Rgba = {"r": 0.0, "g": 0.62, "b": 0.45, "a": 1.0}
HIDDEN: Rgba = {"r": 0.90, "g": 0.62, "b": 0.0, "a": 1.0}
TRACK: Rgba = {"r": 0.34, "g": 0.71, "b": 0.91, "a": 1.0}
_CLEAR: Rgba = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}


def _point(x: float, y: float) -> dict[str, float]:
    return {"x": x + CORNER_PX, "y": y + CORNER_PX}


def add_box(annotations: ImageAnnotations, box: Box, label: str, color: Rgba, log_time: int) -> None:
    """Add a labelled box, or a circle around a target smaller than `POINT_LIKE_PX`."""
    time = time_fields(log_time)
    left, top, right, bottom = box.edges
    if max(box.w, box.h) < POINT_LIKE_PX:
        annotations.circles.add(
            timestamp=time,
            position=_point(box.cx, box.cy),
            diameter=_CIRCLE_PX,
            thickness=_LINE_PX,
            fill_color=_CLEAR,
            outline_color=color,
        )
        top = box.cy - _CIRCLE_PX / 2
    else:
        annotations.points.add(
            timestamp=time,
            type=PointsAnnotation.LINE_LOOP,
            points=[_point(left, top), _point(right, top), _point(right, bottom), _point(left, bottom)],
            outline_color=color,
            fill_color=_CLEAR,
            thickness=_LINE_PX,
        )
    annotations.texts.add(
        timestamp=time,
        position=_point(left, top - 1),
        text=label,
        font_size=_TEXT_PX,
        text_color=color,
        background_color=_CLEAR,
    )


def annotate_truth(truth: Truth, log_time: int) -> bytes:
    """Return the bytes of foxglove.ImageAnnotations: a box for each target, in another colour if mostly hidden."""
    annotations = ImageAnnotations()
    for target in truth.targets:
        label = target.id if target.scr is None else f"{target.id}  SCR {target.scr:.1f}"
        add_box(annotations, target.box, label, HIDDEN if target.hidden else SEEN, log_time)
    return annotations.SerializeToString()


def display_range(image: Image, bits: int) -> tuple[int, int]:
    """Return the counts drawn black and white: the range of the middle 99 % of a frame's counts, widened by half of it
    on each side."""
    low, high = np.percentile(image, (0.5, 99.5))
    margin = max((high - low) / 2, 1.0)
    return max(int(low - margin), 0), min(int(high + margin), 2**bits - 1)


def viewer_layout(black: int, white: int, has_truth: bool) -> bytes:
    """Return a viewer layout as JSON: counts beside the 8-bit preview, both with the boxes of the truth."""
    annotations = {TRUTH_BOXES: {"visible": True}} if has_truth else {}
    counts = {"imageTopic": IMAGE, "annotations": annotations, "minValue": black, "maxValue": white}
    preview = {"imageTopic": PREVIEW, "annotations": annotations}
    layout = {
        "configById": {"Image!counts": {"imageMode": counts}, "Image!preview": {"imageMode": preview}},
        "globalVariables": {},
        "userNodes": {},
        "layout": {"first": "Image!counts", "second": "Image!preview", "direction": "row"},
    }
    return json.dumps(layout, indent=2).encode()
