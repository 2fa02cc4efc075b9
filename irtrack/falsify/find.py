"""Search of a scenario's parameter ranges for a failure: arguments, files and reports around a `Falsification`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import irsim
from irsim.config.base import suggestion
from irsim.config.paths import path_of
from irsim.recording.output import make_folder
from irsim.types import Input
from irtrack.bench import Entry
from irtrack.bench.plan import task_of
from irtrack.bench.spec import entry
from irtrack.errors import InputError, whole_number
from irtrack.falsify.falsification import (
    FRESH,
    FRESH_WHILE_SHRINKING,
    Failure,
    Falsification,
    NoFailure,
    Progress,
    Say,
)
from irtrack.falsify.outputs import JOURNAL, check_outputs, clear, write_minimal
from irtrack.falsify.regressions import keep
from irtrack.falsify.rules import rules_of
from irtrack.falsify.search import SEARCHES
from irtrack.falsify.trial import Subject, Trials
from irtrack.registry.identity import Runnable
from irtrack.runner.pool import start_runner

Report = Callable[[Falsification, Failure, Path], None]
"""Function that writes reports of a failure into the folder with its minimal.yaml and minimal.mcap."""


def find_failure(
    scenario: str | Path | irsim.Scenario,
    tracker: str | Runnable | Entry,
    folder: str | Path,
    *,
    search: str = "cma",
    budget: int = 500,
    jobs: int = 1,
    seed: int | None = None,
    fresh: int = FRESH,
    frame_limit_s: float | None = None,
    input: Input = "display",
    name: str | None = None,
    file: Path | None = None,
    command: str | None = None,
    keep_in: Path | None = None,
    report: Report | None = None,
    say: Say = lambda line: None,
    progress: Progress | None = None,
) -> Failure | NoFailure:
    """Search the ranges under `vary` for a scene in which the tracker breaks a rule of the scenario.

    tracker   spec (`irtrack.bench.spec`), tracker, tracker of many, detector (`irtrack.make_detector`), or entry; its
              task decides which rules count
    folder    created if missing. It gets a journal of all trials, from which the same call resumes, and after a
              failure minimal.yaml and minimal.mcap
    search    'cma', 'sobol' or 'random', of at most `budget` runs after the benign point
    jobs      number of worker processes; the result does not depend on it. With more than one, or with a limit, the
              calling script needs the guard ``if __name__ == "__main__"``
    seed      seed of the search; the scenes and the tracker have the scenario's own seed
    fresh     number of fresh seeds that test whether a failure is structural or seed-dependent
    frame_limit_s   longest time of the tracker for a frame, s, in worker processes even with one job; a tracker that
                    takes longer, or whose process dies, fails like one that raises an exception
    name, command   name of the scenario and command line, for the reports
    file      file of a loaded scenario, which no output may replace
    keep_in   folder in which a failure is kept (`irtrack.falsify.regressions`); None: not kept
    report    called with the falsification, the failure and the folder when the files are written
    say, progress   functions called with lines of text, and with (runs done, budget)

    Return the shrunk failure, or the least margin. InputError, before the first run, where nothing varies, an option
    is wrong or an output would replace the scenario's file. KeyboardInterrupt is raised after the failure found so far
    is written.
    """
    folder = path_of(folder)
    if isinstance(scenario, irsim.Scenario):
        loaded, name = scenario, name or "scenario"
    else:
        loaded, name, file = irsim.load(scenario), name or Path(scenario).stem, irsim.find(scenario)
    _check(loaded, name if file is None else str(file), search, budget, jobs, fresh)
    if frame_limit_s is not None and not frame_limit_s > 0:
        raise InputError(f"time limit {frame_limit_s:g} s: allowed: above 0")
    spec = entry(tracker)
    subject = Subject(spec.label, spec.tracker, input, rules_of(loaded, task_of(spec.tracker)))
    make_folder(folder)
    check_outputs(folder, file)
    clear(folder)
    with start_runner(jobs, apart=frame_limit_s is not None) as runner:
        trials = Trials(subject, folder / JOURNAL, runner, frame_limit_s)
        falsification = Falsification(loaded, subject, trials, say, fresh, name, command)
        try:
            found = falsification.run(search, budget, loaded.seed if seed is None else seed, progress)
        finally:
            if falsification.failure is not None:
                write_failure(falsification, falsification.failure, folder, report)
        if keep_in is not None and isinstance(found, Failure):
            (verdict,) = trials.verdicts([falsification.scene(found.least)])
            limit_s = verdict.limit_s if frame_limit_s is None else frame_limit_s
            say(f"kept: {keep(folder, subject, name, verdict.how, keep_in, limit_s).path}")
        return found


def write_failure(falsification: Falsification, failure: Failure, folder: Path, report: Report | None = None) -> None:
    """Write minimal.yaml, minimal.mcap and the reports, or none of them."""
    try:
        head = [f"{falsification.subject.label}: {falsification.broken(failure.rule)}, found in {falsification.name}"]
        head += [f"command: {falsification.command}"] if falsification.command else []
        write_minimal(folder, falsification.smallest(failure), head)
        if report is not None:
            report(falsification, failure, folder)
    except BaseException:
        clear(folder)
        raise


def _check(scenario: irsim.Scenario, name: str, search: str, budget: int, jobs: int, fresh: int) -> None:
    """Raise InputError where nothing varies, or an option is wrong."""
    if not irsim.variations(scenario).knobs:
        raise InputError(
            f"{name}: vary: nothing varies that could be searched; allowed: override keys, each with a kind of "
            "variation that is no nuisance"
        )
    if search not in SEARCHES:
        raise InputError(f"search '{search}': allowed: {', '.join(SEARCHES)}{suggestion(search, SEARCHES)}")
    for count, number, least in (("budget", budget, 1), ("jobs", jobs, 1), ("fresh", fresh, FRESH_WHILE_SHRINKING)):
        whole_number(count, number, least)
