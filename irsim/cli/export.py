"""The command `irsim export`: data sets in the formats of other programs."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from irsim.cli.source_options import from_option
from irsim.cli.terminal import StoppedError, given_path, progress_bar
from irsim.config.paths import is_there
from irsim.errors import InputError


def export(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO|REC|SUITE|KEY=VALUE",
            help="Scenarios, recordings and suites, by file or shipped name; overrides of all scenarios.",
        ),
    ],
    format: Annotated[
        str,
        typer.Option(metavar="NAME", help="coco, yolo, mot, vot, anti-uav, sirst, png, npz, mp4, rrd or ros2."),
    ],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="DIR", help="New or empty folder to write.", parser=given_path),
    ],
    seeds: Annotated[
        int | None,
        typer.Option(metavar="N", help="Scenes with seeds 0 to N-1; default: the scenario's seed, a suite's number."),
    ] = None,
    frames: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="The first N frames of each clip; default: all.")
    ] = None,
    split: Annotated[
        str | None,
        typer.Option(metavar="A,B[,C]", help="Shares for train, val and test, by scene and seed; default: no split."),
    ] = None,
    min_visible: Annotated[float, typer.Option(metavar="F", help="Least visible fraction of a labelled target.")] = 0.1,
    input: Annotated[
        str | None,
        typer.Option(
            metavar="display|counts",
            help="8-bit pictures, or 16-bit counts; default: counts for png, npz and ros2, else display.",
        ),
    ] = None,
    jobs: Annotated[int, typer.Option(metavar="N", min=1, help="Number of processes that render and write.")] = 1,
) -> None:
    """Write a data set for training or tests, with labels, masks, splits and a card.

    card.json lists the clips that are whole, also after an error or Ctrl-C.
    """
    from irsim.datasets import CARD, export_dataset

    overrides = [word for word in words if "=" in word and not is_there(word)]
    sources = [word for word in words if word not in overrides]
    command = shlex.join(["irsim", *sys.argv[1:]])
    try:
        with (
            from_option("--format", "format"),
            from_option("--split", "split"),
            from_option("--min-visible", "min_visible"),
            from_option("--seeds", "seeds"),
            from_option("--input", "input"),
            progress_bar(f"export {format}") as progress,
        ):
            export_dataset(
                *(sources, output, format, seeds, _shares(split), min_visible, jobs),
                input=input,  # type: ignore[arg-type]  # checked there
                overrides=overrides,
                command=command,
                progress=progress,
                frames=frames,
            )
    except KeyboardInterrupt:
        if not (output / CARD).exists():
            raise
        raise StoppedError(f"stopped; {output / CARD} lists the clips that are whole") from None
    print(f"{output}: the card is {output / CARD}")


def _shares(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(share) for share in text.split(",")]
    except ValueError:
        raise InputError(f"--split {text}: allowed: shares that add up to 1, as .8,.1,.1") from None
