"""Plain values, digests and wrapped captures: the vocabulary of the safety net."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import io
import json
import os
import re
import runpy
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

Item = tuple[str, Any]
"""A key below the task's and its value, or a function that returns the value."""
Task = Callable[[], Iterator[Item]]

SCRATCH = Path(tempfile.gettempdir()) / f"net-{os.getpid()}"
"""Folder for files that the capture writes; `capture.py` makes and removes it."""
ENVIRONMENT = os.environ | {"COLUMNS": "80", "TERM": "dumb", "NO_COLOR": "1", "OPENBLAS_NUM_THREADS": "1"}
VOLATILE = re.compile(r"(^|_)(ms|bytes|path|versions?|code|digest|outcome|started|command|repeat)(_|$)")
"""Names of fields with times, paths, versions and digests of code."""


class Words(str):
    """Text for people: its changes are counted, and are no differences."""


def plain(value: Any) -> Any:
    """Return a value as JSON types, by fields and not by class; arrays as digests, floats exactly."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape} {hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()[:16]}"
    if isinstance(value, np.generic):
        return plain(value.item())
    if dataclasses.is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if hasattr(value, "model_dump"):
        return plain(value.model_dump(mode="json"))
    if hasattr(value, "_asdict"):
        return plain(value._asdict())
    if isinstance(value, dict):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple | range):
        return [plain(each) for each in value]
    return value if isinstance(value, str | int | float | None) else clean(str(value))


def digest(value: Any) -> str:
    """Return a short digest of a value; of bytes, that of their content."""
    data = value if isinstance(value, bytes) else json.dumps(plain(value), sort_keys=True).encode()
    return hashlib.sha256(data).hexdigest()[:16]


def summary(array: np.ndarray) -> str:
    """Return an array's digest and its mean, which shows how large a difference is."""
    return f"{plain(array)} mean {array.mean():.9g}"


def lasting(value: Any) -> Any:
    """Return a value without the fields that change from run to run or from commit to commit."""
    if isinstance(value, dict):
        return {key: lasting(each) for key, each in value.items() if not VOLATILE.search(key)}
    return [lasting(each) for each in value if not _of_times(each)] if isinstance(value, list) else value


def _of_times(row: Any) -> bool:
    """Return whether a row of a table is of a figure in ms."""
    return isinstance(row, dict) and any(isinstance(each, str) and VOLATILE.search(each) for each in row.values())


def leaves(value: Any, key: str = "") -> Iterator[Item]:
    """Yield the leaves of a JSON document by dotted keys; lists of numbers as digests once they are long."""
    if isinstance(value, dict) and value:
        for name, each in value.items():
            yield from leaves(each, f"{key}.{name}" if key else name)
    elif isinstance(value, list) and value and all(isinstance(each, dict) for each in value):
        yield from leaves({str(number): each for number, each in enumerate(value)}, key)
    elif isinstance(value, list) and len(json.dumps(value)) > 100:
        yield key, f"{len(value)} items {digest(value)}"
    else:
        yield key, Words(value) if isinstance(value, str) and value.count(" ") > 5 else value


def clean(text: str) -> str:
    """Return a text without the paths of this machine."""
    for folder in (SCRATCH, Path.cwd()):
        text = text.replace(f"{folder}/", "").replace(str(folder), ".")
    return text


def command(program: str, *words: object, apart: bool = False) -> tuple[int, str, str]:
    """Return (status, standard output, standard error) of `python -m PROGRAM WORDS`, run in this process or apart."""
    if apart:
        line = [sys.executable, "-m", program, *map(str, words)]
        done = subprocess.run(line, capture_output=True, text=True, env=ENVIRONMENT, timeout=280, check=False)
        return done.returncode, clean(done.stdout), _without_progress(clean(done.stderr))
    before, status = sys.argv, 0
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            sys.argv = [program, *map(str, words)]
            runpy.run_module(program, run_name="__main__")
        except SystemExit as left:
            status = left.code if isinstance(left.code, int) else int(left.code is not None)
        finally:
            sys.argv = before
    texts = [stream.buffer.getvalue().decode() for stream in (out, err)]
    return status, clean(texts[0]), _without_progress(clean(texts[1]))


def _without_progress(text: str) -> str:
    return "".join(line for line in text.splitlines(True) if not re.search(r": \d+( of \d+)?, \d+ s\b", line))


def document(program: str, *words: object, apart: bool = False) -> Any:
    """Return the JSON document that a command prints, without volatile fields, its status beside it."""
    status, out, err = command(program, *words, apart=apart)
    if not out:
        raise RuntimeError(f"status {status}: {err.strip()[-300:]}")
    return {"status": status, "document": lasting(json.loads(out))}


def captured(prefix: str, task: Task) -> Iterator[Item]:
    """Yield a task's keys and values; an exception becomes the value `error: Type: text`."""
    try:
        for key, value in task():
            name = f"{prefix}/{key}" if key else prefix
            try:
                found = value() if callable(value) else value
                yield name, found if isinstance(found, Words) else plain(found)
            except Exception as error:
                yield name, f"error: {type(error).__name__}: {clean(str(error))[:300]}"
    except Exception as error:
        yield prefix, f"error: {type(error).__name__}: {clean(str(error))[:300]}"
