"""irtrack as a process: standard output and error, Ctrl-C, closed pipes."""

from __future__ import annotations

import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from irtrack import Results


@pytest.mark.slow
def test_tracker_output_goes_to_standard_error(made: Path) -> None:
    """Also that of workers."""
    words = ("bench", "clip.mcap", "scene.yaml", "--trackers", "mine:Careless:what=good", "--seeds", "1", "--jobs", "2")
    process = start(made, *words, "--results", str(made / "printed.db"), "--json")
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0
    assert json.loads(out)
    assert "seen 1" in err


NATIVE = """
import os

class Printer:
    def start(self, frame, box):
        self.box = box

    def step(self, frame):
        os.write(1, b"from below\\n")
        return self.box
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("run", "native:Printer", "sky", "frames=4"),
        ("bench", "sky", "--trackers", "native:Printer", "--seeds", "1", "--results", "r.db"),
        ("check", "native:Printer", "--only", "legal"),
    ],
    ids=lambda words: words[0],
)
def test_native_output_goes_to_standard_error(tmp_path: Path, words: tuple[str, ...]) -> None:
    (tmp_path / "native.py").write_text(NATIVE)
    with start(tmp_path, *words, "--json") as process:
        out, err = process.communicate(timeout=60)
    assert json.loads(out)
    assert "from below" in err


CRASHING = """
import ctypes

class Crasher:
    def start(self, frame, box):
        pass

    def step(self, frame):
        ctypes.string_at(0)
"""


@pytest.mark.slow
def test_native_crash_names_the_line_of_the_tracker(tmp_path: Path) -> None:
    (tmp_path / "crash.py").write_text(CRASHING)
    with start(tmp_path, "run", "crash:Crasher", "sky", "frames=3") as process:
        _, err = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGSEGV
    assert "Fatal Python error: Segmentation fault" in err
    assert re.search(r'crash.py", line 9 in step', err)
    if sys.platform == "linux":
        assert "crash:Crasher: frame 1: the process died while the tracker was at work (SIGSEGV)\n" in err


def start(folder: Path, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", "from irtrack.cli import main; main()", *words]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=pipe, text=True, start_new_session=True)


def cells_in(results: Path) -> int:
    """Return the number of runs in a results file that is being written."""
    try:
        with closing(sqlite3.connect(f"file:{results}?mode=ro", uri=True)) as database:
            return int(database.execute("SELECT count(*) FROM cells").fetchone()[0])
    except sqlite3.OperationalError:  # missing, or being written
        return 0


def test_ctrl_c_has_status_130_and_keeps_the_file(made: Path, tmp_path: Path) -> None:
    results = tmp_path / "long.db"
    words = ("bench", "scene.yaml", "--trackers", "grey_pf", "--seeds", "200", "--results", str(results))
    process = start(made, *words, "--jobs", "2")
    until = time.monotonic() + 60
    while time.monotonic() < until:
        if cells_in(results):
            break
        time.sleep(0.05)
    else:
        process.kill()
        pytest.fail("no run within 60 s")
    os.killpg(process.pid, signal.SIGINT)  # to the workers as well, as a terminal does
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    last = err.splitlines()[-1]  # after lines of progress, where the machine is slow
    match = re.fullmatch(r"irtrack: stopped; (\d+) runs? of this call kept in \S+; the same command resumes", last)
    assert match, err
    with Results(results) as kept:
        assert len(kept.cells()) == int(match[1]) > 0
        assert all(cell.status == "ok" for cell in kept.cells())


def test_closed_pipe_is_no_error(made: Path) -> None:
    process = start(made, "run", "template", "clip.mcap", "--json")
    assert process.stdout is not None
    process.stdout.close()  # before the first output
    assert process.stderr is not None
    assert process.stderr.read() == ""
    assert process.wait(timeout=60) == 1
