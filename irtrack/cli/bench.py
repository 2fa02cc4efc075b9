"""`irtrack bench` and `irtrack export`: trackers over sources with many seeds."""

from __future__ import annotations

import math
import shlex
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli import terminal
from irsim.errors import counted
from irtrack.cli.options import (
    TRACKERS,
    TRACKERS_HELP,
    AsJson,
    FilledResults,
    GrowingResults,
    Jobs,
    Trust,
    argument,
    auto_detector,
    command_line,
    input_name,
    option,
    path_option,
)
from irtrack.cli.output import Tally, print_bounds, print_breaking, print_json, print_summary, print_tasks, warn_unused
from irtrack.errors import InputError, IrtrackError, WorkerError

if TYPE_CHECKING:
    from irtrack.bench import Entry, Results, RunRecord, Suite
    from irtrack.bench.bounds import BoundRow
    from irtrack.bench.spec import SourceSpec


@dataclass(frozen=True)
class SourceArguments:
    """Arguments of the bench: (label or None, source) of each source, and KEY=VALUE overrides of all scenarios."""

    sources: tuple[tuple[str | None, str], ...]
    changes: tuple[str, ...]


def read_words(words: Sequence[str]) -> SourceArguments:
    """Divide the arguments into sources and overrides; an override is a scenario key, `=`, and a value that names no
    file."""
    from irsim import Scenario

    sources: list[tuple[str | None, str]] = []
    changes: list[str] = []
    for word in words:
        before, equals, behind = word.partition("=")
        if not equals or Path(word).exists():
            sources.append((None, word))
        elif before.partition(".")[0] in Scenario.model_fields and not Path(behind).exists():
            changes.append(word)
        else:
            sources.append((before, behind))
    seeds = [change for change in changes if change.startswith("seed=")]
    if seeds:
        raise InputError(f"{seeds[0]}: a bench sets the seeds of scenes; allowed: --seeds N")
    if not sources:
        raise InputError(f"{' '.join(changes)}: no source; allowed: at least one scenario or recording")
    return SourceArguments(tuple(sources), tuple(changes))


def suite_of(
    words: SourceArguments,
    trackers: str | None,
    severities: str | None,
    detectors: str | None = None,
    trust: bool = False,
) -> Suite:
    """Return the suite to run, from a suite file or from sources and options."""
    from irtrack.bench import Suite, is_suite, load_suite

    suites = [word for _, word in words.sources if is_suite(word)]
    if suites and len(words.sources) > 1:
        raise InputError(f"{suites[0]}: is a suite (by its name); allowed: one suite alone, or no suite")
    if suites:
        if words.changes:
            raise InputError(f"{words.changes[0]}: {suites[0]} has its own changes, under the key `changes`")
        if severities is not None:
            raise InputError(f"--severities {severities}: {suites[0]} has its own severities")
        suite = load_suite(suites[0], trust or trackers is not None or detectors is not None)
        if trackers is None and detectors is None:
            return suite
        return replace(suite, trackers=_entries(trackers, detectors))
    levels = _severities(severities)
    opened = [each for label, word in words.sources for each in _specs(label, word, words.changes, levels)]
    if trackers is None and detectors is None:
        raise InputError(
            "--trackers: is missing; allowed: names of irtrack list, e.g. --trackers grey_pf,kalman, or --detectors"
        )
    return Suite("", opened, _entries(trackers, detectors), 10, 1, "display", None)


def _entries(trackers: str | None, detectors: str | None) -> list[Entry]:
    from irtrack.bench.spec import parse_detectors, parse_trackers

    found = parse_trackers(trackers) if trackers is not None else []
    return found + (parse_detectors(detectors) if detectors is not None else [])


def _specs(label: str | None, word: str, changes: Sequence[str], levels: Any) -> list[SourceSpec]:
    """Return the specs of a source; InputError where the source is missing or an override is wrong."""
    from irsim import Scenario
    from irsim.config.base import suggestion
    from irtrack.bench import SourceEntry
    from irtrack.bench.spec import source_specs

    try:
        return list(source_specs(SourceEntry(word, changes, severities=levels, name=label)))
    except InputError as error:
        if label is None or Path(word).exists():
            raise
        raise InputError(
            f"{label}={word}: {error}; KEY=VALUE sets scenario keys; tracker parameters: --trackers "
            f"NAME:KEY=VALUE{suggestion(label, Scenario.model_fields)}"
        ) from None


def _severities(text: str | None) -> Any:
    if text is None or text == "all":
        return text or ()
    try:
        return tuple(int(word) for word in text.split(","))
    except ValueError:
        raise InputError(f"--severities {text}: allowed: all, or whole numbers such as 0,3,5") from None


def bench(
    sources: Annotated[
        list[str],
        argument(
            "SUITE|[LABEL=]SCENARIO|REC... [KEY=VALUE...]",
            "A suite (*suite*.yaml), or scenarios (files or names) and recordings; LABEL: name in tables. "
            "KEY=VALUE overrides keys of all scenarios.",
        ),
    ],
    trackers: Annotated[str | None, option(TRACKERS, TRACKERS_HELP)] = None,
    detectors: Annotated[
        str | None, option(TRACKERS, "Detectors by name, as trackers: tophat,mpcm:threshold=6; Pd and false alarms.")
    ] = None,
    seeds: Annotated[
        int | None, option("N", "Seeds 0 to N-1, of scene and tracker; default: 10, or the suite's.", min=1)
    ] = None,
    tracker_seeds: Annotated[
        int | None, option("M", "Run each scene M times with different tracker seeds.", min=1)
    ] = None,
    severities: Annotated[str | None, option("all|N,...", "Run scenarios at these severities.")] = None,
    jobs: Jobs = 1,
    scheduler: Annotated[
        str | None, option("ADDRESS", "Run on the workers of a dask scheduler, tcp://HOST:PORT.")
    ] = None,
    time_limit: Annotated[
        float | None, option("S", "Time limit for a run, not counting rendering; a run that exceeds it fails.")
    ] = None,
    results: GrowingResults = Path("irtrack.db"),
    target: Annotated[str | None, option("ID", "Target to follow in every source; default: each source's own.")] = None,
    start: Annotated[
        str | None,
        option("auto[:DETECTOR]", "Start trackers of one target at the first confirmed track of gnn on a detector."),
    ] = None,
    input: Annotated[
        str | None, option("display|counts", "Input of trackers; default: display, or the suite's.", "--input")
    ] = None,
    with_bounds: Annotated[bool, typer.Option("--bounds", help="Compare errors with their Cramer-Rao bound.")] = False,
    check: Annotated[bool, typer.Option("--check", help="Print the number of runs, and run nothing.")] = False,
    trust: Trust = False,
    as_json: AsJson = False,
) -> None:
    """Run trackers over sources with many seeds; print the ranked table and the path of the results."""
    words = read_words(sources)
    check_results(results, *(Path(source) for _, source in words.sources))
    from irtrack.bench import Results, summary
    from irtrack.bench.task_summary import task_breaking, task_summary

    suite = suite_of(words, trackers, severities, detectors, trust)
    warn_unused([source for _, source in words.sources], words.changes)
    given: dict[str, Any] = {
        "seeds": seeds,
        "tracker_seeds": tracker_seeds,
        "time_limit_s": time_limit,
        "input": None if input is None else input_name(input),
    }
    suite = replace(suite, **{key: value for key, value in given.items() if value is not None})
    if check:
        print(_plan(suite))
        return
    if start is not None:
        auto_detector(start, None, target)
    cells = sweep(suite, results, jobs, scheduler, target, start)
    rows, tasks = summary(cells), task_summary(cells)
    with Results(results) as kept:
        breaking = task_breaking(cells, kept.sources())
        bounds = _bounds(kept, cells) if with_bounds else []
    if as_json:
        every = [*(row.as_dict() for row in rows), *(row.as_dict() for row in tasks)]
        broken = {"breaking": [each.as_dict() for each in breaking]} if breaking else {}
        bounded = {"bounds": [each.as_dict() for each in bounds]} if bounds else {}
        print_json({"results": str(results), "rows": every} | broken | bounded)
    else:
        if rows:
            print_summary(rows)
        print_bounds(bounds)
        print_tasks(tasks)
        print_breaking(breaking)
        print(f"results: {results}    next: {shlex.join(['irtrack', 'report', str(results)])}")
    end_by_failures(cells)


def _bounds(results: Results, cells: Sequence[RunRecord]) -> list[BoundRow]:
    """Compute the bounds that the results file lacks; return the errors of the runs against them. Print a note for each
    source without bounds."""
    from irtrack.bench.bounds import bound_rows, compute_bounds

    with terminal.progress_bar("bounds") as progress:
        notes = compute_bounds(results, cells, progress)
    for note in notes:
        print(f"irtrack: note: {note}", file=sys.stderr)
    return bound_rows(results, cells)


def check_results(path: Path, *inputs: Path) -> None:
    """Raise InputError where no results file can be written: see `irsim.recording.output.check_output`."""
    from irsim.recording.output import check_output

    check_output(path, *inputs, endings=(".db", ".sqlite", ".sqlite3"))


def sweep(
    suite: Suite,
    results: Path,
    jobs: int,
    scheduler: str | None = None,
    target: str | None = None,
    start: str | None = None,
) -> list[RunRecord]:
    """Run a suite with a progress line; return this suite's runs, not all runs of the file. Ctrl-C ends the command."""
    from irtrack.bench import cluster, run_bench

    tally = Tally()
    try:
        with ExitStack() as stack:
            executor = None if scheduler is None else stack.enter_context(cluster(scheduler))
            # An infinite limit makes trackers run in worker processes, so that a crash does not end the command.
            apart = None if executor is not None else math.inf
            progress = stack.enter_context(terminal.progress_bar("bench"))

            def count(done: int, total: int) -> None:
                tally.done = done
                progress(done, total, tally.worst())

            kept = run_bench(
                suite.sources,
                suite.trackers,
                results=results,
                seeds=suite.seeds,
                tracker_seeds=suite.tracker_seeds,
                jobs=jobs,
                executor=executor,
                time_limit_s=suite.time_limit_s or apart,
                input=suite.input,
                target=target,
                init=start,
                command=command_line(),
                progress=count,
                seen=tally.see,
            )
    except KeyboardInterrupt:
        raise terminal.StoppedError(f"stopped; {_kept(tally, results)}") from None
    except WorkerError as error:
        raise IrtrackError(f"{error}; {_kept(tally, results)}") from None
    with kept:
        return kept.cells(run=kept.run)


def _kept(tally: Tally, results: Path) -> str:
    return f"{counted(tally.done, 'run')} of this call kept in {results}; the same command resumes"


def end_by_failures(cells: Sequence[RunRecord]) -> None:
    """Exit with status 1 where a run failed."""
    failed = sum(cell.status == "failed" for cell in cells)
    if failed:
        print(f"irtrack: {failed} of {counted(len(cells), 'run')} failed; the report has the reasons", file=sys.stderr)
        raise typer.Exit(1)


def export(
    results: FilledResults,
    output: Annotated[Path, path_option("CSV|PARQUET", "File that ends in .csv or .parquet.", "-o", "--output")],
) -> None:
    """Write a table with one row for each run of a results file, and print its path."""
    from irtrack.bench import export as export_results

    print(export_results(results, output))


def _plan(suite: Suite) -> str:
    counts = [
        counted(len(suite.sources), "source"),
        counted(len(suite.trackers), "tracker"),
        counted(suite.seeds, "seed"),
        *([counted(suite.tracker_seeds, "tracker seed")] if suite.tracker_seeds > 1 else []),
    ]
    runs = len(suite.sources) * len(suite.trackers) * suite.seeds * suite.tracker_seeds
    return f"ok: {' x '.join(counts)} = {counted(runs, 'run')}"
