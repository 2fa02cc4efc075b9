"""`irtrack regress`: suites against their baseline figures, and kept failures against their notes."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli import terminal
from irsim.errors import counted
from irtrack.cli.options import FRAME_LIMIT_S, AsJson, Jobs, Trust, argument
from irtrack.cli.output import number, print_json, print_table
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irtrack.bench import RunRecord
    from irtrack.bench.baseline import Change


def regress(
    places: Annotated[
        list[str], argument("SUITE|FOLDER...", "Suites with baseline figures, and folders of kept failures.")
    ],
    update: Annotated[
        bool, typer.Option("--update", help="Make the present results the baseline, and show the changes.")
    ] = False,
    jobs: Jobs = 1,
    trust: Trust = False,
    as_json: AsJson = False,
) -> None:
    """Compare suites with their baseline figures, and kept failures of irtrack falsify with their notes.

    Exit status 1 where a figure is worse, runs differ, or a kept failure has changed; 2 where one cannot be
    judged, with the reason.
    """
    found: list[dict[str, Any]] = []
    for word in places:
        place = Path(word)
        found.append((_failures if place.is_dir() else _figures)(place, update, jobs, trust))
        if not as_json:
            _print(found[-1], update)
    if as_json:
        print_json([{**each, "changes": list(map(_values, each["changes"]))} for each in found])
    if any(each["faults"] for each in found):
        raise typer.Exit(2)
    if not update and any(each["failed"] for each in found):
        raise typer.Exit(1)


def _figures(suite: Path, update: bool, jobs: int, trust: bool) -> dict[str, Any]:
    """Compare a suite with its baseline figures."""
    from irtrack.bench import is_suite, load_suite
    from irtrack.bench.baseline import baseline_file, changes, measure, read, write

    if not is_suite(str(suite)):
        raise InputError(f"{suite}: allowed: a suite (*suite*.yaml) or a folder of kept failures")
    loaded, path = load_suite(suite, trust), baseline_file(suite)
    old = {} if update and not path.exists() else read(path)
    failed: list[str] = []

    def note_failure(cell: RunRecord) -> None:
        if cell.failure is not None:
            where, *calls = cell.failure.strip().splitlines()
            failed.append(" ".join([f"irtrack: {cell.label} failed: {where}", *calls[-1:]]))

    with terminal.progress_bar("regress") as progress:
        new = measure(loaded, jobs, progress, FRAME_LIMIT_S, note_failure)
    if failed:
        print("\n".join(sorted(failed)), file=sys.stderr)
    found = changes(old, new)
    if update:
        write(new, path)
    worse = any(each.verdict != "better" for each in found)
    return {"place": str(suite), "checked": len(new), "failed": worse, "changes": found, "faults": []}


def _failures(folder: Path, update: bool, jobs: int, trust: bool) -> dict[str, Any]:
    """Judge the failures kept in a folder."""
    from irtrack.falsify import check_kept, kept_failures

    kept = kept_failures(folder, trust)
    if not kept:
        raise InputError(f"{folder}: holds no kept failure; allowed: a folder written by irtrack falsify --keep")
    found = check_kept(kept, jobs, update, FRAME_LIMIT_S)
    for line in (line for fault in found.faults for line in fault.splitlines()):
        print(f"irtrack: {line}", file=sys.stderr)
    return {
        "place": str(folder),
        "checked": len(kept) - len(found.faults),
        "failed": bool(found.changes),
        "changes": found.changes,
        "faults": found.faults,
    }


def _print(found: dict[str, Any], update: bool) -> None:
    changes: Sequence[Change | str] = found["changes"]
    kind = "failure" if Path(found["place"]).is_dir() else "run"
    if lines := [each for each in changes if isinstance(each, str)]:
        print("\n".join(lines))
    if rows := [_row(each) for each in changes if not isinstance(each, str)]:
        print_table(("source", "tracker", "seed", "figure", "baseline", "now", ""), rows, left=2)
    verdict = "failed" if found["failed"] else ("incomplete" if found["faults"] else "ok")
    not_judged = f", {len(found['faults'])} not judged" if found["faults"] else ""
    counts = f"{counted(found['checked'], kind)}, {counted(len(changes), 'change')}{not_judged}"
    print(f"{found['place']}: {'updated' if update else verdict}: {counts}")


def _row(change: Change) -> tuple[str, ...]:
    source, label, seed = change.run
    return source, label, str(seed), change.figure, number(change.old, ".4g"), number(change.new, ".4g"), change.verdict


def _values(change: Change | str) -> Any:
    return change if isinstance(change, str) else asdict(change)
