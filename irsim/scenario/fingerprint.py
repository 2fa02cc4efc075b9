"""Digest of the code on which a scene's pixels and truth depend: it tells results of different code apart."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

from irsim._native import COMPILED
from irsim.config.base import Kind, Part
from irsim.config.fields import Located
from irsim.config.paths import DIGEST, FILE

NOT_PIXELS = (
    # read and check scenarios, and word error messages
    *("lint", "errors.py", "scenario/loader.py", "scenario/severity.py", "scenario/catalog.py"),
    *("scenario/validation.py", "config/diagnostics.py", "config/overrides.py", "config/schema.py"),
    *("config/relative_paths.py", "config/serialization.py", "config/yaml_text.py"),
    # share frames out among processes: each is the same as drawn alone (see below)
    *("render/balance.py", "render/workers.py", "render/division.py", "render/interrupts.py"),
    *("render/shared_memory.py", "render/worker.py"),
    # vary scenes, generate them, and hold tracks to rules
    *("scenario/expectation.py", "scenario/sampling.py", "scenario/variation.py", "strategies"),
    # show, write and measure rendered frames
    *("notebook.py", "displayed", "fitting", "measure", "render/masks.py", "render/moments.py", "render/levels.py"),
    *("recording/images.py", "recording/importers.py", "recording/labels.py", "recording/output.py"),
    # commands, and ways in
    *("__main__.py", "cli", "render/sources.py"),
)
"""Packages and files of irsim that no pixel and no truth depends on.

Worker processes belong to them: a test holds frames equal without these modules, alone and backwards, and by two
processes."""


def scene_code(scene: Part) -> str:
    """Return the hex digest of irsim's rendering code and of the modules of the user's own kinds in a scene.

    The version alone would not do: in a checkout, and in a user's module, code changes without it.
    """
    digest = hashlib.blake2b(rendering_code().encode(), digest_size=16)
    for kind in sorted(set(_foreign_kinds(scene)), key=lambda kind: kind.kind):
        digest.update(f"{kind.kind}\0".encode() + _source(kind) + b"\0")
    return digest.hexdigest()


def without_names(part: object, value: Any) -> Any:
    """Return a part's plain value less the names of files whose digest stands beside them.

    A file's content counts, not its folder or the spelling of its name.
    """
    if isinstance(part, tuple | list):
        return [without_names(*pair) for pair in zip(part, value, strict=True)]
    if not isinstance(part, Part):
        return value
    kept = {key: item for key, item in value.items() if not (key == FILE and value.get(DIGEST) and _is_named(part))}
    return {key: without_names(getattr(part, key), item) for key, item in kept.items()}


def _is_named(part: Part) -> bool:
    """Return whether the part's key `file` is a file's name."""
    field = type(part).model_fields.get(FILE)
    return field is not None and any(isinstance(item, Located) for item in field.metadata)


@lru_cache
def rendering_code() -> str:
    """Return the hex digest of irsim's code without `NOT_PIXELS`, and of whether the kernels are compiled."""
    here = Path(__file__).parents[1]
    digest = hashlib.blake2b(bytes([COMPILED]), digest_size=16)
    for path in sorted(path for ending in ("py", "c", "h") for path in here.rglob(f"*.{ending}")):
        place = path.relative_to(here)
        if not any(place.is_relative_to(each) for each in NOT_PIXELS):
            digest.update(place.as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _foreign_kinds(value: object) -> Iterator[type[Kind]]:
    """Yield the classes of the user's own kinds in a tree of parts, and their own base classes."""
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
    """Return the source file of a class; nothing where there is none, as of a class typed into a prompt."""
    try:
        return Path(inspect.getsourcefile(kind) or "").read_bytes()
    except (TypeError, OSError):
        return b""
