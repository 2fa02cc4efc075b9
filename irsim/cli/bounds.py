"""Command `bounds`: Cramér-Rao bounds of target positions, as lines, CSV or Parquet."""

from __future__ import annotations

import csv
import shlex
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli.source_options import (
    FramesOption,
    OverridesArgument,
    SeedOption,
    SourceArgument,
    WithoutOption,
    from_option,
    part_names,
    warn_unheeded,
)
from irsim.cli.terminal import given_path, progress_bar
from irsim.errors import InputError, counted, parse_frame_range

if TYPE_CHECKING:
    from irsim.types import TargetBounds

ENDINGS = (".csv", ".parquet", ".pq")
"""Endings of tables."""

REGION = ("region_x", "region_y", "region_columns", "region_rows")
"""Columns of the region of the unknown background level."""


def bounds(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="CSV|PARQUET",
            help="Table to write, a row a frame and target; default: medians as lines.",
            parser=given_path,
        ),
    ] = None,
    target: Annotated[
        str | None, typer.Option(metavar="ID,...", help="Targets; default: all that come into view.")
    ] = None,
    frames: FramesOption = None,
    gate: Annotated[
        float, typer.Option(metavar="PX", help="Side of the search gate of errors predicted below d = 10, px.")
    ] = 21.0,
    start_error: Annotated[
        float | None,
        typer.Option(metavar="PX", help="Error of the start box on either axis, px: adds the bound of the sequence."),
    ] = None,
    clutter: Annotated[
        bool, typer.Option("--clutter", help="Add the bound in clutter as coloured Gaussian noise.")
    ] = False,
    pfa: Annotated[
        float, typer.Option(metavar="P", help="Probability of false alarm of the ideal matched filter.")
    ] = 1e-4,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Compute least position errors of targets, frame by frame.

    The bound is that of Cramér and Rao, with the detection probability of the ideal matched filter.
    """
    from irsim.calibration.measured_bounds import measured_bounds
    from irsim.config.paths import is_recording
    from irsim.recording.output import check_output
    from irsim.render.bounds import bounds as bounds_of
    from irsim.render.sources import open_rendering, open_source
    from irsim.scenario.catalog import find

    if not 0 < pfa < 1:
        raise InputError(f"--pfa {pfa:g}: allowed: between 0 and 1")
    names = None if target is None else _ids(target)
    wanted = None if frames is None else parse_frame_range(frames)
    given = None if wanted is None else (wanted.start, wanted.stop)
    opened = open_source(source) if is_recording(Path(source)) else None
    if opened is not None and opened.scenario_text is None:
        first, last = (0, None) if given is None else given
        _refuse_changes(source, overrides, seed, without, clutter, start_error)
        rows, sigma = measured_bounds(opened, names, first, last, gate)
        print(
            f"irsim: note: {source} holds no scenario: bounds from measured noise, sigma {sigma:.3g} counts, and a "
            "Gaussian spot fitted to each target",
            file=sys.stderr,
        )
        _put(rows, pfa, gate, clutter, output, find(source))
        return
    rendering, start, stop = open_rendering(source, overrides or (), seed, given, part_names(without))
    if output is not None:
        check_output(output, find(source), endings=ENDINGS)
    warn_unheeded(source, overrides, without)
    scenario = rendering.scenario
    with (
        progress_bar(f"bounds {rendering.name}", stop - start) as progress,
        from_option("--gate", "gate_px"),
        from_option("--start-error", "start_error_px"),
    ):
        rows = bounds_of(
            scenario,
            names,
            start,
            stop,
            gate_px=gate,
            clutter=clutter,
            start_error_px=start_error,
            progress=progress,
        )
    if start_error is not None:
        _note_missing(scenario, rows)
    _put(rows, pfa, gate, clutter, output, find(source))


def _put(
    rows: Sequence[TargetBounds], pfa: float, gate: float, clutter: bool, output: Path | None, source: Path
) -> None:
    """Print bounds as lines, or write them as a table."""
    from irsim.recording.output import check_output

    if output is None:
        for line in _lines(rows, pfa, gate, clutter):
            print(line)
    else:
        check_output(output, source, endings=ENDINGS)
        write_table(rows, pfa, output)
        print(output)


def _refuse_changes(source: str, *given: object) -> None:
    """Raise InputError for options that need a scenario."""
    if any(each not in (None, False, [], ()) for each in given):
        raise InputError(
            f"{source}: holds no scenario; allowed without: --frames, --target, --gate, --pfa and -o, for bounds from "
            "measured noise"
        )


def _ids(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise InputError(f"--target {text!r}: an id is empty; allowed: ids separated by commas")
    return names


def _note_missing(scenario: Any, rows: Sequence[TargetBounds]) -> None:
    """Print a note for each target without sequence bound."""
    from irsim.render.sequence_bound import no_sequence_bound

    for name in dict.fromkeys(row.target for row in rows):
        reason = no_sequence_bound(scenario, name)
        if reason is not None:
            print(f"irsim: note: target {name}: no bound of the sequence: {reason}", file=sys.stderr)


def _lines(rows: Sequence[TargetBounds], pfa: float, gate: float, clutter: bool) -> Iterator[str]:
    """Yield lines with medians over the frames of each target."""
    import numpy as np

    from irsim.render.interval_error import LEAST_D

    def median(part: Sequence[TargetBounds], x: str, y: str) -> str:
        pairs = [(getattr(row, x), getattr(row, y)) for row in part]
        known = [pair for pair in pairs if None not in pair]
        if not known:
            return "none"
        across, down = np.median(known, axis=0)
        return f"{across:.3g} x {down:.3g} px"

    for name in dict.fromkeys(row.target for row in rows):
        own = [row for row in rows if row.target == name]
        d = [row.d for row in own]
        faint = [row for row in own if row.d < LEAST_D]
        yield f"target     {name}: {counted(len(own), 'frame')}, medians"
        yield f"d          {np.median(d):.3g} ({min(d):.3g} to {max(d):.3g})"
        yield f"Pd         {np.median([_pd(row, pfa) for row in own]):.3g} at Pfa {pfa:g}"
        yield f"bound      {median(own, 'sd_x', 'sd_y')}"
        yield f"background {median(own, 'sd_x_background', 'sd_y_background')}, one unknown level around the target"
        if clutter:
            yield f"clutter    {median(own, 'sd_x_clutter', 'sd_y_clutter')}"
        if any(row.sd_x_sequence is not None for row in own):
            yield f"sequence   {median(own, 'sd_x_sequence', 'sd_y_sequence')}"
        if faint:
            where = f"in {counted(len(faint), 'frame')} with d below {LEAST_D:g}, gate {gate:g} px"
            yield f"predicted  {median(faint, 'predicted_x', 'predicted_y')} {where}"


def _pd(row: TargetBounds, pfa: float) -> float:
    from irsim.render.detectability import detection_probability

    return float(detection_probability(row.d**2, pfa))


def table_row(row: TargetBounds, pfa: float) -> dict[str, Any]:
    """Return the columns of a table: fields of the bounds, with the region in four columns, and Pd at Pfa."""
    from dataclasses import asdict

    values = asdict(row)
    region = dict(zip(REGION, values.pop("region"), strict=True))
    return {**values, **region, "pfa": pfa, "pd": _pd(row, pfa)}


def write_table(rows: Sequence[TargetBounds], pfa: float, path: Path) -> None:
    """Write bounds by the ending of the path: .csv, or .parquet or .pq. InputError without pyarrow."""
    from irsim.recording.output import atomic_file, atomic_text

    table = [table_row(row, pfa) for row in rows]
    names = list(table[0])
    if path.suffix.lower() == ".csv":
        with atomic_text(path) as file:
            writer = csv.DictWriter(file, names)
            writer.writeheader()
            writer.writerows(table)
        return
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        hint = shlex.quote("irtrack[parquet]")
        raise InputError(f"{path}: Parquet needs pyarrow: pip install {hint}; or name a .csv") from None
    integers = ("index", *REGION)
    kinds = {name: pyarrow.int64() if name in integers else pyarrow.float64() for name in names}
    schema = pyarrow.schema([(name, pyarrow.string() if name == "target" else kinds[name]) for name in names])
    with atomic_file(path) as file:
        parquet.write_table(pyarrow.Table.from_pylist(table, schema), file)
