"""What a fit is written over: nothing but another fit."""

from __future__ import annotations

import hashlib
from pathlib import Path

from irsim.errors import InputError

BY = "by irsim fit;"
"""Stands in the first line of what a fit writes."""

_SEAL = "# A later fit replaces this file as long as nothing is changed in it: "
"""Begins the last line of what a fit writes; the digest of all before it ends it."""


def sealed(text: str) -> str:
    """A fit's text with a last line that tells whether it is still as it was written; an older such line goes."""
    before, seal, rest = text.rpartition(_SEAL)
    body = before if seal else rest
    return f"{body}{_SEAL}{_digest(body)}\n"


def check_replaced(path: Path | None) -> None:
    """InputError where a file is there that no fit wrote, or that was changed since: a fit would lose what its user
    has put there."""
    if path is None or not path.exists():
        return
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    if _SEAL in text and text == sealed(text):
        return
    if BY not in text.partition("\n")[0]:
        what = "is there already, irsim fit has not written it"
    elif _SEAL in text:
        what = "was changed after irsim fit wrote it"
    else:
        what = "irsim fit has not written it like this, the last line of a fit is missing"
    raise InputError(f"{path}: {what}, and a fit would replace it; allowed: another name")


def _digest(text: str) -> str:
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
