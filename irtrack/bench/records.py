"""Values of a results file: run key, bench call, source row and run record; traces packed as bytes."""

from __future__ import annotations

import hashlib
import json
import math
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal

import numpy as np

from irsim.types import Input
from irtrack.metrics import Score
from irtrack.metrics.tasks import Task


@dataclass(frozen=True, slots=True)
class Key:
    """Run key: everything that determines the outcome of a run except times.

    source_hash     hash of the Source with its scene seed
    target          id of the target followed; None where a box was given and there is no truth
    start           'visible' (first frame in which half the target is visible, box from truth), or
                    'cx,cy,w,h@frame'; 'auto' or 'auto:DETECTOR' (`irtrack.replay.many.auto_start`); 'none' where the
                    tracker starts by itself
    input           images that the tracker sees
    task            'single', 'many' or 'detect' (`irtrack.metrics.tasks`)
    scene_seed      None for a recording
    tracker_seed    seed of the tracker's random generators
    config          canonical JSON of the tracker's name and parameters
    code_hash       of the tracker's source code
    weights         digest of the weight files that the tracker declares (`irtrack.registry.identity`); '' without any
    """

    source_hash: str
    target: str | None
    start: str
    input: Input
    scene_seed: int | None
    tracker_seed: int
    config: str
    code_hash: str
    task: Task = "single"
    weights: str = ""

    @property
    def digest(self) -> str:
        """Hex digest: the primary key of a results file."""
        values = [getattr(self, field.name) for field in fields(self)]  # `astuple` takes ten times as long
        return hashlib.blake2b(json.dumps(values).encode(), digest_size=16).hexdigest()


@dataclass(frozen=True, slots=True)
class Run:
    """Call of the bench: its start (UTC, ISO 8601), command line and versions; command is None for Python code."""

    id: int
    started: str
    command: str | None
    versions: dict[str, str]


@dataclass(frozen=True, slots=True)
class SourceRow:
    """Source on which a tracker was run, as stored in a results file.

    scene_hash   hash of the scenario without its seed; of a recording, its hash
    text         kind 'scenario': the whole scenario as YAML, with its seed; 'recording': its path
    word         its name on a command line;  changes  KEY=VALUE overrides after the name
    severity     severity of a scenario that has severities
    size         (columns, rows)
    length       number of frames
    """

    hash: str
    scene_hash: str
    name: str
    kind: Literal["scenario", "recording"]
    text: str
    word: str
    size: tuple[int, int]
    rate_hz: float
    length: int
    changes: tuple[str, ...] = ()
    severity: int | None = None


def family(source: str, severity: int | None) -> str:
    """Return the name of a source without its severity."""
    return source if severity is None else source.removesuffix(f"@{severity}")


@dataclass(frozen=True, slots=True)
class RunRecord:
    """Run record: one tracker on one source with one pair of seeds (table `cells`).

    label     of the tracker in tables;  source  name of the source
    scene_hash, severity   see `SourceRow`
    status    'failed' where the tracker raised, hung or died; then `failure` is the error text and `score` is None
    outcome   digest of its track frame by frame, times aside (`irtrack.metrics.Trace.digest`)
    score     of the task single;  figures  by name, of the other tasks
    """

    key: Key
    label: str
    source: str
    scene_hash: str
    status: Literal["ok", "failed"]
    failure: str | None = None
    score: Score | None = None
    severity: int | None = None
    outcome: str | None = None
    figures: Mapping[str, float | None] = field(default_factory=dict)

    @property
    def family(self) -> str:
        """Name of the source without its severity."""
        return family(self.source, self.severity)

    @property
    def lost_or_failed(self) -> bool:
        """True where the tracker lost the target or failed; False where it is unknown."""
        return self.status == "failed" or (self.score is not None and self.score.lost is True)

    @property
    def config(self) -> dict[str, Any]:
        """Name and parameters of the tracker."""
        return dict(json.loads(self.key.config))

    @property
    def needs(self) -> tuple[str, ...]:
        """Inputs of the tracker besides pictures (`irtrack.registry.identity.tracker_needs`)."""
        return tuple(self.config.get("needs", ()))


_HEAD = struct.Struct("<I")
"""Length of the JSON list that follows, bytes."""

_LEVEL = 1
"""Compression level of zlib: tracks are at most 5 % larger than at the default level 6, and take a third of the
time."""


MOST_BYTES = 1 << 28
"""Largest size of unpacked arrays, bytes: tracks of a million frames. Without a limit, a small forged file could fill
the memory."""


def pack(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return arrays as one zlib stream: a JSON list of (name, dtype, shape), then their bytes in turn."""
    described = json.dumps([(name, array.dtype.str, array.shape) for name, array in arrays.items()]).encode()
    parts = [_HEAD.pack(len(described)), described, *(array.tobytes() for array in arrays.values())]
    return zlib.compress(b"".join(parts), _LEVEL)


def unpack(blob: bytes) -> dict[str, np.ndarray]:
    """Return the arrays packed by `pack`, read-only; ValueError for other bytes and for more than `MOST_BYTES`."""
    try:
        unpacking = zlib.decompressobj()
        data = unpacking.decompress(blob, MOST_BYTES)
        if not unpacking.eof:
            raise ValueError(f"no packed arrays, or more than {MOST_BYTES >> 20} MB")
        (described,) = _HEAD.unpack_from(data)
    except (zlib.error, struct.error) as error:
        raise ValueError(f"no packed arrays: {error}") from None
    at = _HEAD.size + described
    arrays: dict[str, np.ndarray] = {}
    for name, dtype, shape in json.loads(data[_HEAD.size : at]):
        arrays[name] = np.frombuffer(data, dtype, math.prod(shape), at).reshape(shape)
        at += arrays[name].nbytes
    return arrays
