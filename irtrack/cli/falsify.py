"""`irtrack falsify`: the search for a scene that breaks a tracker."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli import terminal
from irsim.cli.terminal import given_path
from irsim.errors import counted
from irtrack.cli.options import FRAME_LIMIT_S, AsJson, FrameLimit, InputName, Jobs, command_line, input_name
from irtrack.cli.output import print_json, tell_unheeded
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irtrack.falsify import Failure, Nearest


def falsify(
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="A scenario's file or name, with `vary`.")],
    overrides: Annotated[
        list[str] | None,
        typer.Argument(metavar="KEY=VALUE", help="Changes to the scenario; a key so given varies no more."),
    ] = None,
    *,
    tracker: Annotated[
        str, typer.Option(metavar="NAME[:KEY=VALUE...]", help="A name from `irtrack list` with its parameters.")
    ],
    search: Annotated[
        str, typer.Option(metavar="cma|sobol|random", help="How: down the slope, evenly, or by chance.")
    ] = "cma",
    budget: Annotated[int, typer.Option(metavar="N", min=1, help="Runs of the search, at most.")] = 500,
    jobs: Jobs = 1,
    seed: Annotated[
        int | None, typer.Option(metavar="N", min=0, help="Seed of the search; the scenario's own unless said.")
    ] = None,
    fresh: Annotated[
        int,
        typer.Option(
            metavar="N", help="Fresh seeds, 5 or more, that tell structure from luck; fewer are sooner, and tell less."
        ),
    ] = 20,
    time_limit: FrameLimit = FRAME_LIMIT_S,
    input: InputName = "display",
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Default: falsified/SCENARIO-TRACKER.", parser=given_path),
    ] = None,
    keep: Annotated[
        bool, typer.Option("--keep", help="Keep the failure in scenarios/regressions, for irtrack regress.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Search the ranges of a scenario for a scene in which a tracker breaks what is expected of it.

    Exit status 1 where one is found: made small, as minimal.yaml, minimal.mcap and report.md.
    """
    from irsim import find, is_recording, load
    from irtrack.bench import parse_tracker_spec
    from irtrack.falsify import KEPT, Nearest, find_failure
    from irtrack.falsify.files import JOURNAL, file_stem, short

    if is_recording(Path(scenario)):
        raise InputError(f"{scenario}: is a recording, where nothing varies; allowed: a scenario with vary")
    loaded, tried = load(scenario, overrides or ()), parse_tracker_spec(tracker)
    tell_unheeded([scenario], overrides or ())
    name = Path(scenario).stem
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
                say=lambda line: print(line, file=sys.stderr if as_json else sys.stdout),
                progress=progress,
            )
    except KeyboardInterrupt:
        known = f"what is known is in {folder}, and the same command goes on from there"
        nothing = "stopped before the first trial was done: nothing is known yet"
        raise terminal.StoppedError(f"stopped; {known}" if (folder / JOURNAL).exists() else nothing) from None
    if as_json:
        print_json({"scenario": name, "tracker": tried.label, "folder": str(folder), **_row(found)})
    elif isinstance(found, Nearest):
        print(
            f"{tried.label} breaks nothing in {counted(found.runs, 'run')}; the least margin is {found.margin:.3g}, at"
        )
        for key, value in found.point.items():
            print(f"  {key}={short(value)}")
        for rule in found.untried:
            print(f"no run puts {rule} to the test: nothing that it speaks of happens in these scenes")
    else:
        print(f"failure: {folder / 'report.md'}")
    if not isinstance(found, Nearest):
        raise typer.Exit(1)


def _row(found: Failure | Nearest) -> dict[str, Any]:
    """Plain values for JSON."""
    from irtrack.falsify import Nearest

    if isinstance(found, Nearest):
        return {"failure": None, **asdict(found)}
    lucks = {"found": found.luck, "minimal": found.least_luck}
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
                when: {"broken": luck.broken, "seeds": luck.seeds, "structural": luck.is_structural}
                for when, luck in lucks.items()
                if luck is not None
            },
        }
    }
