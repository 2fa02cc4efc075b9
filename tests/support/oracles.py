"""Values of other implementations (`oracle_values.py` writes them): the stored ones, or the file ORACLE_VALUES."""

from __future__ import annotations

import json
import os
from functools import cache
from pathlib import Path
from typing import Any


@cache
def values_of(name: str) -> list[dict[str, Any]]:
    """Return the values of trackeval, pyirstdmetrics, filterpy or stonesoup, one a case."""
    path = Path(os.environ.get("ORACLE_VALUES") or Path(__file__).parent / "data" / "oracle_values.json")
    found: list[dict[str, Any]] = json.loads(path.read_text())[name]
    return found
