"""Output files: complete or absent, and never in place of an input."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest

from irsim.errors import InputError
from irsim.recording.output import all_or_none, atomic_file, atomic_text, check_output


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
    for path, message in [
        (tmp_path / "none" / "a.csv", "does not exist"),
        (tmp_path, "is a folder"),
        (Path(os.devnull), "is no regular file"),
    ]:
        with pytest.raises(InputError, match=message):
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


def test_temporary_files_of_ended_processes_are_removed(tmp_path: Path) -> None:
    """Kept are locked ones, whose process may run on another machine, those of running processes, and other files."""
    path, gone = tmp_path / "out.mcap", tmp_path / ".out.mcap.4194999.tmp"
    kept = {f".out.mcap.{os.getppid()}.tmp", ".out.mcap.tmp", ".other.mcap.4194999.tmp", ".out.mcap.x.tmp"}
    for name in kept:
        (tmp_path / name).touch()
    with gone.open("wb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with atomic_file(path, tidy=True):
            pass
        assert gone.exists()
    with atomic_file(path, tidy=True):
        pass
    assert set(os.listdir(tmp_path)) == {"out.mcap", *kept}


def test_a_planted_link_is_not_written_through(tmp_path: Path) -> None:
    victim = tmp_path / "victim"
    victim.write_text("keep me")
    (tmp_path / f".out.mcap.{os.getpid()}.tmp").symlink_to(victim)
    with atomic_file(tmp_path / "out.mcap") as file:
        file.write(b"new")
    assert victim.read_text() == "keep me"
    assert not (tmp_path / "out.mcap").is_symlink()
    assert (tmp_path / "out.mcap").read_bytes() == b"new"


def test_outputs_are_written_together_or_not_at_all(tmp_path: Path) -> None:
    first, old = tmp_path / "k.csv", tmp_path / "old.csv"
    old.touch()

    def write() -> None:
        with all_or_none(first, old, None):
            first.touch()
            raise InputError("the disk is full")

    with pytest.raises(InputError, match="full"):
        write()
    assert list(tmp_path.iterdir()) == [old]
