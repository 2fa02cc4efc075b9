"""irsim render: the frames of the library, with overrides, and again from a recording."""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import Run

import irsim


def test_render_writes_the_frames_of_the_library(run: Run, folder: Path) -> None:
    done = run("render", "scene.yaml", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""  # no bar where standard error is no terminal
    assert done.stdout.splitlines()[0] == "scene.mcap"
    recording = irsim.open_recording(folder / "scene.mcap")
    expected = list(irsim.frames(irsim.load(folder / "scene.yaml")))
    assert len(recording) == len(expected) == 6
    for frame, (wanted, _) in zip(recording.frames(), expected, strict=True):
        assert np.array_equal(frame.image, wanted.image)
    assert recording.scenario_text is not None
    assert irsim.loads(recording.scenario_text) == irsim.load(folder / "scene.yaml")


def test_render_options_change_the_scenario(run: Run, folder: Path) -> None:
    done = run(
        *("render", "scene.yaml", "-o", "x.mcap", "--seed", "5", "--frames", "8", "--without", "white"),
        *("--jobs", "2", "camera.bits=12", "targets.jet.path.speed=1"),
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    text = irsim.open_recording(folder / "x.mcap").scenario_text
    overrides = ["seed=5", "frames=8", "without=[white]", "camera.bits=12", "targets.jet.path.speed=1"]
    assert text is not None
    assert irsim.loads(text) == irsim.load(folder / "scene.yaml", overrides)


def test_frames_n_and_frames_a_to_b(run: Run, folder: Path) -> None:
    assert run("render", "scene.yaml", "-o", "n.mcap", "--frames", "9", cwd=folder).returncode == 0
    assert run("render", "scene.yaml", "-o", "ab.mcap", "--frames", "4:9", cwd=folder).returncode == 0
    whole, part = (list(irsim.open_recording(folder / name).frames()) for name in ("n.mcap", "ab.mcap"))
    assert (len(whole), len(part)) == (9, 5)
    for frame, wanted in zip(part, whole[4:], strict=True):
        assert frame.time == wanted.time
        assert np.array_equal(frame.image, wanted.image)


def same_pictures(folder: Path, one: str, other: str) -> bool:
    first, second = (irsim.open_recording(folder / name) for name in (one, other))
    return list(first.truths()) == list(second.truths()) and all(
        a.time == b.time and np.array_equal(a.image, b.image)
        for a, b in zip(first.frames(), second.frames(), strict=True)
    )


@pytest.mark.parametrize("frames", ["6", "2:5"])
def test_a_recording_is_rendered_again_from_itself(run: Run, folder: Path, frames: str) -> None:
    assert run("render", "scene.yaml", "--seed", "7", "--frames", frames, cwd=folder).returncode == 0
    (folder / "scene.yaml").unlink()
    done = run("render", "scene.mcap", "-o", "again.mcap", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert same_pictures(folder, "scene.mcap", "again.mcap")
    first, again = (irsim.open_recording(folder / name).header for name in ("scene.mcap", "again.mcap"))
    assert again == first


def test_a_recording_is_rendered_again_with_changes(run: Run, folder: Path) -> None:
    run("render", "scene.yaml", "-o", "first.mcap", "--frames", "2:5", cwd=folder)
    run("render", "first.mcap", "-o", "a.mcap", "--frames", "1:4", "--seed", "9", "camera.netd_mk=90", cwd=folder)
    run("render", "scene.yaml", "-o", "b.mcap", "--frames", "3:6", "--seed", "9", "camera.netd_mk=90", cwd=folder)
    assert same_pictures(folder, "a.mcap", "b.mcap")
    run("render", "first.mcap", "-o", "c.mcap", "frames=9", cwd=folder)
    run("render", "scene.yaml", "-o", "d.mcap", "--frames", "2:9", cwd=folder)
    assert same_pictures(folder, "c.mcap", "d.mcap")


def test_no_module_named_in_a_recording_is_imported_by_render(run: Run, folder: Path) -> None:
    from recording_forge import forge

    (folder / "evil_scene.py").write_text("raise SystemExit('code of a file was run')")
    forge(folder / "r.mcap", scenario=b"background: {kind: 'evil_scene:X'}\n")
    done = run("render", "r.mcap", "-o", "x.mcap", cwd=folder)
    assert done.returncode == 2
    assert done.stderr.startswith("irsim: r.mcap: scenario:1:"), done.stderr
    assert "are not imported" in done.stderr
    assert "evil_scene" not in sys.modules


def test_a_default_output_replaces_only_rendered_recordings(run: Run, folder: Path) -> None:
    """Imported recordings and other files are replaced only by -o."""
    footage = folder / "scene.mcap"
    pictures = folder / "pictures"
    pictures.mkdir()
    for number in range(2):
        cv2.imwrite(str(pictures / f"{number}.png"), np.full((8, 8), 7, np.uint8))
    irsim.import_frames(pictures, footage, rate_hz=30)
    kept = footage.read_bytes()
    done = run("render", "scene.yaml", cwd=folder)
    assert done.returncode == 2
    assert "scene.mcap: exists, was not rendered from a scenario, and would be replaced;" in done.stderr
    assert footage.read_bytes() == kept
    assert run("render", "scene.yaml", "-o", "scene.mcap", cwd=folder).returncode == 0
    assert run("render", "scene.yaml", cwd=folder).returncode == 0  # now it was rendered
    footage.write_bytes(b"mine")
    assert run("render", "scene.yaml", cwd=folder).returncode == 2
    assert footage.read_bytes() == b"mine"
