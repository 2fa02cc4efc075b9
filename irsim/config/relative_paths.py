"""File names in YAML files: relative to the file's own folder, not to the working directory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from irsim.config.base import KeyPath, Part
from irsim.config.overrides import set_value, table_entries
from irsim.config.paths import absolute_name, is_there, relative_name
from irsim.config.schema import Slot, member
from irsim.config.yaml_text import Document
from irsim.errors import InputError

Rename = Callable[[str], str]


def with_absolute_names(document: Document, folder: Path, root: type[Part]) -> Document:
    """Return the document of a file in `folder` with absolute file names.

    A name that exists only relative to the working directory is taken from there. A missing file is assumed in
    `folder`.
    """

    def absolute(name: str) -> str:
        if not name:  # opening it fails with its own message
            return name
        near = folder / name
        return absolute_name(name if not is_there(near) and is_there(name) else str(near))

    return _with_names(document, absolute, root)


def with_relative_names(document: Document, folder: Path, root: type[Part]) -> Document:
    """Return a document with file names relative to `folder`: the inverse of `with_absolute_names`."""
    return _with_names(document, lambda name: relative_name(folder, name), root)


def _with_names(document: Document, rename: Rename, root: type[Part]) -> Document:
    """Return the document with file names changed, also those in its tables of severities and variations."""
    value = _renamed(document.value, Slot.of(root), rename)
    for name, key in table_entries(document) if isinstance(value, dict) else ():
        try:
            slot = _slot_at(document.value, set_value(document, key, None, name, root)[1], root)
        except InputError:  # reported when the document is validated
            continue
        value = {**value, name: {**value[name], key: _renamed_entry(value[name][key], slot, rename)}}
    return replace(document, value=value)


def _renamed_entry(entry: Any, slot: Slot | None, rename: Rename) -> Any:
    """Return an entry of a table (values by severity, or a variation) with file names changed."""
    if isinstance(entry, list):
        return [_renamed(value, slot, rename) for value in entry]
    if not isinstance(entry, dict):
        return entry
    lists = {key: _renamed_entry(entry[key], slot, rename) for key in entry if key == "values"}
    return {**entry, **lists, **{key: _renamed(entry[key], slot, rename) for key in entry if key == "benign"}}


def _renamed(value: Any, slot: Slot | None, rename: Rename) -> Any:
    if slot is None:
        return value
    if isinstance(value, str) and slot.is_file:
        return rename(value)
    if isinstance(value, dict):
        return {key: _renamed(item, slot.child(value, key), rename) for key, item in value.items()}
    if isinstance(value, list):
        return [_renamed(item, slot.child(value, index), rename) for index, item in enumerate(value)]
    return value


def _slot_at(value: Any, path: KeyPath, root: type[Part]) -> Slot | None:
    slot: Slot | None = Slot.of(root)
    for step in path:
        slot = slot.child(value, step) if slot is not None else None
        value = member(value, step)
    return slot
