"""What a fit is written over: nothing but another fit."""

from __future__ import annotations

import re
from pathlib import Path

from irsim.errors import InputError

BY = "by irsim fit;"
"""Stands in the first line of what a fit writes."""

_OWN = re.compile(r"(targets|occluders):")
"""Begins what a fit never has: its user added it."""


def check_replaced(path: Path | None) -> None:
    """InputError where a file is there that no fit wrote, or to which its user has added what a fit would lose."""
    if path is None or not path.exists():
        return
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    allowed = "and a fit would replace it; allowed: another name"
    if not (lines and lines[0].startswith("#") and BY in lines[0]):
        raise InputError(f"{path}: is there already, irsim fit has not written it, {allowed}")
    for number, line in enumerate(lines, start=1):
        if _OWN.match(line):
            raise InputError(f"{path}:{number}: holds {line.partition(':')[0]} that were added to it, {allowed}")
