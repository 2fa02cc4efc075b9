"""Import of raw files with a stated layout: counts bit for bit, memory flat, or one line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.recording.importers import import_frames

COUNTS = np.random.default_rng(0).integers(0, 1 << 14, (4, 12, 16)).astype(np.uint16)


@pytest.mark.parametrize(("kind", "dtype"), [("uint16", "<u2"), ("uint16be", ">u2"), ("uint8", "u1")])
@pytest.mark.parametrize(("header", "gap"), [(0, 0), (100, 7)])
def test_raw_counts_are_imported_bit_for_bit(tmp_path: Path, kind: str, dtype: str, header: int, gap: int) -> None:
    counts = (COUNTS >> 6 if dtype == "u1" else COUNTS).astype(dtype)
    (tmp_path / "c.raw").write_bytes(bytes(header) + b"".join(bytes(gap) + frame.tobytes() for frame in counts))
    layout = f"12,16,{kind},header={header},gap={gap}"
    recording = open_recording(import_frames(tmp_path / "c.raw", tmp_path / "r.mcap", layout=layout))
    assert np.array_equal([frame.image for frame in recording.frames()], counts)
    assert recording.bits == 8 * counts.itemsize


@pytest.mark.parametrize(
    "layout",
    [
        "",
        "12,16",
        "12,16,uint16,head=3",
        "12,16,uint16,header",
        "0,16,uint8",
        "1e3,16,uint8",
        "12,16,float32",
        "٣,4,uint8",
    ],
)
def test_wrong_layouts_are_one_line(tmp_path: Path, layout: str) -> None:
    (tmp_path / "c.raw").write_bytes(COUNTS.tobytes())
    with pytest.raises(InputError, match=r"^layout .*: allowed: ROWS,COLUMNS,TYPE"):
        import_frames(tmp_path / "c.raw", tmp_path / "r.mcap", layout=layout)


def test_layouts_that_do_not_fit_are_one_line(tmp_path: Path) -> None:
    (tmp_path / "c.raw").write_bytes(COUNTS.tobytes())
    for layout, message in {
        "12,17,uint16": "holds 3 frames and 312 bytes of 408 bytes each; allowed: a layout of whole frames",
        "1200,1600,uint16": "holds no whole frame of 3840000 bytes each",
        "12,16,uint16,header=9999": "holds no whole frame",
    }.items():
        with pytest.raises(InputError, match=message):
            import_frames(tmp_path / "c.raw", tmp_path / "r.mcap", layout=layout)
    with pytest.raises(InputError, match="is a folder; allowed with a layout: a raw file"):
        import_frames(tmp_path, tmp_path / "r.mcap", layout="12,16,uint8")
    with pytest.raises(InputError, match="there is no such file"):
        import_frames(tmp_path / "d.raw", tmp_path / "r.mcap", layout="12,16,uint8")


GROWTH = """
import resource, sys
from irsim.recording.importers import import_frames
source, out, layout = sys.argv[1:]
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
seen = []
import_frames(source, out, layout=layout or None, compression="lz4", progress=lambda done: seen.append(peak()))
print(seen[-1] - seen[9])
"""


@pytest.mark.parametrize(("name", "layout"), [("c.raw", "512,640,uint16"), ("c.npy", "")])
@pytest.mark.slow
def test_memory_does_not_grow_with_the_file(tmp_path: Path, name: str, layout: str) -> None:
    """A file of 130 MB, mostly a hole, grows the process by less than a tenth of it after the first ten frames."""
    path = tmp_path / name
    if layout:
        with path.open("wb") as file:
            file.truncate(200 * 512 * 640 * 2)
    else:
        np.lib.format.open_memmap(path, "w+", np.uint16, (200, 512, 640)).flush()
    command = [sys.executable, "-c", GROWTH, str(path), str(tmp_path / "r.mcap"), layout]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert int(done.stdout) < 13_000  # kB
