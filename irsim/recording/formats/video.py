"""MP4 (H.264) of the 8-bit display, with a CSV of boxes beside it."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from irsim.recording.formats.base import Clip, LabelledFrame
from irsim.recording.formats.csv_table import Table
from irsim.recording.formats.folder import DatasetFolder

H264 = {"crf": "12", "preset": "veryfast"}
"""Options of libx264: nearly lossless."""


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> str:
    """Write a clip as NAME.mp4 and NAME.csv; return its name. A last column or row is doubled where a side is odd."""
    import av  # an extra

    place, table = f"{clip.folder}{clip.name}", Table(clip)
    with folder.stream(f"{place}.mp4") as file, av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(clip.rate_hz).limit_denominator(10_000), options=H264)
        stream.width, stream.height = (side + side % 2 for side in clip.size)
        stream.pix_fmt = "yuv420p"
        for frame in frames:
            more = [(0, side % 2) for side in frame.image.shape]
            even: npt.NDArray[np.uint8] = np.pad(frame.image, more, mode="edge")
            container.mux(stream.encode(av.VideoFrame.from_ndarray(even, format="gray").reformat(format="yuv420p")))
            table.add(frame)
        container.mux(stream.encode())
    folder.text(f"{place}.csv", table.text)
    return clip.name
