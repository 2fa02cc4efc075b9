"""Shipped scenarios by name, starting points for new ones, and the JSON Schema for editors."""

from __future__ import annotations

import os
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from irsim.config.diagnostics import allowed_text
from irsim.config.paths import is_there, path_of
from irsim.errors import InputError
from irsim.recording.output import atomic_text
from irsim.scenario.model import Scenario

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def examples() -> dict[str, Path]:
    """Return the shipped examples by name."""
    return shipped("examples")


def shipped(folder: str) -> dict[str, Path]:
    """Return the shipped scenarios of a folder (examples, sources, stress, new) by name."""
    return {path.stem: path for place in _places() for path in sorted((place / folder).glob("*.yaml"))}


def find(path: str | PathLike[str], default_folder: str = "examples") -> Path:
    """Return the file at a path, else the shipped scenario of that name, such as `sky` or `sources/xue-sky`.

    default_folder  folder whose shipped scenarios the error lists for an unknown name without a folder
    """
    path_of(path)
    wanted = fspath(path)
    if not wanted:
        raise InputError("'': the name is empty; allowed: a file, or a shipped scenario's name")
    folder, slash, name = wanted.rpartition("/")
    if is_there(path) or Path(name).suffix or Path(name).name != name or Path(folder).name != folder:
        return Path(path)
    names = {f"{folder}{slash}{known}": file for known, file in shipped(folder or "examples").items()}
    if wanted in names:
        return names[wanted]
    if folder and not names:
        return Path(path)
    elsewhere = sorted(f"{place.name}/{wanted}" for place in _folders() if is_there(place / f"{wanted}.yaml"))
    hint = f"; did you mean '{elsewhere[0]}'?" if elsewhere else ""
    if not folder and default_folder != "examples":
        names = {f"{default_folder}/{known}": file for known, file in shipped(default_folder).items()}
    kind = "suite" if (folder or default_folder) == "suites" else "scenario"
    raise InputError(
        f"{wanted}: there is no such file and no shipped {kind} of that name"
        f"{allowed_text(sorted(names), None if hint else wanted)}{hint}"
    )


def start_text(kind: str) -> str:
    """Return the text of a commented scenario from which users start. Raises InputError for an unknown kind."""
    known = shipped("new")
    if kind not in known:
        raise InputError(f"{kind}: there is no such kind of scenario{allowed_text(sorted(known), kind)}")
    return known[kind].read_text(encoding="utf-8")


def write_new(path: Path, text: str) -> None:
    """Write the text to a new file. Raises InputError if the file already exists."""
    if os.path.lexists(path):
        raise InputError(f"{path}: is there already, and a new scenario replaces nothing; allowed: -o FILE")
    with atomic_text(path) as file:
        file.write(text)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a scenario: keys, kinds, bounds and documentation, but no relations between keys."""
    return {"$schema": DIALECT, **Scenario.model_json_schema(), "title": "irsim scenario"}


def _folders() -> list[Path]:
    return [folder for place in _places() if place.is_dir() for folder in sorted(place.iterdir())]


def _places() -> list[Path]:
    """Return the folders of shipped scenarios: beside the package in a checkout, within it once installed."""
    here = Path(__file__).parents[1]
    return [here.parent / "scenarios", here / "scenarios"]
