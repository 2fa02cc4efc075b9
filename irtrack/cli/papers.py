"""`irtrack papers`: the papers' experiments reproduced."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from irsim.cli import terminal
from irtrack.cli.options import Jobs, command_line, names, option, path_option


def papers(
    seeds: Annotated[int, option("N", "Number of seeds of each scene.", min=2)] = 50,
    first: Annotated[int, option("N", "First seed; the trackers were developed on seeds below 2000.", min=0)] = 2000,
    jobs: Jobs = 1,
    output: Annotated[Path, path_option("DIR", "Folder for the page and its results.", "-o", "--output")] = Path(
        "sources"
    ),
    only: Annotated[
        str | None, option("PART,...", "Of cheng, xue, an, cui, camshift, li, cost, growth, points, hard.")
    ] = None,
    real: Annotated[
        Path | None, path_option("DIR", "Labelled real sequences: folders with frames.mp4 and gt.csv.")
    ] = None,
) -> None:
    """Reproduce the papers' experiments and write a page: printed figures beside ours, each claim with a verdict."""
    from irtrack.papers import write_papers

    parts = names("--only", only) or ()
    with terminal.progress_bar("papers") as progress:
        print(write_papers(output, seeds, first, jobs, parts, real, command_line(), progress))
