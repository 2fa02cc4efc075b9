"""A tracker that ends the process of `irtrack run`: another process reports the frame and the signal."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from irtrack.runner.crash_reporter import crash_reporter

DYING = """
import ctypes, os, signal, time
from pathlib import Path


class Dying:
    def __init__(self, how, status=3):
        self.how, self.status, self.frame = how, status, 0

    def start(self, frame, box):
        pass

    def step(self, frame):
        self.frame += 1
        if self.frame < 3:
            return None
        if self.how == "sleep":
            Path("asleep").touch()
            time.sleep(60)
        if self.how == "native":
            ctypes.CDLL(None).exit(self.status)
        os.kill(os.getpid(), signal.SIGKILL)
"""

linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has the reporter")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(DYING)
    (tmp_path / "leaving.py").write_text("import os\n\nos._exit(4)\n")
    return tmp_path


def start(folder: Path, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "irtrack", "run", *words]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=pipe, text=True, start_new_session=True)


ENDS = {("how=native", "status=0"): (0, "exit status 0"), ("how=kill",): (-signal.SIGKILL, "SIGKILL")}


@linux
@pytest.mark.parametrize("words", ENDS, ids="-".join)
def test_a_crash_is_reported_with_frame_and_signal(folder: Path, words: tuple[str, ...]) -> None:
    """The exit status stays the tracker's, even 0; outputs are not touched."""
    (folder / "t.csv").write_text("old")
    before = sorted(folder.iterdir())
    with start(folder, "mine:Dying", "sky", "frames=5", *words, "--csv", "t.csv", "-o", "t.mcap") as process:
        out, err = process.communicate(timeout=60)
    status, how = ENDS[words]
    assert (process.returncode, out) == (status, "")
    assert err.splitlines() == [
        f"irtrack: mine:Dying: frame 3: the process died while the tracker was at work ({how})",
        "on sky, seed 1; repeat it: irtrack run mine:Dying sky frames=5 "
        f"{' '.join(words)} --csv t.csv -o t.mcap --seed 1",
    ]
    assert sorted(each for each in folder.iterdir() if each.name != "__pycache__") == before
    assert (folder / "t.csv").read_text() == "old"


@linux
def test_a_tracker_that_ends_the_process_while_imported(folder: Path) -> None:
    with start(folder, "leaving:Leaving", "sky") as process:
        _, err = process.communicate(timeout=60)
    assert process.returncode == 4
    assert err.splitlines() == [
        "irtrack: leaving:Leaving: the process died before the first frame (exit status 4)",
        "repeat it: irtrack run leaving:Leaving sky",
    ]


def test_ctrl_c_is_one_line(folder: Path) -> None:
    with start(folder, "mine:Dying", "sky", "frames=5", "how=sleep") as process:
        until = time.monotonic() + 60
        while not (folder / "asleep").exists() and time.monotonic() < until:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to the reporter too
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (130, "irtrack: stopped\n")


@linux
@pytest.mark.parametrize(
    ("progress", "words"),
    [
        ((False, -1), "the process died before the first frame"),
        ((True, 5), "frame 5: the process died while the tracker was at work"),
        ((False, 5), "the process died after frame 5, while the tracker was not at work"),
        (None, ""),
    ],
    ids=["before", "at work", "between", "after the block"],
)
def test_the_report_names_the_frame_at_work(
    progress: tuple[bool, int] | None, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """Of a process that ends with status 7, within the block or after it."""
    child = os.fork()
    if child == 0:
        with crash_reporter("mine", "where") as reporter:
            if progress is not None:
                reporter.progress = progress
                os._exit(7)
        os._exit(7)
    report = f"irtrack: mine: {words} (exit status 7)\nwhere\n" if words else ""
    until, said = time.monotonic() + 20, ""
    while said != report and time.monotonic() < until:
        time.sleep(0.05)  # the process is not waited for yet, so that its exit status is known
        said += capfd.readouterr().err
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
    assert said + capfd.readouterr().err == report
