"""Digest of the code on which a scene's pixels and truth depend. Results of different code have different digests."""

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
    *("lint", "cli", "calibration", "strategies", "__main__.py", "errors.py", "notebook.py"),
    *("render/interrupts.py", "render/masks.py", "render/moments.py", "render/sources.py", "render/workers.py"),
)
"""Packages and files of irsim without effect on pixels and ground truth.

Worker processes are among them: a test checks that frames are equal when rendered without these modules, one by one, in
reverse order, and by two processes.
"""


def scene_code(scene: Part) -> str:
    """Return the hex digest of irsim's rendering code and of the source files of the user's own kinds in a scene.

    The version number is not enough, as code in a checkout or in a user's module changes without it.
    """
    digest = hashlib.blake2b(rendering_code().encode(), digest_size=16)
    for kind in sorted(set(_foreign_kinds(scene)), key=lambda kind: kind.kind):
        digest.update(f"{kind.kind}\0".encode() + _source(kind) + b"\0")
    return digest.hexdigest()


def without_names(part: object, value: Any) -> Any:
    """Return a part's value as plain data, without the names of files whose digest it contains.

    The content of a file matters to the fingerprint, not its folder or the spelling of its name.
    """
    if isinstance(part, tuple | list):
        return [without_names(*pair) for pair in zip(part, value, strict=True)]
    if not isinstance(part, Part):
        return value
    kept = {key: item for key, item in value.items() if not (key == FILE and value.get(DIGEST) and _is_named(part))}
    return {key: without_names(getattr(part, key), item) for key, item in kept.items()}


def _is_named(part: Part) -> bool:
    """Return True if the part has a key `file` that names a file."""
    field = type(part).model_fields.get(FILE)
    return field is not None and any(isinstance(item, Located) for item in field.metadata)


@lru_cache
def rendering_code() -> str:
    """Return the hex digest of irsim's code except `NOT_PIXELS`, and of the use of C kernels."""
    here = Path(__file__).parents[1]
    digest = hashlib.blake2b(bytes([COMPILED]), digest_size=16)
    for path in sorted(path for ending in ("py", "c", "h") for path in here.rglob(f"*.{ending}")):
        place = path.relative_to(here)
        if not any(place.is_relative_to(each) for each in NOT_PIXELS):
            digest.update(place.as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def has_own_kinds(scene: Part) -> bool:
    """Return True if a scene has a kind of the user's own."""
    return any(True for _ in _foreign_kinds(scene))


def _foreign_kinds(value: object) -> Iterator[type[Kind]]:
    """Yield the classes of the user's own kinds in a tree of parts, and their base classes that are the user's."""
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
    """Return the source file of a class, to hash; empty for a class defined interactively."""
    try:
        return Path(inspect.getsourcefile(kind) or "").read_bytes()
    except (TypeError, OSError):
        return b""
