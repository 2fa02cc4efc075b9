"""`irtrack papers`: the papers' experiments repeated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from irsim.cli import terminal
from irsim.cli.terminal import given_path
from irtrack.cli.options import Jobs, command_line, names


def papers(
    seeds: Annotated[int, typer.Option(metavar="N", min=2, help="Number of seeds of each scene.")] = 50,
    first: Annotated[
        int, typer.Option(metavar="N", min=0, help="First seed; the trackers were developed on seeds below 2000.")
    ] = 2000,
    jobs: Jobs = 1,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="DIR", help="Folder for the page and its results.", parser=given_path),
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
    """Repeat the papers' experiments and write a page: printed figures beside ours, each claim with a verdict."""
    from irtrack.papers import write_papers

    parts = names("--only", only) or ()
    with terminal.progress_bar("papers") as progress:
        print(write_papers(output, seeds, first, jobs, parts, real, command_line(), progress))
