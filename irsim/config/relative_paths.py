"""Files that a YAML file names: found from beside it, not from where the command happens to be given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from irsim.config.base import Part
from irsim.config.file_digests import name_from, whole_name
from irsim.config.files import is_there
from irsim.config.overrides import placed
from irsim.config.schema import Slot, member
from irsim.config.yaml_file import Document, KeyPath
from irsim.errors import InputError
from irsim.scenario.severity import entries

Renamed = Callable[[str], str]


def beside(document: Document, folder: Path, root: type[Part]) -> Document:
    """The document of a file in `folder` with the whole names of files in it.

    One that is only in the working directory is that one. One that is nowhere is beside the document, as its error
    says.
    """
    return _with_names(document, lambda name: _found(name, folder), root)


def named_from(document: Document, folder: Path, root: type[Part]) -> Document:
    """The document, which has whole names of files, with those that `beside` makes whole again from `folder`."""
    return _with_names(document, lambda name: name_from(folder, name), root)


def _with_names(document: Document, renamed: Renamed, root: type[Part]) -> Document:
    value = _each_name(document.value, Slot.of(root), renamed)
    for table, key in entries(document) if isinstance(value, dict) else ():
        try:
            slot = _slot(document.value, placed(document, key, None, table, root)[1], root)
        except InputError:  # told when the document is validated
            continue
        value = {**value, table: {**value[table], key: _entry(value[table][key], slot, renamed)}}
    return replace(document, value=value)


def _entry(entry: Any, slot: Slot | None, renamed: Renamed) -> Any:
    """An entry of a table, the values of a severity's list or of a choice, of a key of that slot."""
    if isinstance(entry, list):
        return [_each_name(value, slot, renamed) for value in entry]
    if not isinstance(entry, dict):
        return entry
    lists = {key: _entry(entry[key], slot, renamed) for key in entry if key == "values"}
    return {**entry, **lists, **{key: _each_name(entry[key], slot, renamed) for key in entry if key == "benign"}}


def _each_name(value: Any, slot: Slot | None, renamed: Renamed) -> Any:
    if slot is None:
        return value
    if isinstance(value, str) and slot.is_file:
        return renamed(value)
    if isinstance(value, dict):
        return {key: _each_name(item, slot.child(value, key), renamed) for key, item in value.items()}
    if isinstance(value, list):
        return [_each_name(item, slot.child(value, index), renamed) for index, item in enumerate(value)]
    return value


def _found(name: str, folder: Path) -> str:
    if not name:  # told by who opens it
        return name
    near = folder / name
    return whole_name(name if not is_there(near) and is_there(name) else str(near))


def _slot(value: Any, path: KeyPath, root: type[Part]) -> Slot | None:
    """What may stand at a path of a document's value."""
    slot: Slot | None = Slot.of(root)
    for step in path:
        slot = slot.child(value, step) if slot is not None else None
        value = member(value, step)
    return slot
