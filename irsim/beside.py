"""Files that a YAML file names: looked for beside it, not where the command happens to be given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from irsim.errors import InputError
from irsim.kinds import Part
from irsim.overrides import placed
from irsim.schema import Slot, member
from irsim.severity import entries
from irsim.yamlfile import Document, KeyPath


def beside(document: Document, folder: Path, root: type[Part]) -> Document:
    """The document of a file in `folder` with the relative names of files in it as they are found from here.

    One that is only in the working directory stays as it is, so that texts in which `irsim sample` and others have
    named files from there hold wherever they are put. One that is nowhere is beside the document, as its error says.
    """
    if folder == Path():
        return document
    value = _found(document.value, Slot.of(root), folder)
    for table, key in entries(document) if isinstance(value, dict) else ():
        try:
            slot = _slot(document.value, placed(document, key, None, table, root)[1], root)
        except InputError:  # told when the document is validated
            continue
        value = {**value, table: {**value[table], key: _each(value[table][key], slot, folder)}}
    return replace(document, value=value)


def _each(entry: Any, slot: Slot | None, folder: Path) -> Any:
    """An entry of a table, the values of a severity's list or of a choice, of a key of that slot."""
    if isinstance(entry, list):
        return [_found(value, slot, folder) for value in entry]
    if not isinstance(entry, dict):
        return entry
    lists = {key: _each(entry[key], slot, folder) for key in entry if key == "values"}
    return {**entry, **lists, **{key: _found(entry[key], slot, folder) for key in entry if key == "benign"}}


def _found(value: Any, slot: Slot | None, folder: Path) -> Any:
    if slot is None:
        return value
    if isinstance(value, str) and slot.is_file:
        return _name(value, folder)
    if isinstance(value, dict):
        return {key: _found(item, slot.child(value, key), folder) for key, item in value.items()}
    if isinstance(value, list):
        return [_found(item, slot.child(value, index), folder) for index, item in enumerate(value)]
    return value


def _name(name: str, folder: Path) -> str:
    near = folder / name
    try:
        return name if not near.exists() and Path(name).exists() else str(near)
    except (OSError, ValueError):  # a name that no file can have is told by who opens it
        return name


def _slot(value: Any, path: KeyPath, root: type[Part]) -> Slot | None:
    """What may stand at a path of a document's value."""
    slot: Slot | None = Slot.of(root)
    for step in path:
        slot = slot.child(value, step) if slot is not None else None
        value = member(value, step)
    return slot
