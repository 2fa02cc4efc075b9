"""`find_failure`: the whole way from a scenario with ranges to a small failure in a folder."""

from __future__ import annotations

from pathlib import Path

import irsim
from irsim.config.paths import path_of
from irsim.recording.output import make_folder
from irsim.types import Input
from irtrack.bench import Entry
from irtrack.bench.specs import entry
from irtrack.errors import InputError
from irtrack.falsify.apart import running
from irtrack.falsify.files import JOURNAL, check_outputs, clear, write_failure
from irtrack.falsify.hunt import FRESH, Failure, Hunt, Nearest, Progress, Say, check
from irtrack.falsify.kept import keep
from irtrack.falsify.order import in_order
from irtrack.falsify.rules import rules_of
from irtrack.falsify.trial import Subject
from irtrack.falsify.trials import Trials
from irtrack.types import Tracker


def find_failure(
    scenario: str | Path | irsim.Scenario,
    tracker: str | Tracker | Entry,
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
    say: Say = lambda line: None,
    progress: Progress | None = None,
) -> Failure | Nearest:
    """Search the ranges under `vary` for a scene in which the tracker breaks what the scenario expects.

    tracker   a spec (`irtrack.bench.specs`), a tracker or an entry
    folder    is made where it is not there. It gets a journal of all trials, by which the same call goes on where it
              was stopped, and of a failure minimal.yaml, minimal.mcap, replay.html and report.md
    search    'cma', 'sobol' or 'random', of at most `budget` runs after the benign point
    jobs      worker processes; what is found is the same for any number. With more than one, or with a limit, the
              calling script needs the guard ``if __name__ == "__main__"``
    seed      of the search; the scenes and the tracker have the scenario's own seed
    fresh     seeds that tell whether a failure is of the scene's structure or its luck; fewer are sooner, and tell less
    frame_limit_s   where given, the tracker runs in worker processes with one job too: one that takes longer for a
              frame, or whose process dies, is broken there as one that raises is
    name, command   of the scenario and the command line, for the report
    file      that the scenario was read from, where a loaded one is given: it must not be replaced
    keep_in   folder in which a failure is kept (`irtrack.falsify.kept`); None: nowhere
    say, progress   called with lines on what was found, and with (runs done, budget)

    Returns the failure made small, or what came nearest to one. InputError, before anything is run, where nothing
    varies, a word is wrong or the folder's files would replace the scenario's. KeyboardInterrupt is passed on when
    what was found by then is written.
    """
    folder = path_of(folder)
    if isinstance(scenario, irsim.Scenario):
        loaded, name = scenario, name or "scenario"
    else:
        loaded, name, file = irsim.load(scenario), name or Path(scenario).stem, irsim.find(scenario)
    check(loaded, name if file is None else str(file), search, budget, jobs, fresh)
    if frame_limit_s is not None and not frame_limit_s > 0:
        raise InputError(f"time limit {frame_limit_s:g} s: allowed: above 0")
    tried = entry(tracker)
    subject = Subject(tried.label, tried.tracker, input, rules_of(loaded))
    make_folder(folder)
    check_outputs(folder, file)
    clear(folder)
    with in_order(jobs) as apply, running(jobs, frame_limit_s) as runner:
        trials = Trials(subject, apply, folder / JOURNAL, runner, frame_limit_s)
        hunt = Hunt(loaded, subject, trials, say, fresh)
        try:
            found = hunt.run(search, budget, loaded.seed if seed is None else seed, progress)
        finally:
            if hunt.failure is not None:
                write_failure(folder, hunt, hunt.failure, name, command)
        if keep_in is not None and isinstance(found, Failure):
            (verdict,) = trials.verdicts([hunt.scene(found.least)])
            limit_s = verdict.limit_s if frame_limit_s is None else frame_limit_s
            say(f"kept: {keep(folder, subject, name, verdict.how, keep_in, limit_s).path}")
        return found
