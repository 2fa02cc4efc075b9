"""Commands that help to write scenarios: new, schema, sample."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Annotated

import typer

from irsim.cli.source_options import warn_unheeded
from irsim.cli.terminal import given_path, progress_bar
from irsim.errors import InputError, counted


def new(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="sky, ground, sea, landscape, recording (yours), severities or vary.")
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="YAML",
            help="File to write; default: KIND.yaml in this folder.",
            parser=given_path,
        ),
    ] = None,
) -> None:
    """Write a commented scenario to start from. It replaces no file."""
    from irsim.recording.output import check_output
    from irsim.scenario.catalog import start_text, write_new
    from irsim.scenario.loader import load

    text = start_text(kind)
    path = output or Path(f"{kind}.yaml")
    check_output(path, endings=(".yaml", ".yml"))
    write_new(path, text)
    print(path)
    show = f"irsim show {shlex.quote(str(path))}"
    try:
        load(path)
    except InputError as error:  # a file that the user has yet to supply is missing
        print(f"show it, once this is corrected: {show}\n{error}")
    else:
        print(f"show it: {show}")


def schema(
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="JSON", help="File to write; default: standard output.", parser=given_path
        ),
    ] = None,
) -> None:
    """Print the JSON Schema of scenarios, for completion in editors."""
    from irsim.recording.output import atomic_text, check_output
    from irsim.scenario.catalog import json_schema

    check_output(output, endings=(".json",))
    text = json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
    if output is None:
        print(text, end="")
        return
    with atomic_text(output) as file:
        file.write(text)
    print(output)


def sample(
    scenario: Annotated[
        str, typer.Argument(metavar="SCENARIO", help="Scenario file or shipped scenario's name, with `vary`.")
    ],
    overrides: Annotated[
        list[str] | None,
        typer.Argument(metavar="KEY=VALUE", help="Overrides of the scenario; an overridden key is not varied."),
    ] = None,
    count: Annotated[int, typer.Option("-n", metavar="N", min=1, max=100_000, help="Number of scenarios.")] = 10,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Folder to write; default: NAME-samples in this folder.",
            parser=given_path,
        ),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Seed of the draws.")] = 0,
) -> None:
    """Draw scenarios from the ranges under `vary`, each to a file."""
    from irsim.recording.output import atomic_text, check_output, make_folder, refuse_leftovers
    from irsim.scenario.catalog import find
    from irsim.scenario.loader import load
    from irsim.scenario.sampling import sample_names, sample_texts

    loaded = load(scenario, overrides or ())
    warn_unheeded(scenario, overrides)
    name = Path(scenario).stem
    folder = output or Path(f"{name}-samples")
    command = shlex.join(["irsim", "sample", scenario, *(overrides or ()), "-n", str(count), "--seed", str(seed)])
    paths = [folder / file for file in sample_names(name, count)]
    for path in paths:
        if folder.is_dir():
            check_output(path, find(scenario), *loaded.files)
    new_names, sample_name = {path.name for path in paths}, re.compile(rf"{re.escape(name)}-\d+\.yaml")
    refuse_leftovers(folder, lambda file: file not in new_names and bool(sample_name.fullmatch(file)), "samples")
    with progress_bar(f"sample {name}", count) as progress:
        texts = sample_texts(loaded, name, count, seed, command, folder, progress)
    make_folder(folder)
    for path, text in zip(paths, texts, strict=True):
        with atomic_text(path) as file:
            file.write(text)
    print(f"{folder}: {counted(len(paths), 'scenario')}, {paths[0].name} to {paths[-1].name}")
