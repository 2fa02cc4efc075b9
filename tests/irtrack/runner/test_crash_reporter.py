"""A tracker that ends the process of `irtrack run`: another process says where, and how; nothing is left half done."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_line import Call

from irtrack.runner.crash_reporter import crash_reporter

DYING = """
import ctypes
import multiprocessing
import os
import signal
import time
from pathlib import Path


class Dying:
    def __init__(self, how, status=3):
        self.how, self.status, self.frame = how, status, 0

    def start(self, frame, box):
        if self.how == "child":
            multiprocessing.get_context("fork").Process(target=time.sleep, args=(30,), daemon=True).start()

    def step(self, frame):
        self.frame += 1
        if self.frame < 3:
            return None
        if self.how == "sleep":
            Path("asleep").touch()
            time.sleep(60)
        if self.how == "native":
            ctypes.CDLL(None).exit(self.status)
        if self.how == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        os._exit(self.status)
"""

linux = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nobody listens")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(DYING)
    (tmp_path / "leaving.py").write_text("import os\n\nos._exit(4)\n")
    return tmp_path


def start(folder: Path, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "irtrack", "run", *words]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=pipe, text=True, start_new_session=True)


ENDS = {
    ("how=exit",): (3, "exit status 3"),
    ("how=exit", "status=0"): (0, "exit status 0"),
    ("how=native",): (3, "exit status 3"),
    ("how=kill",): (-signal.SIGKILL, "SIGKILL"),
}


@linux
@pytest.mark.parametrize("words", ENDS, ids="-".join)
def test_where_and_how_the_process_died_is_told(folder: Path, words: tuple[str, ...]) -> None:
    """The status is the tracker's, also where it is 0. Outputs are as they were."""
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
def test_a_tracker_that_ends_the_process_while_it_is_imported_is_told(folder: Path) -> None:
    with start(folder, "leaving:Leaving", "sky") as process:
        _, err = process.communicate(timeout=60)
    assert process.returncode == 4
    assert err.splitlines() == [
        "irtrack: leaving:Leaving: the process died before the first frame (exit status 4)",
        "repeat it: irtrack run leaving:Leaving sky",
    ]


@linux
def test_a_process_that_the_tracker_forked_and_left_hides_nothing(folder: Path) -> None:
    """It has the pipe, whose end does not come before its own."""
    with (folder / "err").open("w") as err:
        words = ["mine:Dying", "sky", "frames=5", "how=child"]
        process = subprocess.Popen([sys.executable, "-m", "irtrack", "run", *words], cwd=folder, stderr=err)
    assert process.wait(timeout=60) == 3
    until = time.monotonic() + 20
    while not (said := (folder / "err").read_text()) and time.monotonic() < until:
        time.sleep(0.05)
    assert said.startswith("irtrack: mine:Dying: frame 3: the process died while the tracker was at work (")


def test_ctrl_c_is_one_line(folder: Path) -> None:
    with start(folder, "mine:Dying", "sky", "frames=5", "how=sleep") as process:
        until = time.monotonic() + 60
        while not (folder / "asleep").exists() and time.monotonic() < until:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to whoever listens, too
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (130, "irtrack: stopped\n")


def test_elsewhere_than_on_linux_nobody_listens(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(os, "fork", None)
    assert call("run", "kalman", "clip.mcap").status == 0


@linux
@pytest.mark.parametrize(
    ("at", "told"),
    [
        ((False, -1), "irtrack: mine: the process died before the first frame (exit status 7)\nwhere\n"),
        ((True, 5), "irtrack: mine: frame 5: the process died while the tracker was at work (exit status 7)\nwhere\n"),
        (
            (False, 5),
            "irtrack: mine: the process died after frame 5, while the tracker was not at work (exit status 7)\nwhere\n",
        ),
        (None, ""),
    ],
    ids=["before", "at work", "between", "after the block"],
)
def test_what_is_told_says_who_was_at_work(
    at: tuple[bool, int] | None, told: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """Of a process that leaves with status 7, within the block or after it."""
    child = os.fork()
    if child == 0:
        with crash_reporter("mine", "where") as reporter:
            if at is not None:
                reporter.progress = at
                os._exit(7)
        os._exit(7)
    told_by = time.monotonic() + 20
    said = ""
    while said != told and time.monotonic() < told_by:
        time.sleep(0.05)  # the process is not waited for yet, so how it ended is known
        said += capfd.readouterr().err
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
    assert said + capfd.readouterr().err == told
