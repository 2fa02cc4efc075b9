"""Workers of a bench that hang, die or are killed, and executors from elsewhere: the same rows."""

from __future__ import annotations

import multiprocessing
import os
import random
import re
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from bench_fakes import Breaker, Closer, Hanger, Killer, LateMute, Logger, Mute, Raiser, Strip, Threader, Walker, steps
from bench_rows import rows

from irtrack.bench import Entry, Results, run_bench
from irtrack.bench.plan import Seeds, plans, tracker_specs
from irtrack.bench.run import run_group
from irtrack.errors import InputError, IrtrackError, WorkerError
from irtrack.replay.replay import BLOCK_FRAMES
from irtrack.runner.watchdog import Heartbeat, Limit

FINE = Entry("fine", Walker(jitter=1.0))


def test_a_tracker_that_hangs_is_stopped_and_its_companions_are_not(tmp_path: Path) -> None:
    """At frames 3 and 4, unless the machine is so slow that they come late before."""
    hanging = [Entry(f"hanging {at}", Hanger(at=at)) for at in (3, 4)]
    with run_bench([Strip()], [*hanging, FINE], time_limit_s=2.0, results=tmp_path / "r.db") as results:
        found = {cell.label: cell for cell in results.cells()}
    for each in hanging:
        failure = found[each.label].failure or ""
        assert re.fullmatch(r"strip, seed 0, frame \d: timed out: more than 2 s in the tracker", failure)
    with run_bench([Strip()], [FINE], results=tmp_path / "alone.db") as alone:
        (cell,) = alone.cells()
    assert found["fine"].outcome == cell.outcome


def test_a_tracker_that_is_late_without_hanging_is_told_when_it_is_done() -> None:
    """No tracker does anything in a nanosecond, and nobody watches who could stop it."""
    (plan,) = plans([Strip()], tracker_specs([FINE]), Seeds.of(1, 1), "display", None, None)
    ((cell, trace),) = run_group(plan.group, Heartbeat(Limit(1e-9, "run")))
    assert cell.failure == "strip, seed 0, frame 0: timed out: more than 1e-09 s in the tracker"
    assert trace is None


def test_a_tracker_that_kills_its_process_fails_alone(tmp_path: Path) -> None:
    entries = [FINE, Entry("killer", Killer(at=7)), Entry("breaker", Breaker())]
    with run_bench([Strip()], entries, jobs=2, results=tmp_path / "r.db") as results:
        cells = results.cells()
    failures = {cell.label: cell.failure or "" for cell in cells}
    assert (
        failures["killer"] == "strip, seed 0, frame 7: the process died 2 times while the tracker was at work (SIGKILL)"
    )
    assert failures["breaker"].endswith("RuntimeError: the planted failure")
    assert [cell.status for cell in cells if cell.label == "fine"] == ["ok"]


def test_a_tracker_that_raises_what_ctrl_c_does_fails_as_any_that_raises(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """In workers, where Ctrl-C is ignored; in this process it stops."""
    entries = [FINE, Entry("raiser", Raiser(what="interrupt"))]
    with run_bench([Strip()], entries, jobs=2, results=tmp_path / "r.db") as results:
        fine, raiser = results.cells()
    assert fine.status == "ok"
    assert (raiser.failure or "").startswith("strip, seed 0, frame 5:\nTraceback")
    assert (raiser.failure or "").endswith("\nKeyboardInterrupt")
    assert capfd.readouterr() == ("", "")
    with pytest.raises(KeyboardInterrupt):
        run_bench([Strip()], entries, results=tmp_path / "here.db")


@pytest.mark.parametrize("beside", [Walker(), Threader()], ids=["ends", "goes on"])
def test_a_tracker_that_leaves_its_process_unable_to_answer_fails_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: Walker
) -> None:
    """Where one beside it holds up the process's end, too."""
    monkeypatch.setattr("irtrack.runner.worker.END_S", 0.5)
    entries = [FINE, Entry("closer", Closer()), Entry("beside", beside)]
    with run_bench([Strip()], entries, seeds=2, jobs=2, results=tmp_path / "r.db") as results:
        cells = results.cells()
    failures = {f"{cell.label} {cell.key.tracker_seed}": cell.failure for cell in cells if cell.failure}
    assert failures == {
        f"closer {seed}": f"strip, seed {seed}, frame 19: the process died 2 times after the tracker had been at work "
        "(exit status 1)"
        for seed in (0, 1)
    }
    assert sorted(cell.label for cell in cells) == ["beside", "beside", "closer", "closer", "fine", "fine"]


def test_a_process_that_closes_its_pipe_and_goes_on_is_told_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("irtrack.runner.worker.END_S", 0.5)

    with run_bench([Strip()], [Entry("both", Stayer())], jobs=2, results=tmp_path / "r.db") as results:
        (cell,) = results.cells()
    said = "the process died 2 times after the tracker had been at work (it closed its pipe and went on)"
    assert cell.failure == f"strip, seed 0, frame 19: {said}"


class Stayer(Closer, Threader):
    """Both of it."""


def test_a_worker_killed_by_chance_loses_nothing(tmp_path: Path) -> None:
    entries: list[Any] = [FINE, Entry("chance", Killer(at=7, once=str(tmp_path / "killed"), jitter=1.0))]
    with run_bench([Strip()], entries, seeds=4, jobs=2, results=tmp_path / "r.db") as results:
        killed = rows(results)
    assert (tmp_path / "killed").exists()
    with run_bench([Strip()], entries, seeds=4, results=tmp_path / "whole.db") as results:
        assert rows(results) == killed


def test_a_source_that_kills_every_worker_ends_the_bench(tmp_path: Path) -> None:
    with pytest.raises(WorkerError, match=r"died again and again while no tracker was at work \(SIGKILL\)$"):
        run_bench([Mute()], [FINE], jobs=2, results=tmp_path / "r.db")


@pytest.mark.parametrize("entries", [[FINE], [FINE, Entry("other", Walker())]], ids=["one", "two"])
def test_a_source_that_kills_late_is_not_blamed_on_a_tracker(tmp_path: Path, entries: list[Entry]) -> None:
    late = LateMute(visible=(1.0,) * (BLOCK_FRAMES + 1))
    with pytest.raises(IrtrackError, match=r"^strip: a worker process died again and again while no tracker was at"):
        run_bench([late], entries, jobs=2, results=tmp_path / "r.db")


@pytest.mark.parametrize(
    ("kind", "limit"), [(ThreadPoolExecutor, None), (ProcessPoolExecutor, None), (ThreadPoolExecutor, 30.0)]
)
def test_any_executor_gives_the_same_rows(tmp_path: Path, kind: Any, limit: float | None) -> None:
    entries = [FINE, Entry("breaker", Breaker())]
    with kind(2) as executor:
        arguments: dict[str, Any] = {"executor": executor, "time_limit_s": limit}
        with run_bench([Strip()], entries, seeds=2, results=tmp_path / "r.db", **arguments) as results:
            found = rows(results)
        assert executor.submit(abs, -1).result() == 1  # left open
    with run_bench([Strip()], entries, seeds=2, results=tmp_path / "whole.db") as results:
        assert rows(results) == found


class Damaged(Strip):
    """A source that breaks off."""

    def frame(self, index: int, input: Any = "counts") -> Any:
        raise InputError("damaged: frame 3")


def test_after_an_error_an_executor_has_nothing_left_to_do(tmp_path: Path) -> None:
    log = tmp_path / "log"
    sources = [Damaged("damaged"), *(Strip(f"strip{number}") for number in range(20))]
    with ThreadPoolExecutor(1) as executor:
        with pytest.raises(InputError, match="damaged: frame 3"):
            run_bench(sources, [Entry("log", Logger(log=str(log)))], results=tmp_path / "r.db", executor=executor)
        assert executor.submit(abs, -1).result() == 1
    assert all(count <= 2 for count in steps(log).values())  # what had begun; of twenty


def test_what_cannot_be_sent_to_a_worker_is_one_line(tmp_path: Path) -> None:
    class Local(Walker):
        pass

    with pytest.raises(InputError, match=r"strip: cannot be sent to a worker process: .*Local.*; allowed: a class at"):
        run_bench([Strip()], [Entry("local", Local())], seeds=2, jobs=2, results=tmp_path / "r.db")


class Typed(Walker):
    """Of a module that no other process can import, as what is typed into a notebook is."""


def test_what_a_worker_cannot_import_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    typed = ModuleType("typed_in")
    typed.Typed = Typed  # type: ignore[attr-defined]  # a module made here
    monkeypatch.setitem(sys.modules, "typed_in", typed)
    monkeypatch.setattr(Typed, "__module__", "typed_in")
    with pytest.raises(IrtrackError, match=r"cannot read what it is to run: .*'typed_in'; allowed: a class at the top"):
        run_bench([Strip()], [Entry("typed", Typed())], jobs=2, results=tmp_path / "r.db")


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({"time_limit_s": 1.0, "frame_limit_s": 1.0}, "allowed: one of them"),
        ({"frame_limit_s": 0.0}, "time limit 0 s: allowed: above 0"),
    ],
    ids=["both", "zero"],
)
def test_a_time_limit_is_above_0_and_of_runs_or_of_frames(tmp_path: Path, limits: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        run_bench([Strip()], [FINE], results=tmp_path / "r.db", **limits)


def test_what_a_run_has_taken_counts_against_the_limit_of_runs_alone() -> None:
    assert (Limit(2.0, "run").left(1.5), Limit(2.0, "frame").left(1.5)) == (0.5, 2.0)


def test_ten_kills_at_random_moments_end_in_the_same_rows(tmp_path: Path) -> None:
    log, path = tmp_path / "log", tmp_path / "r.db"
    trackers = [Entry("a", Logger(jitter=1.0, log=str(log))), Entry("b", Logger(jitter=2.0, log=str(log)))]

    def sweep() -> None:
        run_bench([Strip()], trackers, seeds=60, results=path).close()

    moments = random.Random(5)
    kept = []
    for _ in range(10):
        log.write_text("")
        process = multiprocessing.get_context("fork").Process(target=sweep)
        process.start()
        # So many steps after it began, and a moment more: within a step, within a commit, or between.
        wait_for_steps(log, moments.randrange(100), process)
        time.sleep(0.02 * moments.random())
        process.kill()
        process.join()
        with Results(path) as results:
            kept.append(len(results.cells()))
    assert kept == sorted(kept)
    assert 0 < kept[-1] < 120  # it was truly stopped, and truly went on
    assert len(set(kept)) > 3
    with run_bench([Strip()], trackers, seeds=60, results=path) as results:
        found = rows(results)
    with run_bench([Strip()], trackers, seeds=60, results=tmp_path / "whole.db") as results:
        assert rows(results) == found
    assert len(found) == 120


def wait_for_steps(log: Path, count: int, process: Any, seconds: float = 60.0) -> None:
    """Until the log has more lines, or the process has come to its end."""
    end = time.monotonic() + seconds
    while log.read_bytes().count(b"\n") <= count and process.is_alive():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.001)


def test_a_bench_that_is_stopped_leaves_no_process(tmp_path: Path) -> None:
    """Ctrl-C while every worker hangs."""
    entries = [Entry("hanging", Hanger(at=1))]
    threading.Timer(3.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        run_bench([Strip()], entries, seeds=2, jobs=2, results=tmp_path / "r.db")
    children = subprocess.run(["ps", "-o", "pid=,args=", "--ppid", str(os.getpid())], capture_output=True, text=True)
    left = [word for line in children.stdout.splitlines() if "forkserver" in line for word in line.split()[:1]]
    copies = subprocess.run(["ps", "-o", "pid=", "--ppid", ",".join(left)], capture_output=True, text=True)
    assert "spawn_main" not in children.stdout
    assert left or sys.platform != "linux"  # there the workers are copies of a server
    assert (copies.stdout.strip(), copies.stderr) == ("", "")
