"""The code that decides a scene's pixels and truth, as a digest: results of other code are other results."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

from irsim._native import COMPILED
from irsim.config.base import Kind, Part
from irsim.config.field_annotations import Located
from irsim.config.file_digests import DIGEST, FILE

NOT_PIXELS = (
    # read and check scenarios, and word what is wrong
    *("lint", "errors.py", "wording.py", "scenario/loader.py", "scenario/ranges.py", "scenario/severity.py"),
    *("scenario/catalog.py", "scenario/validation.py", "config/diagnostics.py", "config/overrides.py"),
    *("config/schema.py", "config/relative_paths.py", "config/tree.py", "config/wrong_encoding.py"),
    *("config/yaml_file.py", "config/yaml_tabs.py"),
    # share frames out among processes: each is the same as drawn alone (see below)
    *("render/balance.py", "render/workers.py", "render/division.py", "render/interrupts.py", "signals.py"),
    *("render/shared_memory.py", "render/worker.py"),
    # say what a scene may be instead, make some up, and hold tracks to rules
    *("scenario/authoring.py", "scenario/expectation.py", "scenario/space.py", "scenario/variation.py", "strategies"),
    # show, write and measure what is rendered
    *("notebook.py", "calibration", "render/masks.py", "render/moments.py", "render/levels.py"),
    *("recording/conversion.py", "recording/arrays.py", "recording/importing.py", "recording/labels.py"),
    *("recording/pictures.py", "recording/tiff.py"),
    # commands, and ways in
    *("__main__.py", "cli", "lazy.py", "render/sources.py"),
)
"""Rooms that no pixel and no truth depends on: without them, or with other words in them, a frame is the same.

Those that share frames out call `Renderer` and nothing else for a picture, and decide by the clock who draws which
frame or step: frames that depended on them would differ from run to run, and no digest of code would tell. So it is
tests that hold frames equal however they are divided: without these rooms at all, alone and backwards, and by two
processes (test_identity), divided anywhere and dealt out anyhow (test_division), in memory used again (test_places).
What processes work out for each other, the shelf, stands in the frame's own way and belongs to the digest."""


def scene_code(scene: Part) -> str:
    """Hex digest of irsim's rendering code and of the modules of the user's own kinds in a scene.

    The version alone would not do: in a checkout, and in a user's module, code changes without it.
    """
    digest = hashlib.blake2b(rendering_code().encode(), digest_size=16)
    for kind in sorted(set(_foreign_kinds(scene)), key=lambda kind: kind.kind):
        digest.update(f"{kind.kind}\0".encode() + _source(kind) + b"\0")
    return digest.hexdigest()


def without_names(part: object, value: Any) -> Any:
    """A part's plain value less the names of files whose digest stands beside them: what is in a file counts, not where
    it lies nor how its name is spelt."""
    if isinstance(part, tuple | list):
        return [without_names(*pair) for pair in zip(part, value, strict=True)]
    if not isinstance(part, Part):
        return value
    kept = {key: item for key, item in value.items() if not (key == FILE and value.get(DIGEST) and _is_named(part))}
    return {key: without_names(getattr(part, key), item) for key, item in kept.items()}


def _is_named(part: Part) -> bool:
    """Is its key `file` the name of one?"""
    field = type(part).model_fields.get(FILE)
    return field is not None and any(isinstance(mark, Located) for mark in field.metadata)


@lru_cache
def rendering_code() -> str:
    """Hex digest of irsim's own code, but for the rooms that no pixel depends on; and of whether loops are compiled."""
    here = Path(__file__).parents[1]
    digest = hashlib.blake2b(bytes([COMPILED]), digest_size=16)
    for path in sorted(path for ending in ("py", "c", "h") for path in here.rglob(f"*.{ending}")):
        place = path.relative_to(here)
        if not any(place.is_relative_to(each) for each in NOT_PIXELS):
            digest.update(place.as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _foreign_kinds(value: object) -> Iterator[type[Kind]]:
    """The classes of the user's own kinds in a tree of parts, and those that they derive from."""
    if isinstance(value, Kind):
        yield from (
            each for each in type(value).__mro__ if issubclass(each, Kind) and each.__module__.split(".")[0] != "irsim"
        )
    if isinstance(value, Part):
        for field in type(value).model_fields:
            yield from _foreign_kinds(getattr(value, field))
    elif isinstance(value, tuple | list):
        for item in value:
            yield from _foreign_kinds(item)


def _source(kind: type[Kind]) -> bytes:
    """The file of a class; nothing where it has none (typed into a prompt)."""
    try:
        return Path(inspect.getsourcefile(kind) or "").read_bytes()
    except (TypeError, OSError):
        return b""
