"""Output files: complete or absent, and never in place of an input."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

import irsim
from irsim.errors import InputError
from irsim.recording.output import atomic_file, atomic_text, check_output


def test_a_file_appears_when_it_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "out.bin"
    path.write_bytes(b"old")
    with atomic_file(path) as file:
        file.write(b"new")
        assert path.read_bytes() == b"old"
    assert path.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["out.bin"]


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_a_failure_keeps_the_old_file(tmp_path: Path, failure: type[BaseException]) -> None:
    path = tmp_path / "out.txt"
    path.write_text("old")
    with pytest.raises(failure), atomic_text(path) as file:  # noqa: PT012 - entering it is a part of the test
        file.write("new")
        raise failure
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["out.txt"]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real.txt").write_text("old")
    link = tmp_path / "link.txt"
    link.symlink_to("real.txt")
    with atomic_text(link) as file:
        file.write("new")
    assert link.is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"


def test_folders_and_devices_are_refused(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path, what in [
        (tmp_path / "none" / "a.csv", "does not exist"),
        (tmp_path, "is a folder"),
        (pipe, "is no regular file"),
        (Path(os.devnull), "is no regular file"),
    ]:
        with pytest.raises(InputError, match=what):
            check_output(path)
    check_output(None)


def test_an_input_is_not_replaced(tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    frames.mkdir()
    picture = frames / "0.png"
    picture.touch()
    scenario = tmp_path / "a.yaml"
    scenario.touch()
    (tmp_path / "b.yaml").symlink_to(scenario)
    check_output(tmp_path / "new.mcap", scenario, frames, None)
    check_output(frames / "new.mcap", frames)
    for path, used in [(scenario, scenario), (tmp_path / "b.yaml", scenario), (picture, frames)]:
        with pytest.raises(InputError, match="would replace"):
            check_output(path, None, used)
    with pytest.raises(InputError, match="would replace"):  # two outputs of one name, neither of which exists
        check_output(tmp_path / "x", tmp_path / "x")


WRITES = """
import sys, time
from pathlib import Path
from irsim.recording.output import atomic_file

with atomic_file(Path(sys.argv[1]), tidy=True) as file:
    file.write(b"half")
    file.flush()
    print("writing", flush=True)
    time.sleep(60)
"""


def test_temporary_files_of_killed_processes_are_removed(tmp_path: Path) -> None:
    """Those of a running process and other files are kept."""
    path = tmp_path / "out.mcap"
    killed, working = (
        subprocess.Popen([sys.executable, "-c", WRITES, str(path)], stdout=subprocess.PIPE, text=True) for _ in range(2)
    )
    with killed, working:
        try:
            for process in (killed, working):
                assert process.stdout is not None
                assert process.stdout.readline() == "writing\n"
            killed.kill()
            killed.wait()
            others = {f".out.mcap.{working.pid}.tmp", ".out.mcap.tmp", ".other.mcap.1.tmp", ".out.mcap.x.tmp"}
            for name in others:
                (tmp_path / name).touch()
            assert (tmp_path / f".out.mcap.{killed.pid}.tmp").exists()
            with atomic_file(path, tidy=True) as file:
                file.write(b"whole")
            assert set(os.listdir(tmp_path)) == {"out.mcap", *others}
        finally:
            working.kill()


def test_locked_temporary_files_are_kept(tmp_path: Path) -> None:
    """The process may run on another machine: it holds the lock."""
    path, gone = tmp_path / "out.mcap", tmp_path / ".out.mcap.4194999.tmp"
    with gone.open("wb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with atomic_file(path, tidy=True):
            pass
        assert gone.exists()
    with atomic_file(path, tidy=True):
        pass
    assert os.listdir(tmp_path) == ["out.mcap"]


def test_recording_removes_old_temporary_files(tmp_path: Path) -> None:
    (tmp_path / ".a.mcap.4194999.tmp").touch()
    scene = irsim.loads("frames: 1\ncamera: {size: [16, 16]}\nbackground: {kind: ground}\n")
    irsim.record(irsim.Rendering(scene), tmp_path / "a.mcap")
    assert os.listdir(tmp_path) == ["a.mcap"]
