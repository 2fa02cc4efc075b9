"""The scenarios that come with irsim, by name."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import Path

from irsim.errors import InputError
from irsim.explain import listed


def examples() -> dict[str, Path]:
    """The scenarios that are shipped as examples, by name."""
    return shipped("examples")


def shipped(folder: str) -> dict[str, Path]:
    """The scenarios that are shipped with irsim in a folder (examples, sources, stress, new), by name."""
    here = Path(__file__).parent
    places = [here.parent / "scenarios" / folder, here / "scenarios" / folder]
    return {path.stem: path for place in places for path in sorted(place.glob("*.yaml"))}


def find(path: str | PathLike[str]) -> Path:
    """The file of that path, else the shipped scenario of that name: `sky`, or `sources/xue-sky` with its folder."""
    wanted = fspath(path)
    if not wanted:
        raise InputError("'': the name is empty; allowed: a file, or a shipped scenario's name")
    try:
        exists = Path(path).exists()
    except (OSError, ValueError):
        exists = False
    folder, slash, name = wanted.rpartition("/")
    if exists or Path(name).suffix or Path(name).name != name or Path(folder).name != folder:
        return Path(path)
    names = {f"{folder}{slash}{known}": file for known, file in shipped(folder or "examples").items()}
    if wanted in names:
        return names[wanted]
    if folder and not names:
        return Path(path)
    raise InputError(
        f"{wanted}: there is no such file and no shipped scenario of that name{listed(sorted(names), wanted)}"
    )
