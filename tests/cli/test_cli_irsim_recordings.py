"""irsim verify, irsim recover, and the compression of irsim render."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from command_line import Run

import irsim


def test_verify_names_the_damaged_frames_and_recover_keeps_the_others(run: Run, folder: Path) -> None:
    path = irsim.record(irsim.Rendering(irsim.load(folder / "scene.yaml")), folder / "clip.mcap")
    whole = [frame.image for frame in irsim.open_recording(path).frames()]
    assert run("verify", "clip.mcap", cwd=folder).stdout == "clip.mcap: ok, 6 frames\n"
    data = bytearray(path.read_bytes())
    place = bytes(data).find(whole[3].astype("<u2").tobytes())
    assert place > 0
    data[place + 5] ^= 1
    (folder / "bad.mcap").write_bytes(data)
    done = run("verify", "bad.mcap", "clip.mcap", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "clip.mcap: ok, 6 frames\n")
    assert done.stderr.startswith("irsim: bad.mcap: damaged: frames 2 to 3")
    assert len(done.stderr.splitlines()) == 1
    done = run("recover", "bad.mcap", "-o", "new.mcap", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "irsim: note: 4 of 6 frames recovered from bad.mcap\n"
    kept = [frame.image for frame in irsim.open_recording(folder / "new.mcap").frames()]
    assert all(np.array_equal(*pair) for pair in zip(kept, whole[:2] + whole[4:], strict=True))


def test_compressed_recordings_hold_the_same_frames(run: Run, folder: Path) -> None:
    found = {}
    for name in ("none", "lz4", "zstd"):
        done = run("render", "scene.yaml", "-o", f"{name}.mcap", "--compression", name, cwd=folder)
        assert done.returncode == 0, done.stderr
        found[name] = [frame.image for frame in irsim.open_recording(folder / f"{name}.mcap").frames()]
    assert np.array_equal(found["none"], found["lz4"])
    assert np.array_equal(found["none"], found["zstd"])
    assert (folder / "zstd.mcap").stat().st_size < (folder / "none.mcap").stat().st_size
    done = run("render", "scene.yaml", "-o", "x.mcap", "--compression", "zip", cwd=folder)
    assert (done.returncode, done.stderr) == (2, "irsim: --compression 'zip': allowed: none, lz4, zstd, archive\n")
