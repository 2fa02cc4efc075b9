"""`irtrack regress`: is everything as it was?"""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli import terminal
from irsim.errors import counted
from irtrack.cli.options import FRAME_LIMIT_S, AsJson, Jobs
from irtrack.cli.output import number, print_json, print_table
from irtrack.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from irtrack.bench import Cell
    from irtrack.bench.baseline import Change


def regress(
    places: Annotated[
        list[str],
        typer.Argument(metavar="SUITE|FOLDER...", help="Suites with golden figures, and folders of kept failures."),
    ],
    bless: Annotated[
        bool, typer.Option("--bless", help="Take what is so now as what should be, and show what changes by it.")
    ] = False,
    jobs: Jobs = 1,
    as_json: AsJson = False,
) -> None:
    """Measure suites beside their golden figures, and try failures that irtrack falsify has kept.

    Exit status 1 where a figure is worse, runs are not the same ones, or a kept failure is not as it was; 2 where one
    could not be judged, with a line that says why.
    """
    found: list[dict[str, Any]] = []
    for word in places:
        place = Path(word)
        found.append(_failures(place, bless, jobs) if place.is_dir() else _figures(place, bless, jobs))
        if not as_json:
            _print(found[-1], bless)
    if as_json:
        print_json([{**each, "changes": list(map(_values, each["changes"]))} for each in found])
    if any(each["faults"] for each in found):
        raise typer.Exit(2)
    if not bless and any(each["failed"] for each in found):
        raise typer.Exit(1)


def _figures(suite: Path, bless: bool, jobs: int) -> dict[str, Any]:
    """A suite beside its golden figures."""
    from irtrack.bench import is_suite, load_suite
    from irtrack.bench.baseline import changes, golden_file, measure, read, write

    if not is_suite(str(suite)):
        raise InputError(f"{suite}: allowed: a suite (*suite*.yaml) or a folder of kept failures")
    loaded, path = load_suite(suite), golden_file(suite)
    old = {} if bless and not path.exists() else read(path)
    failed: list[str] = []

    def tell(cell: Cell) -> None:
        if cell.failure is not None:
            where, *calls = cell.failure.strip().splitlines()
            failed.append(" ".join([f"irtrack: {cell.label} failed: {where}", *calls[-1:]]))

    with terminal.progress_bar("regress") as progress:
        new = measure(loaded, jobs, progress, FRAME_LIMIT_S, tell)
    if failed:
        print("\n".join(sorted(failed)), file=sys.stderr)
    found = changes(old, new)
    if bless:
        write(new, path)
    worse = any(each.verdict != "better" for each in found)
    return {"place": str(suite), "checked": len(new), "failed": worse, "changes": found, "faults": []}


def _failures(folder: Path, bless: bool, jobs: int) -> dict[str, Any]:
    """The failures kept in a folder."""
    from irtrack.falsify import kept_failures, revisit

    kept = kept_failures(folder)
    if not kept:
        raise InputError(f"{folder}: holds no kept failure; allowed: a folder that irtrack falsify --keep has filled")
    found = revisit(kept, jobs, bless, FRAME_LIMIT_S)
    for line in (line for fault in found.faults for line in fault.splitlines()):
        print(f"irtrack: {line}", file=sys.stderr)
    return {
        "place": str(folder),
        "checked": len(kept) - len(found.faults),
        "failed": bool(found.changes),
        "changes": found.changes,
        "faults": found.faults,
    }


def _print(found: dict[str, Any], bless: bool) -> None:
    changes: Sequence[Change | str] = found["changes"]
    kind = "failure" if Path(found["place"]).is_dir() else "run"
    if lines := [each for each in changes if isinstance(each, str)]:
        print("\n".join(lines))
    if rows := [_row(each) for each in changes if not isinstance(each, str)]:
        print_table(("source", "tracker", "seed", "figure", "golden", "now", ""), rows, left=2)
    verdict = "failed" if found["failed"] else ("incomplete" if found["faults"] else "ok")
    not_judged = f", {len(found['faults'])} not judged" if found["faults"] else ""
    counts = f"{counted(found['checked'], kind)}, {counted(len(changes), 'change')}{not_judged}"
    print(f"{found['place']}: {'blessed' if bless else verdict}: {counts}")


def _row(change: Change) -> tuple[str, ...]:
    source, label, seed = change.run
    return source, label, str(seed), change.figure, number(change.old, ".4g"), number(change.new, ".4g"), change.verdict


def _values(change: Change | str) -> Any:
    return change if isinstance(change, str) else asdict(change)
