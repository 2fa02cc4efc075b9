"""`irtrack train`: the classifiers of trackers, trained on rendered frames."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from irsim.cli import terminal
from irtrack.cli.options import argument, command_line, path_option


def train(
    kind: Annotated[str, argument("hog|adaboost|identity", "Kind of model.")],
    output: Annotated[Path | None, path_option("FILE", "Model file; default: KIND.json.", "-o", "--output")] = None,
) -> None:
    """Train a model on rendered frames of development seeds; write it with its card, and print its scores."""
    from irtrack.training import train as trained

    path = Path(f"{kind}.json") if output is None else output
    with terminal.progress_bar("frames") as progress:
        card = trained(kind, path, command_line(), progress)
    for name, value in (card.examples | card.scores).items():
        print(f"{name}: {value:g}")
    print(f"wrote {path}")
