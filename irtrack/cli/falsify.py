"""`irtrack falsify`: search for a scene on which a tracker or detector fails."""

from __future__ import annotations

import sys
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli import terminal
from irsim.errors import counted
from irtrack.cli.options import (
    FRAME_LIMIT_S,
    AsJson,
    FrameLimit,
    InputName,
    Jobs,
    argument,
    command_line,
    input_name,
    option,
    path_option,
)
from irtrack.cli.output import print_json, warn_unused
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irtrack.bench import Entry
    from irtrack.falsify import Failure, NoFailure
    from irtrack.falsify.falsification import Falsification


def falsify(
    scenario: Annotated[str, argument("SCENARIO", "File or name of a scenario with `vary`.")],
    overrides: Annotated[
        list[str] | None, argument("KEY=VALUE", "Scenario overrides; an overridden key no longer varies.")
    ] = None,
    *,
    tracker: Annotated[
        str | None, option("NAME[:KEY=VALUE...]", "Tracker of one target or of many, from `irtrack list`.")
    ] = None,
    detector: Annotated[str | None, option("NAME[:KEY=VALUE...]", "Detector, in place of a tracker.")] = None,
    search: Annotated[str, option("cma|sobol|random", "Search: CMA-ES, Sobol points, or random points.")] = "cma",
    budget: Annotated[int, option("N", "Largest number of runs of the search.", min=1)] = 500,
    jobs: Jobs = 1,
    seed: Annotated[int | None, option("N", "Seed of the search; default: the scenario's own.", min=0)] = None,
    fresh: Annotated[
        int, option("N", "Fresh seeds, 5 or more, that tell structural from seed-dependent failures.")
    ] = 20,
    time_limit: FrameLimit = FRAME_LIMIT_S,
    input: InputName = "display",
    output: Annotated[Path | None, path_option("DIR", "Default: falsified/SCENARIO-TRACKER.", "-o", "--output")] = None,
    keep: Annotated[
        bool, typer.Option("--keep", help="Keep the failure in scenarios/regressions, for irtrack regress.")
    ] = False,
    explain: Annotated[
        bool, typer.Option("--explain", help="Name the cause of the loss in the smallest scene; takes longer.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Search the ranges of a scenario for a scene in which a tracker or detector breaks the expected rules.

    A failure is shrunk and written as minimal.yaml, minimal.mcap, replay.html and report.md; exit status 1.
    """
    from irsim import find, is_recording, load
    from irtrack.falsify import KEPT, NoFailure, find_failure
    from irtrack.falsify.outputs import JOURNAL, REPORT, file_stem
    from irtrack.report.finding import short, write_failure_report

    if is_recording(Path(scenario)):
        raise InputError(f"{scenario}: is a recording, in which nothing varies; allowed: a scenario with vary")
    loaded, tried = load(scenario, overrides or ()), _subject(tracker, detector)
    warn_unused([scenario], overrides or ())
    name, say = Path(scenario).stem, partial(print, file=sys.stderr if as_json else sys.stdout)

    def report(falsification: Falsification, failure: Failure, folder: Path) -> None:
        cause = _cause(falsification, failure) if explain else ""
        if cause:
            say(f"cause: {cause}")
        write_failure_report(falsification, failure, folder, cause)

    folder = output or Path("falsified") / file_stem(name, tried.label)
    try:
        with terminal.progress_bar(f"search {name}", budget) as progress:
            found = find_failure(
                loaded,
                tried,
                folder,
                search=search,
                budget=budget,
                jobs=jobs,
                seed=seed,
                fresh=fresh,
                frame_limit_s=time_limit,
                input=input_name(input),
                name=name,
                file=find(scenario),
                command=command_line(),
                keep_in=KEPT if keep else None,
                report=report,
                say=say,
                progress=progress,
            )
    except KeyboardInterrupt:
        known = f"all results so far are in {folder}, and the same command resumes there"
        nothing = "stopped before the end of the first trial: no results yet"
        raise terminal.StoppedError(f"stopped; {known}" if (folder / JOURNAL).exists() else nothing) from None
    if as_json:
        print_json({"scenario": name, "tracker": tried.label, "folder": str(folder), **_row(found)})
    elif isinstance(found, NoFailure):
        print(
            f"{tried.label} breaks no rule in {counted(found.runs, 'run')}; the least margin is {found.margin:.3g}, at"
        )
        for key, value in found.point.items():
            print(f"  {key}={short(value)}")
        for rule in found.untried:
            print(f"no run tests {rule}: its condition never occurs in these scenes")
    else:
        print(f"failure: {folder / REPORT}")
    if not isinstance(found, NoFailure):
        raise typer.Exit(1)


def _cause(falsification: Falsification, failure: Failure) -> str:
    """Return the cause of a loss in words, or the reason why there is none."""
    from irtrack.explain.explain import explain_failure

    try:
        return explain_failure(falsification, failure).brief()
    except InputError as error:
        return f"not explained: {error}"


def _subject(tracker: str | None, detector: str | None) -> Entry:
    """Return the entry of --tracker or --detector; InputError where not exactly one of them is given."""
    from irtrack.bench import parse_tracker_spec
    from irtrack.bench.spec import parse_detectors

    if tracker is not None and detector is None:
        return parse_tracker_spec(tracker)
    found = [] if tracker is not None or detector is None else parse_detectors(detector)
    if len(found) != 1:
        raise InputError("--tracker: allowed: one tracker, or one --detector in its place")
    return found[0]


def _row(found: Failure | NoFailure) -> dict[str, Any]:
    """Return plain values for JSON."""
    from irtrack.falsify import NoFailure

    if isinstance(found, NoFailure):
        return {"failure": None, **asdict(found)}
    sensitivities = {"found": found.sensitivity, "minimal": found.least_sensitivity}
    return {
        "failure": {
            "rule": found.rule,
            "run": found.run,
            "repeats": found.repeats,
            "found": dict(found.found.point),
            "minimal": dict(found.least.point),
            "without": list(found.least.without),
            "frames": found.least.frames,
            "fresh_seeds": {
                when: {"broken": each.broken, "seeds": each.seeds, "structural": each.is_structural}
                for when, each in sensitivities.items()
                if each is not None
            },
        }
    }
