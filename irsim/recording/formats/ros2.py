"""ROS 2 bag (MCAP): sensor_msgs/Image in /ir/image and vision_msgs/Detection2DArray in /ir/truth.

The centre of the first pixel is (0.5, 0.5) in vision_msgs boxes.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from irsim.errors import InputError, counted, one_line
from irsim.recording.formats.base import Clip, LabelledFrame, LabelRow, PictureSet, class_of, numbered_by_class
from irsim.recording.formats.folder import DatasetFolder
from irsim.recording.image_topics import bag_topics
from irsim.types import Box

IMAGES, DETECTIONS = "/ir/image", "/ir/truth"
OPTICAL_FRAME = "camera"
CORNER_PX = 0.5
_NS = 1_000_000_000

VISION_MSGS = {
    "Point2D": "float64 x\nfloat64 y",
    "Pose2D": "vision_msgs/Point2D position\nfloat64 theta",
    "BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y",
    "ObjectHypothesis": "string class_id\nfloat64 score",
    "ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose",
    "Detection2D": "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
    "vision_msgs/BoundingBox2D bbox\nstring id",
    "Detection2DArray": "std_msgs/Header header\nvision_msgs/Detection2D[] detections",
}
"""Messages of vision_msgs 4 (ROS 2 Humble and later), which rosbags does not have."""
_ARRAY = "vision_msgs/msg/Detection2DArray"


def _types() -> Any:
    """Return the message types of ROS 2 Humble and of vision_msgs."""
    typesys: Any = importlib.import_module("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    for name, text in VISION_MSGS.items():
        store.register(typesys.get_types_from_msg(text, f"vision_msgs/msg/{name}"))
    return store


def read(path: Path, pictures: PictureSet) -> Iterator[LabelRow]:
    """Yield the boxes of a bag's Detection2DArray, one for each picture, in order.

    Detections without ids are numbered in each frame. InputError where the number is not that of the pictures.
    """
    arrays = [topic for topic in bag_topics(path) if topic.schema == _ARRAY]
    if len(arrays) != 1:
        raise InputError(f"{path}: holds {counted(len(arrays), 'topic')} of {_ARRAY}; allowed: one")
    (topic,), store = arrays, _types()
    if pictures.count not in (None, topic.count):
        boxes = counted(topic.count or 0, "Detection2DArray")
        raise InputError(f"{path}: holds {boxes} for {counted(pictures.count or 0, 'picture')}; allowed: one for each")
    for frame, (_, data) in enumerate(topic.read()):
        item = f"message {frame}"
        try:
            found = store.deserialize_cdr(bytes(data), _ARRAY).detections
        except Exception:  # rosbags documents no errors of damaged messages
            raise InputError(f"{path}: {topic.name}: {item}: cannot be read as {_ARRAY}") from None
        classes = [each.results[0].hypothesis.class_id if each.results else None for each in found]
        numbered = [name for name, _ in numbered_by_class(zip(classes, found, strict=True))]
        for each, cls, number in zip(found, classes, numbered, strict=True):
            at, size = each.bbox.center.position, (each.bbox.size_x, each.bbox.size_y)
            place = f"{path}: {one_line(topic.name)}: {item}"
            if not (np.isfinite([at.x, at.y]).all() and all(0 < side < np.inf for side in size)):
                raise InputError(
                    f"{place}: a box of {size[0]:g} x {size[1]:g} px at {at.x:g}, {at.y:g}; allowed: more than 0 px"
                )
            yield LabelRow(place, item, frame, Box(at.x - CORNER_PX, at.y - CORNER_PX, *size), each.id or number, cls)


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> str:
    """Write a clip as the bag NAME; return its name."""
    rosbag2: Any = importlib.import_module("rosbags.rosbag2")  # an extra
    store = _types()
    place = f"{clip.folder}{clip.name}"
    with (
        folder.foreign(place) as path,
        rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer,
    ):
        kinds = {IMAGES: "sensor_msgs/msg/Image", DETECTIONS: _ARRAY}
        topics = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
        for frame in frames:
            time = round(frame.time * _NS)
            for topic, message in ((IMAGES, _image(store, frame)), (DETECTIONS, _detections(store, frame))):
                writer.write(topics[topic], time, store.serialize_cdr(message, kinds[topic]))
    return clip.name


def _header(store: Any, frame: LabelledFrame) -> Any:
    seconds, nanoseconds = divmod(round(frame.time * _NS), _NS)
    stamp = store.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    return store.types["std_msgs/msg/Header"](stamp=stamp, frame_id=OPTICAL_FRAME)


def _image(store: Any, frame: LabelledFrame) -> Any:
    rows, columns = frame.image.shape
    little = np.ascontiguousarray(frame.image, frame.image.dtype.newbyteorder("<"))
    return store.types["sensor_msgs/msg/Image"](
        header=_header(store, frame),
        height=rows,
        width=columns,
        encoding="mono8" if little.itemsize == 1 else "mono16",
        is_bigendian=0,
        step=columns * little.itemsize,
        data=little.view(np.uint8).reshape(-1),
    )


def _detections(store: Any, frame: LabelledFrame) -> Any:
    types = {name: store.types[f"vision_msgs/msg/{name}"] for name in VISION_MSGS}
    geometry = {name: store.types[f"geometry_msgs/msg/{name}"] for name in ("Point", "Quaternion", "Pose")}
    nowhere = geometry["Pose"](geometry["Point"](0.0, 0.0, 0.0), geometry["Quaternion"](0.0, 0.0, 0.0, 1.0))
    unknown = store.types["geometry_msgs/msg/PoseWithCovariance"](nowhere, np.zeros(36))
    found = []
    for target in frame.targets:
        box = target.box
        center = types["Pose2D"](types["Point2D"](box.cx + CORNER_PX, box.cy + CORNER_PX), 0.0)
        hypothesis = types["ObjectHypothesis"](class_of(target), 1.0)
        results = [types["ObjectHypothesisWithPose"](hypothesis, unknown)]
        bbox = types["BoundingBox2D"](center, box.w, box.h)
        found.append(types["Detection2D"](_header(store, frame), results, bbox, target.id))
    return types["Detection2DArray"](_header(store, frame), found)
