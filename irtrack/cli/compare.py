"""`irtrack compare`: old results against new ones, for people and for CI."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irtrack.cli.options import AsJson, argument, names, option, path_option
from irtrack.cli.output import print_json, print_table

if TYPE_CHECKING:
    from irtrack.bench.compare import Comparison


def compare(
    old: Annotated[str, argument("OLD", "Results file, or label of a tracker.")],
    new: Annotated[str, argument("NEW", "Results file, or label, to compare with it.")],
    results: Annotated[Path, path_option("DB", "Results file of the labels.")] = Path("irtrack.db"),
    metrics: Annotated[str | None, option("METRIC,...", "Figures to compare; default: the usual ones.")] = None,
    fail_if_worse: Annotated[
        list[str] | None,
        option(
            "METRIC:MARGIN",
            "Exit status 1 where this figure is worse by more than the margin, outside its interval. Repeatable.",
        ),
    ] = None,
    junit_file: Annotated[
        Path | None, path_option("XML", "Write the --fail-if-worse checks as JUnit XML.", "--junit")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare two results files, or two trackers of one file, run by run on the same scenes."""
    from irsim.recording.output import atomic_text, check_output

    inputs = [Path(name) for name in (old, new) if Path(name).exists()] or [results]
    check_output(junit_file, *inputs, endings=(".xml",))
    from irtrack.bench.compare import USUAL, Gate, cells_of, in_words, junit, under_one_label
    from irtrack.bench.compare import compare as compare_cells

    gates = [Gate.parse(text) for text in fail_if_worse or ()]
    chosen = names("--metrics", metrics) or USUAL
    figures = list(dict.fromkeys([*chosen, *(gate.figure for gate in gates)]))
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
        gate.require_enough(found)


def _row(each: Comparison) -> dict[str, Any]:
    """Return plain values for JSON; None for an infinite end of the interval."""
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
