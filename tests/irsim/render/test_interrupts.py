"""Worker processes under Ctrl-C, which a terminal sends to the whole group, and with a parent that is killed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from processes import runs, wait_until

from irsim.render.interrupts import interrupts_held
from irtrack import Results

PROC = Path("/proc")

pytestmark = pytest.mark.skipif(not (PROC / "self" / "maps").exists(), reason="takes Linux's /proc")

SCENE = """\
frames: 100000
camera: {size: [48, 32]}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: point, temperature_k: 600}, path: {kind: weave, start: [24, 16], amplitude_px: 4}}
"""
RENDER = ("irsim", "render", "scene.yaml", "-o", "long.mcap", "--jobs", "2")
BENCH = ("irtrack", "bench", "scene.yaml", "--trackers", "kalman", "--seeds", "4", "--results", "r.db", "--jobs", "2")


def text(path: Path) -> str:
    """Return the text of a file of /proc, empty once its process has ended."""
    try:
        return path.read_text(errors="replace")
    except OSError:
        return ""


def imports(pid: int) -> bool:
    return "numpy" in text(PROC / str(pid) / "maps")


def workers_import(pid: int) -> bool:
    """Return True once a worker, or the server that workers are copies of, imports numpy."""
    children = " ".join(text(path) for path in (PROC / str(pid) / "task").glob("*/children")).split()
    workers = [each for each in children if re.search("spawn_main|forkserver", text(PROC / each / "cmdline"))]
    return any(imports(int(worker)) for worker in workers)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_are_deferred(number: signal.Signals) -> None:
    """Also one that another thread receives."""
    done, finished = threading.Event(), []
    other = threading.Thread(target=done.wait)
    other.start()  # before the block: its signal mask lets signals through

    def end(number: int, _: object) -> None:
        raise KeyboardInterrupt

    def hold() -> None:
        with interrupts_held():
            os.kill(os.getpid(), number)
            time.sleep(0.05)
            finished.append(True)

    before = signal.signal(number, end)
    try:
        with pytest.raises(KeyboardInterrupt):
            hold()
        assert signal.getsignal(number) is end
    finally:
        signal.signal(number, before)
        done.set()
        other.join()
    assert finished


@pytest.mark.parametrize(
    ("words", "moment"),
    [(RENDER, imports), pytest.param(BENCH, workers_import, marks=pytest.mark.slow)],
    ids=["render imports", "workers of bench import"],
)
def test_ctrl_c_during_the_start_is_one_line(
    tmp_path: Path, words: tuple[str, ...], moment: Callable[[int], bool]
) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE)
    process = subprocess.Popen(
        [sys.executable, "-m", *words], cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    wait_until(lambda: moment(process.pid) or process.poll() is not None)
    os.killpg(process.pid, signal.SIGINT)
    _, lines = process.communicate(timeout=60)
    # Within an `exec` of a text, such as of a dataclass, Python ends by the signal itself.
    assert process.returncode in (130, -signal.SIGINT)
    assert lines.startswith(f"{words[0]}: stopped")
    assert lines.count("\n") == 1
    left = {path.name for path in tmp_path.iterdir()} - {"scene.yaml"}
    assert left <= {"r.db"}
    if left:
        with Results(tmp_path / "r.db") as results:
            assert results.cells() == []


LOST = """\
import os, signal, time

class Swallows:
    def __del__(self):
        os.kill(os.getpid(), signal.{})
        time.sleep(0.01)

del [Swallows()][0]
time.sleep(60)
"""


@pytest.mark.parametrize(("command", "name"), [("irsim", "SIGINT"), ("irtrack", "SIGTERM")])
def test_signal_within_a_finaliser_is_not_lost(command: str, name: str, tmp_path: Path) -> None:
    """An exception raised there is ignored by Python."""
    (tmp_path / "mine.py").write_text(LOST.format(name))
    words = [sys.executable, "-m", command, "--import", "mine", "check", "none"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=30)
    assert (done.returncode, done.stderr) == (128 + getattr(signal, name), f"{command}: stopped\n")


@pytest.mark.parametrize(
    ("words", "count"), [(RENDER, 3), pytest.param(BENCH, 4, marks=pytest.mark.slow)], ids=["render", "bench"]
)
def test_workers_end_with_a_killed_parent(tmp_path: Path, words: tuple[str, ...], count: int) -> None:
    """The parent and two workers import numpy, and the fork server of irtrack."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    process = subprocess.Popen([sys.executable, "-m", *words], cwd=tmp_path, start_new_session=True)
    try:
        wait_until(lambda: sum(map(imports, group(process.pid))) == count)
        process.kill()
        process.wait()
        wait_until(lambda: not group(process.pid))
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def group(leader: int) -> list[int]:
    """Return the running processes of a group, whether its leader still runs or not."""
    found = []
    for path in PROC.glob("[0-9]*"):
        with suppress(OSError):
            if os.getpgid(int(path.name)) == leader and runs(int(path.name)):
                found.append(int(path.name))
    return found


FRAMES = "list(irsim.frames(irsim.load('sky', ['frames=40', 'camera.size=[48, 32]']), jobs=2))"
RUN = "irtrack.run_bench(['sky'], ['kalman'], results='r.db', seeds=2, jobs=2).__enter__()"


def test_program_from_a_pipe_is_an_input_error(tmp_path: Path) -> None:
    program = f"import irsim, irtrack\nif __name__ == '__main__':\n    {FRAMES}\n"
    done = subprocess.run(
        [sys.executable], input=program, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 1
    last = "irsim.errors.InputError: worker processes cannot import the main program, <stdin>; allowed: "
    assert done.stderr.splitlines()[-1] == f"{last}one job, or a program in a file"
    assert done.stderr.count("Traceback") == 1


@pytest.mark.slow
@pytest.mark.parametrize("call", [FRAMES, RUN], ids=["frames", "bench"])
def test_script_without_the_guard_gets_one_line(call: str, tmp_path: Path) -> None:
    """Each worker imports the script, and would start workers in turn."""
    script = tmp_path / "script.py"
    script.write_text(f"import irsim, irtrack\n{call}\n")
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    own, _, parents = done.stderr.partition("Traceback")
    hint = 'worker processes import this script too: put what it calls under if __name__ == "__main__":'
    assert set(own.splitlines()) == {hint}
    assert len(own.splitlines()) <= 2  # one of each worker
    assert "a worker process died" in parents.splitlines()[-1] or "as it began" in parents.splitlines()[-1]
