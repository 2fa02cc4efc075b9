"""ROS 2 bag (MCAP): sensor_msgs/Image in /ir/image and vision_msgs/Detection2DArray in /ir/truth.

The centre of the first pixel is (0.5, 0.5) in vision_msgs boxes.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from irsim.recording.formats.base import Clip, LabelledFrame, class_of
from irsim.recording.formats.folder import DatasetFolder

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


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> str:
    """Write a clip as the bag NAME; return its name."""
    rosbag2: Any = importlib.import_module("rosbags.rosbag2")  # an extra
    typesys: Any = importlib.import_module("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    for name, text in VISION_MSGS.items():
        store.register(typesys.get_types_from_msg(text, f"vision_msgs/msg/{name}"))
    place = f"{clip.folder}{clip.name}"
    with (
        folder.foreign(place) as path,
        rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer,
    ):
        kinds = {IMAGES: "sensor_msgs/msg/Image", DETECTIONS: "vision_msgs/msg/Detection2DArray"}
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
