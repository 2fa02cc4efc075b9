"""`irtrack sources`: the papers' experiments repeated."""

from __future__ import annotations

import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from irsim.cli import terminal
from irsim.cli.terminal import given_path
from irsim.errors import counted
from irtrack.cli.options import Jobs, command_line, names


def sources(
    seeds: Annotated[int, typer.Option(metavar="N", min=2, help="Seeds of each scene.")] = 50,
    first: Annotated[
        int,
        typer.Option(metavar="N", min=0, help="The first of them; below 2000 they served while trackers were made."),
    ] = 2000,
    jobs: Jobs = 1,
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="DIR", help="Folder of the page and of its results file.", parser=given_path
        ),
    ] = Path("sources"),
    only: Annotated[
        str | None, typer.Option(metavar="PART,...", help="Of cheng, xue, an, cui, camshift, li, cost, growth, hard.")
    ] = None,
    real: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Labelled real sequences: folders with frames.mp4 and gt.csv.", parser=given_path
        ),
    ] = None,
) -> None:
    """Repeat the experiments of the papers and write a page: printed beside ours, each claim with its verdict."""
    from irtrack.papers import write_sources

    parts = names("--only", only) or ()
    with terminal.progress_bar("sources") as bar:
        told = Told() if bar is None else (lambda scene, done, total: bar(done, total, scene))
        path = write_sources(output, seeds, first, jobs, parts, real, command_line(), told)
    print(path)


class Told:
    """Where nobody looks on, a line on standard error for each scene that begins: a log of hours stays short."""

    def __init__(self) -> None:
        self._scene = ""

    def __call__(self, scene: str, done: int, total: int) -> None:
        if scene != self._scene:
            told = f"{done} of {counted(total, 'run')} done"
            print(f"{datetime.now():%H:%M:%S} {scene}: {told}", file=sys.stderr, flush=True)
        self._scene = scene
