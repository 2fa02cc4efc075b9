"""`irtrack stress`: breaking points of trackers for each cause of failure."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from irtrack.cli.bench import check_results, end_by_failures, sweep
from irtrack.cli.options import TRACKERS, TRACKERS_HELP, AsJson, GrowingResults, Jobs, argument, names, option
from irtrack.cli.output import NOTHING, number, print_json, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from irtrack.report import SeverityFigures


def stress(
    trackers: Annotated[str, argument(TRACKERS, TRACKERS_HELP)],
    seeds: Annotated[int, option("N", "Seeds 0 to N-1, of scene and tracker.", min=1)] = 30,
    only: Annotated[str | None, option("CAUSE,...", "Only these causes; default: all.")] = None,
    suite: Annotated[
        str | None, option("SUITE", "Sources of this suite, at its severities, instead of the causes.")
    ] = None,
    jobs: Jobs = 1,
    results: GrowingResults = Path("stress.db"),
    as_json: AsJson = False,
) -> None:
    """Run trackers over nine causes of failure at severities 0 to 5; print the lost runs and breaking points."""
    from irtrack.bench import parse_trackers
    from irtrack.bench.suite import STRESS_SUITE, stress_suite
    from irtrack.report import severity_figures, severity_values

    check_results(results)
    chosen = names("--only", only) or ()
    cells = sweep(
        stress_suite(parse_trackers(trackers), seeds, chosen, STRESS_SUITE if suite is None else suite), results, jobs
    )
    figures = severity_figures(cells)
    if as_json:
        print_json({"results": str(results), "causes": [severity_values(each) for each in figures]})
    else:
        _print(figures)
        print(f"results: {results}    next: {shlex.join(['irtrack', 'report', str(results)])}")
    end_by_failures(cells)


def _print(figures: Sequence[SeverityFigures]) -> None:
    """Print a row for each cause of failure and tracker: share of lost runs at each severity, and breaking point."""
    severities = sorted({s for each in figures for point in each.breaking.values() for s in point.severities.tolist()})
    rows = []
    for each in figures:
        for label, point in each.breaking.items():
            shares = dict(zip(point.severities.tolist(), point.shares.tolist(), strict=True))
            lost = [number(shares[s], ".0%") if s in shares else NOTHING for s in severities]
            rows.append((each.family, label, *lost, point.in_words()))
    print_table(("cause", "tracker", *(f"{s:g}" for s in severities), "half lost at"), rows, left=2)
    span = f"{severities[0]:g} to {severities[-1]:g}"
    print(f"{span}: share of runs lost or failed; half lost at: severity at which half are lost, with 95 % interval")
