"""Boxes over the picture, as foxglove.ImageAnnotations."""

from __future__ import annotations

from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from google.protobuf.timestamp_pb2 import Timestamp

from irsim.types import Box, Truth

CORNER_PX = 0.5
"""Annotations count from the top-left corner of the top-left pixel, irsim from its centre
(foxglove.PointsAnnotation: "the top-left corner of the top-left pixel of the image as the origin")."""

POINT_LIKE_PX = 5.0
"""A target smaller than this gets a circle around it: a box would cover it."""

_CIRCLE_PX = 3 * POINT_LIKE_PX
_TEXT_PX = 10.0
_LINE_PX = 1.0

Rgba = dict[str, float]

# Colours of Okabe & Ito (2008), told apart by colour-blind eyes too.
SEEN: Rgba = {"r": 0.0, "g": 0.62, "b": 0.45, "a": 1.0}
HIDDEN: Rgba = {"r": 0.90, "g": 0.62, "b": 0.0, "a": 1.0}
TRACK: Rgba = {"r": 0.34, "g": 0.71, "b": 0.91, "a": 1.0}
_CLEAR: Rgba = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}


def _time(log_time: int) -> dict[str, int]:
    return {"seconds": log_time // 10**9, "nanos": log_time % 10**9}


def stamp(log_time: int) -> Timestamp:
    """The protobuf timestamp of a log time in ns."""
    return Timestamp(**_time(log_time))


def _point(x: float, y: float) -> dict[str, float]:
    return {"x": x + CORNER_PX, "y": y + CORNER_PX}


def draw(annotations: ImageAnnotations, box: Box, label: str, color: Rgba, log_time: int) -> None:
    """Add a box, or a circle around a point-like target, and its label."""
    time = _time(log_time)
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
    """The bytes of foxglove.ImageAnnotations: every target, in another colour where mostly hidden."""
    annotations = ImageAnnotations()
    for target in truth.targets:
        label = target.id if target.scr is None else f"{target.id}  SCR {target.scr:.1f}"
        draw(annotations, target.box, label, HIDDEN if target.hidden else SEEN, log_time)
    return annotations.SerializeToString()
