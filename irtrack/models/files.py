"""Model files: JSON with a format number, a kind, a card, the classifier's values, and a digest of all these.

The card says how the model was made: scenarios, seeds, number of examples, scores on seeds that the training did not
use, and the command that makes it again.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from irsim.recording.output import atomic_text
from irtrack.errors import InputError

FORMAT = 1
"""Number of the format; a reader takes its own only."""
SHIPPED = Path(__file__).parent
"""Folder of the shipped models."""
MOST_BYTES = 1_000_000
"""Largest size of a model file."""
DIGITS = 7
"""Significant digits of the numbers of a model."""


@dataclass(frozen=True, slots=True)
class Card:
    """Record of the data, seeds, scores and command of a model.

    data      scenarios;  seeds: those of the training, of the calibration and of the scores
    examples  number of examples of the training, by their class
    scores    figures on the seeds of the scores
    command   command that makes the model again
    """

    data: tuple[str, ...]
    seeds: dict[str, list[int]]
    examples: dict[str, int]
    scores: dict[str, float]
    command: str


def model_path(kind: str, given: str | None) -> Path:
    """Return the path of a model: the given one, or the shipped one of its kind."""
    return SHIPPED / f"{kind}.json" if given is None else Path(given)


def write_model(path: Path, kind: str, card: Card, values: dict[str, Any]) -> None:
    """Write a model file; numbers of arrays are rounded to `DIGITS` significant digits."""
    body = {"format": FORMAT, "kind": kind, "card": asdict(card), "values": _plain(values)}
    text = json.dumps(body | {"digest": _digest(body)}, indent=None, separators=(",", ":"))
    if len(text) > MOST_BYTES:
        raise InputError(f"{path}: a model of {len(text)} bytes; allowed: {MOST_BYTES}")
    with atomic_text(path) as file:
        file.write(text + "\n")


def read_model(path: Path, kind: str) -> dict[str, Any]:
    """Return the values of a model of a kind; InputError, one line, for a missing, old, changed or other file."""
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; allowed: a file of irtrack train {kind}")
    values: dict[str, Any] = _read(str(path.resolve()), path.stat().st_mtime_ns, kind)["values"]
    return values


def read_card(path: Path, kind: str) -> dict[str, Any]:
    """Return the card of a model; InputError as for `read_model`."""
    read_model(path, kind)
    card: dict[str, Any] = _read(str(path.resolve()), path.stat().st_mtime_ns, kind)["card"]
    return card


@lru_cache(maxsize=16)
def _read(path: str, changed_ns: int, kind: str) -> Any:
    again = f"allowed: a file of irtrack train {kind}"
    try:
        body = json.loads(Path(path).read_bytes())
        digest = body.pop("digest")
        number, found = body["format"], body["kind"]
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{path}: is no model file; {again}") from None
    if number != FORMAT:
        raise InputError(f"{path}: a model of format {number}; allowed: format {FORMAT}, by irtrack train {kind}")
    if found != kind:
        raise InputError(f"{path}: a model of kind {found}; {again}")
    if digest != _digest(body):
        raise InputError(f"{path}: was changed after it was written; {again}")
    return body


def _digest(body: dict[str, Any]) -> str:
    text = json.dumps(body, sort_keys=True, separators=(",", ":"))
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
