"""The scenarios that come with irsim, by name."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import Path

from irsim.config.diagnostics import listed
from irsim.config.files import is_there, path_of
from irsim.errors import InputError


def examples() -> dict[str, Path]:
    """The scenarios that are shipped as examples, by name."""
    return shipped("examples")


def shipped(folder: str) -> dict[str, Path]:
    """The scenarios that are shipped with irsim in a folder (examples, sources, stress, new), by name."""
    return {path.stem: path for place in _places() for path in sorted((place / folder).glob("*.yaml"))}


def find(path: str | PathLike[str], wants: str = "examples") -> Path:
    """The file of that path, else the shipped scenario of that name: `sky`, or `sources/xue-sky` with its folder.

    wants   the folder whose names are told as those allowed where there is none, and the word has no folder
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
    if not folder and wants != "examples":
        names = {f"{wants}/{known}": file for known, file in shipped(wants).items()}
    what = "suite" if (folder or wants) == "suites" else "scenario"
    raise InputError(
        f"{wanted}: there is no such file and no shipped {what} of that name"
        f"{listed(sorted(names), None if hint else wanted)}{hint}"
    )


def _folders() -> list[Path]:
    """The folders of shipped scenarios."""
    return [folder for place in _places() if place.is_dir() for folder in sorted(place.iterdir())]


def _places() -> list[Path]:
    """Where scenarios are shipped: beside the package in a checkout, within it once installed."""
    here = Path(__file__).parents[1]
    return [here.parent / "scenarios", here / "scenarios"]
