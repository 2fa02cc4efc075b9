"""Pictures with a CSV of boxes beside them: a folder of PNG files, or one .npz array of frames x rows x columns."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from typing import Any

import numpy as np

from irsim.recording.formats.base import Clip, LabelledFrame
from irsim.recording.formats.csv_table import Table
from irsim.recording.formats.folder import DatasetFolder


def write_png(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> str:
    """Write a clip as NAME/000000.png, ... and NAME/truth.csv; return its name."""
    place, table = f"{clip.folder}{clip.name}", Table(clip)
    for frame in frames:
        folder.picture(f"{place}/{frame.number:06}.png", frame.image)
        table.add(frame)
    folder.text(f"{place}/truth.csv", table.text)
    return clip.name


def write_npz(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> str:
    """Write a clip as NAME.npz, with the array `frames`, and NAME.csv; return its name. One frame is in memory."""
    place, table = f"{clip.folder}{clip.name}", Table(clip)
    with (
        folder.stream(f"{place}.npz") as file,
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
    ):
        entry = zipfile.ZipInfo("frames.npy")  # without the time of writing: the same frames give the same bytes
        entry.compress_type = zipfile.ZIP_DEFLATED
        with archive.open(entry, "w", force_zip64=True) as array:
            for frame in frames:
                if frame.number == 0:
                    shape = (clip.frames, *frame.image.shape)
                    np.lib.format.write_array_header_1_0(array, _header(frame.image.dtype, shape))
                array.write(np.ascontiguousarray(frame.image).tobytes())
                table.add(frame)
    folder.text(f"{place}.csv", table.text)
    return clip.name


def _header(dtype: Any, shape: tuple[int, ...]) -> dict[str, Any]:
    return {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
