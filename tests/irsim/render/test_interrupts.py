"""Start of workers under Ctrl-C, which a terminal sends to the whole group, and in scripts without a guard; their end
with a parent that is killed."""

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
  - id: jet
    shape: {kind: point, temperature_k: 600}
    path: {kind: weave, start: [24, 16], amplitude_px: 4}
"""


def children(pid: int) -> list[int]:
    """Worker processes of a process, or the server that they are copies of, whichever of its threads started them."""
    listed = " ".join(text(path) for path in (PROC / str(pid) / "task").glob("*/children")).split()
    return [int(child) for child in listed if re.search("spawn_main|forkserver", text(PROC / child / "cmdline"))]


def text(path: Path) -> str:
    try:
        return path.read_text(errors="replace")
    except OSError:  # it has just ended
        return ""


def test_a_signal_taken_by_another_thread_is_deferred() -> None:
    done = threading.Event()
    other = threading.Thread(target=done.wait)
    other.start()  # before the block: it does not hold signals back
    went_on = []

    def held() -> None:
        with interrupts_held():
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.05)
            went_on.append(True)

    try:
        with pytest.raises(KeyboardInterrupt):
            held()
    finally:
        done.set()
        other.join()
    assert went_on


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_sigterm_and_sighup_are_deferred_too(number: signal.Signals) -> None:
    went_on = []

    def end(number: int, _: object) -> None:
        raise KeyboardInterrupt

    def held() -> None:
        with interrupts_held():
            os.kill(os.getpid(), number)
            time.sleep(0.05)
            went_on.append(True)

    before = signal.signal(number, end)
    try:
        with pytest.raises(KeyboardInterrupt):
            held()
        assert signal.getsignal(number) is end
    finally:
        signal.signal(number, before)
    assert went_on


def importing(pid: int) -> bool:
    return "numpy" in text(PROC / str(pid) / "maps")


def workers_importing(pid: int) -> bool:
    return any("numpy" in text(PROC / str(child) / "maps") for child in children(pid))


RENDER = ("irsim", "render", "scene.yaml", "-o", "long.mcap", "--jobs", "3")
BENCH = ("irtrack", "bench", "scene.yaml", "--trackers", "kalman", "--seeds", "4", "--results", "r.db", "--jobs", "2")


@pytest.mark.parametrize(
    ("words", "moment"),
    [(RENDER, importing), (RENDER, workers_importing), (BENCH, workers_importing)],
    ids=["render-importing", "render-workers-importing", "bench-workers-importing"],
)
def test_ctrl_c_while_all_starts_is_one_line(
    tmp_path: Path, words: tuple[str, ...], moment: Callable[[int], bool]
) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE)
    process = subprocess.Popen(
        [sys.executable, "-m", *words], cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    until = time.monotonic() + 60
    while not moment(process.pid):
        assert process.poll() is None
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.005)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    # Where it was in an `exec` of a text, such as dataclasses have, Python ends by the signal itself.
    assert process.returncode in (130, -signal.SIGINT)
    assert said.startswith(f"{words[0]}: stopped")
    assert said.count("\n") == 1
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


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("command", ["irsim", "irtrack"])
def test_ctrl_c_within_a_finaliser_is_not_lost(command: str, name: str, tmp_path: Path) -> None:
    """Nor within a callback, as each import ends in one: what is raised there goes nowhere."""
    (tmp_path / "mine.py").write_text(LOST.format(name))
    words = [sys.executable, "-m", command, "--import", "mine", "check", "none"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=30)
    assert (done.returncode, done.stderr) == (128 + getattr(signal, name), f"{command}: stopped\n")


@pytest.mark.parametrize(("words", "count"), [(RENDER, 4), (BENCH, 4)], ids=["render", "bench"])
def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path, words: tuple[str, ...], count: int) -> None:
    """numpy is imported by the parent and three workers; with irtrack by it, two workers and their fork server."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    process = subprocess.Popen([sys.executable, "-m", *words], cwd=tmp_path, start_new_session=True)
    try:
        wait_until(lambda: sum(map(importing, group(process.pid))) == count)
        process.kill()
        process.wait()
        wait_until(lambda: not group(process.pid))
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def group(leader: int) -> list[int]:
    """The processes that run in a group, whether its leader still does or not."""
    pids = [int(path.name) for path in PROC.glob("[0-9]*")]
    return [pid for pid in pids if group_of(pid) == leader and runs(pid)]


def group_of(pid: int) -> int | None:
    try:
        return os.getpgid(pid)
    except OSError:  # it has just ended
        return None


CALLS = pytest.mark.parametrize(
    "call",
    [
        "list(irsim.frames(irsim.load('sky', ['frames=40', 'camera.size=[48, 32]']), jobs=2))",
        "irtrack.run_bench(['sky'], ['kalman'], results='r.db', seeds=2, jobs=2).__enter__()",
    ],
    ids=["frames", "bench"],
)


@CALLS
def test_a_program_from_a_pipe_is_an_input_error(call: str, tmp_path: Path) -> None:
    program = f"import irsim, irtrack\nif __name__ == '__main__':\n    {call}\n"
    done = subprocess.run(
        [sys.executable], input=program, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 1
    last = "irsim.errors.InputError: worker processes cannot import the main program, <stdin>; allowed: "
    assert done.stderr.splitlines()[-1] == f"{last}one job, or a program in a file"
    assert done.stderr.count("Traceback") == 1


@CALLS
def test_a_script_without_the_guard_gets_one_line(call: str, tmp_path: Path) -> None:
    """Each worker imports the script, and asks for workers as it does."""
    script = tmp_path / "script.py"
    script.write_text(f"import irsim, irtrack\n{call}\n")
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    own, _, parents = done.stderr.partition("Traceback")
    hint = 'worker processes import this script too: put what it calls under if __name__ == "__main__":'
    assert set(own.splitlines()) == {hint}
    assert len(own.splitlines()) <= 2  # one of each worker that was started at once
    assert "a worker process died" in parents.splitlines()[-1] or "as it began" in parents.splitlines()[-1]
