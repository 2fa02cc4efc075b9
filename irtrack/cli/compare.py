"""`irtrack compare`: old results against new ones, for people and for CI."""

from __future__ import annotations

import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli import terminal
from irsim.cli.terminal import given_path
from irsim.errors import counted
from irsim.recording.output import atomic_text, check_output
from irtrack.cli.options import FRAME_LIMIT_S, AsJson, Jobs, names
from irtrack.cli.output import number, print_json, print_table
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irtrack.bench.compare import Comparison


def compare(
    old: Annotated[str, typer.Argument(metavar="OLD", help="A results file, or a tracker's label.")],
    new: Annotated[str, typer.Argument(metavar="NEW", help="Another file, or another label of the same file.")],
    results: Annotated[
        Path, typer.Option(metavar="DB", help="The results file that labels are looked up in.", parser=given_path)
    ] = Path("irtrack.db"),
    metrics: Annotated[
        str | None, typer.Option(metavar="METRIC,...", help="What to compare; the usual figures unless said.")
    ] = None,
    fail_if_worse: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC:MARGIN",
            help="Exit with 1 where this figure is worse by more than the margin, beyond its interval. Repeatable.",
        ),
    ] = None,
    junit_file: Annotated[
        Path | None,
        typer.Option(
            "--junit", metavar="XML", help="Write the --fail-if-worse checks as JUnit XML.", parser=given_path
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare two results files, or two trackers of one, run by run on the same scenes."""
    inputs = [Path(name) for name in (old, new) if Path(name).exists()] or [results]
    check_output(junit_file, *inputs, endings=(".xml",))
    from irtrack.bench.compare import USUAL, Gate, cells_of, in_words, junit, under_one_label
    from irtrack.bench.compare import compare as compare_cells

    gates = [Gate.parse(text) for text in fail_if_worse or ()]
    asked = names("--metrics", metrics) or USUAL
    figures = list(dict.fromkeys([*asked, *(gate.figure for gate in gates)]))
    if Path(old).exists() and Path(new).exists():
        before, after = cells_of(old), cells_of(new)
    else:
        pair = f"{old} -> {new}"
        before, after = (under_one_label(cells_of(results, label), pair) for label in (old, new))
    found = compare_cells(before, after, figures)
    failed = [each for gate in gates for each in gate.failures(found)]
    if junit_file is not None:
        with atomic_text(junit_file) as file:
            file.write(junit(found, gates))
    if as_json:
        print_json([_row(each) for each in found])
    else:
        head = ["source", "tracker", "figure", "old", "new", "difference", "95 % interval", "pairs", "verdict"]
        print_table(head, [_texts(each) for each in found], left=3)
    for each in failed:
        typer.echo(f"irtrack: {in_words(each)}", err=True)
    for gate in gates:
        for doubt in gate.doubts(found):
            typer.echo(f"irtrack: {doubt}", err=True)
    if failed:
        raise typer.Exit(1)
    for gate in gates:
        gate.check_told(found)


def _row(each: Comparison) -> dict[str, Any]:
    """Plain values for JSON; an interval without an end has none there."""
    d = each.difference
    return {
        "source": each.source,
        "label": each.label,
        "figure": each.figure,
        "old": each.old,
        "new": each.new,
        "difference": d.mean,
        "low": d.low if math.isfinite(d.low) else None,
        "high": d.high if math.isfinite(d.high) else None,
        "pairs": d.pairs,
        "scenes": d.scenes,
        "verdict": each.verdict,
    }


def _texts(each: Comparison) -> list[str]:
    d = each.difference
    figures = [f"{each.old:.4g}", f"{each.new:.4g}", f"{d.mean:+.3g}", f"{d.low:.3g} .. {d.high:.3g}", str(d.pairs)]
    return [each.source, each.label, each.figure, *figures, each.verdict]


if TYPE_CHECKING:
    from collections.abc import Sequence

    from irtrack.bench import RunRecord
    from irtrack.bench.baseline import Change


def regress(
    places: Annotated[
        list[str],
        typer.Argument(metavar="SUITE|FOLDER...", help="Suites with a baseline, and folders of kept failures."),
    ],
    update: Annotated[
        bool,
        typer.Option("--update", help="Take the present outcomes as the baseline, and show the changes."),
    ] = False,
    jobs: Jobs = 1,
    as_json: AsJson = False,
) -> None:
    """Measure suites against their baselines, and try failures that irtrack falsify has kept.

    Exit status 1 where a figure is worse, runs are not the same ones, or a kept failure is not as it was; 2 where one
    could not be judged, with a line that says why.
    """
    found: list[dict[str, Any]] = []
    for word in places:
        place = Path(word)
        found.append(_failures(place, update, jobs) if place.is_dir() else _figures(place, update, jobs))
        if not as_json:
            _print(found[-1], update)
    if as_json:
        print_json([{**each, "changes": list(map(_values, each["changes"]))} for each in found])
    if any(each["faults"] for each in found):
        raise typer.Exit(2)
    if not update and any(each["failed"] for each in found):
        raise typer.Exit(1)


def _figures(suite: Path, update: bool, jobs: int) -> dict[str, Any]:
    """Return the comparison of a suite with its baseline."""
    from irtrack.bench import is_suite, load_suite
    from irtrack.bench.baseline import baseline_file, changes, measure, read, write

    if not is_suite(str(suite)):
        raise InputError(f"{suite}: allowed: a suite (*suite*.yaml) or a folder of kept failures")
    loaded, path = load_suite(suite), baseline_file(suite)
    old = {} if update and not path.exists() else read(path)
    failed: list[str] = []

    def tell(cell: RunRecord) -> None:
        if cell.failure is not None:
            where, *calls = cell.failure.strip().splitlines()
            failed.append(" ".join([f"irtrack: {cell.label} failed: {where}", *calls[-1:]]))

    with terminal.progress_bar("regress") as progress:
        new = measure(loaded, jobs, progress, FRAME_LIMIT_S, tell)
    if failed:
        print("\n".join(sorted(failed)), file=sys.stderr)
    found = changes(old, new)
    if update:
        write(new, path)
    worse = any(each.verdict != "better" for each in found)
    return {"place": str(suite), "checked": len(new), "failed": worse, "changes": found, "faults": []}


def _failures(folder: Path, update: bool, jobs: int) -> dict[str, Any]:
    """The failures kept in a folder."""
    from irtrack.falsify import kept_failures, revisit

    kept = kept_failures(folder)
    if not kept:
        raise InputError(f"{folder}: holds no kept failure; allowed: a folder that irtrack falsify --keep has filled")
    found = revisit(kept, jobs, update, FRAME_LIMIT_S)
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
    if rows := [_row_regress(each) for each in changes if not isinstance(each, str)]:
        print_table(("source", "tracker", "seed", "figure", "baseline", "now", ""), rows, left=2)
    verdict = "failed" if found["failed"] else ("incomplete" if found["faults"] else "ok")
    not_judged = f", {len(found['faults'])} not judged" if found["faults"] else ""
    counts = f"{counted(found['checked'], kind)}, {counted(len(changes), 'change')}{not_judged}"
    print(f"{found['place']}: {'updated' if update else verdict}: {counts}")


def _row_regress(change: Change) -> tuple[str, ...]:
    source, label, seed = change.run
    return source, label, str(seed), change.figure, number(change.old, ".4g"), number(change.new, ".4g"), change.verdict


def _values(change: Change | str) -> Any:
    return change if isinstance(change, str) else asdict(change)
