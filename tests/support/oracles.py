"""Stored values of other implementations (`oracle_values.py` writes them)."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any


@cache
def values_of(name: str) -> list[dict[str, Any]]:
    """Return the values of trackeval, pyirstdmetrics, filterpy or stonesoup, one a case."""
    found: list[dict[str, Any]] = json.loads((Path(__file__).parent / "data" / "oracle_values.json").read_text())[name]
    return found
