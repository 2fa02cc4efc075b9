"""Rerun: pictures, boxes and names of targets in an .rrd file. Rerun reads no boxes from MCAP.

Rerun's first pixel reaches from 0 to 1, so half a pixel is added.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import Any

from irsim.recording.formats.base import Clip, LabelledFrame
from irsim.recording.formats.folder import DatasetFolder

CORNER_PX = 0.5


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> str:
    """Write a clip as NAME.rrd with the entities `image` and `image/targets`; return its name."""
    rerun: Any = importlib.import_module("rerun")  # an extra
    name = f"{clip.folder}{clip.name}.rrd"
    with folder.foreign(name) as path:
        stream = rerun.RecordingStream("irsim", recording_id=clip.name)
        stream.save(path)
        for frame in frames:
            stream.set_time("frame", sequence=frame.number)
            stream.set_time("time", duration=frame.time)
            stream.log("image", rerun.Image(frame.image, color_model="L"))
            edges = [[edge + CORNER_PX for edge in target.box.edges] for target in frame.targets]
            labels = [target.id for target in frame.targets]
            boxes = rerun.Boxes2D(array=edges, array_format=rerun.Box2DFormat.XYXY, labels=labels)
            stream.log("image/targets", boxes if edges else rerun.Clear(recursive=False))
        stream.disconnect()
    return clip.name
