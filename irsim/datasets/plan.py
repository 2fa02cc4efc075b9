"""Plan of a data set: the clips of scenarios, recordings and suites, and their facts."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import fspath
from pathlib import Path
from typing import Any, NamedTuple

from irsim.config.base import Part, Several
from irsim.config.paths import is_recording
from irsim.errors import InputError, is_number, whole_number
from irsim.recording import Recording
from irsim.recording.formats import WRITERS
from irsim.recording.formats.base import Clip
from irsim.render.sources import open_rendering, open_source
from irsim.render.stream import Rendering
from irsim.scenario.loader import read_part
from irsim.types import Input, Source, expect_input

BITS_OF_DISPLAY = 8
MIN_VISIBLE = 0.1
"""Default least visible fraction of a labelled target."""


class _Suite(Part):
    """Keys of a suite of irtrack that say which scenes it has; the others are not used."""

    about: str = ""
    sources: Several[str | Mapping[str, Any]]
    seeds: int = 10
    trackers: Any = ()
    detectors: Any = ()
    tracker_seeds: Any = 1
    input: Any = "display"
    time_limit_s: Any = None


@dataclass(frozen=True)
class Job:
    """One clip to export: its source, the word that named it, and its facts."""

    source: Source
    word: str
    clip: Clip


class Settings(NamedTuple):
    """Settings that all clips of a data set share; `frames`: largest number of frames of a clip, None for all."""

    root: Path
    format: str
    input: Input
    min_visible: float
    frames: int | None = None


def checked_input(given: Input | None, format: str) -> Input:
    allowed = WRITERS[format].inputs
    if given is None:
        return allowed[0]
    expect_input(given)
    if given not in allowed:
        raise InputError(f"input {given}: {format} holds 8-bit pictures; allowed: {', '.join(allowed)}")
    return given


def checked_fraction(given: float) -> float:
    if not is_number(given) or not 0 <= given <= 1:
        raise InputError(f"min_visible {given!r}: allowed: a number from 0 to 1")
    return float(given)


def opened_clips(
    sources: Sequence[str | Path], seeds: int | None, overrides: Sequence[str]
) -> list[tuple[Source, str, str]]:
    """Return (source, its text in `sources`, name of the clip) of each scene and seed."""
    if seeds is not None:
        whole_number("seeds", seeds, 1)
    taken: dict[str, str] = {}
    found: list[tuple[Source, str, str]] = []
    for word in sources:
        for source, label, count in _scenes(word, seeds, overrides):
            if isinstance(source, Recording) or count is None:
                clips = [(source, label)]
            else:
                clips = [(source.with_seed(seed), f"{label}-s{seed}") for seed in range(count)]
            for clip, name in clips:
                if name in taken:
                    raise InputError(
                        f"{word}: a clip of {taken[name]} is called {name} already; allowed: different names of files"
                    )
                taken[name] = str(word)
                found.append((clip, str(word), name))
    if seeds is not None and not any(isinstance(source, Rendering) for source, _, _ in found):
        raise InputError("seeds of recordings; allowed for scenarios only")
    if not found:
        raise InputError("no source; allowed: scenarios, recordings and suites")
    return found


def _scenes(word: str | Path, seeds: int | None, overrides: Sequence[str]) -> Iterator[tuple[Source, str, int | None]]:
    """Yield (source, name, number of seeds or None) of a scenario, of a recording, or of each source of a suite."""
    path = Path(word)
    if is_recording(path) or "suite" not in path.stem:
        source = open_source(word, overrides)
        yield source, source.name, seeds
        return
    read = read_part(word, _Suite, default_folder="suites")
    suite: _Suite = read.part
    for each in suite.sources:
        given: Mapping[str, Any] = {"source": each} if isinstance(each, str) else each
        beside = path.parent / str(given.get("source"))
        scene = str(beside) if beside.is_file() else str(given.get("source"))
        changes = [f"{key}={json.dumps(value)}" for key, value in dict(given.get("changes") or {}).items()]
        changes += overrides
        first = open_source(scene, changes)
        label, severities = str(given.get("name") or first.name), given.get("severities") or ()
        if severities == "all":
            listed = first.scenario.severities.values() if isinstance(first, Rendering) else ()
            severities = range(min(map(len, listed), default=0))
        count = suite.seeds if seeds is None else seeds
        if not severities:
            yield first, label, count
        for severity in severities:
            yield open_source(scene, [*changes, f"severity={severity}"]), f"{label}-severity{severity}", count


def planned_jobs(opened: Sequence[tuple[Source, str, str]], splits: Sequence[str], settings: Settings) -> list[Job]:
    """Return the clips with all their facts. InputError where the format cannot hold one, and for colliding classes."""
    targets = [_targets(source) for source, _, _ in opened]
    classes = tuple(sorted({cls or "target" for each in targets for cls in each.values()})) or ("target",)
    folded: dict[str, str] = {}
    for cls in classes:
        other = folded.setdefault(cls.casefold(), cls)
        if other != cls:
            raise InputError(f"classes {other!r} and {cls!r} collide; allowed: names that differ in more than case")
    planned = []
    for (source, word, name), ids, split in zip(opened, targets, splits, strict=True):
        bits = source.bits if settings.input == "counts" else BITS_OF_DISPLAY
        frames = len(source) if settings.frames is None else min(len(source), settings.frames)
        facts = (name, split, source.size, bits, source.rate_hz, frames, tuple(ids), source.follow, classes)
        if not source.has_truth:
            raise InputError(f"{word}: has no ground truth; allowed: a scenario, or footage imported with its labels")
        if WRITERS[settings.format].target and source.follow is None:
            raise InputError(
                f"{word}: has no target to follow, and {settings.format} holds one; allowed: coco, yolo, mot"
            )
        if WRITERS[settings.format].masks == "needed":
            found = mask_rendering(source, word, needed=True)
            if found is not None and found[0].scenario.background.recorded_targets:
                raise InputError(f"{word}: the footage's own targets have no masks; allowed: coco, yolo, mot")
        planned.append(Job(source, word, Clip(*facts)))
    return planned


def _targets(source: Source) -> dict[str, str | None]:
    """Return the classes of a source's targets by id, in order."""
    if isinstance(source, Recording):
        return {target.id: target.cls for target in source.contents.targets}
    if isinstance(source, Rendering):
        return source.target_classes
    return {target.id: target.cls for truth in source.truths() for target in truth.targets}


def mask_rendering(source: Source, word: str, needed: bool) -> tuple[Rendering, int] | None:
    """Return the rendering that gives a source's masks, and its frame that is the source's first one; None where they
    are not known."""
    if isinstance(source, Rendering):
        return source, 0
    try:
        rendering, start, _ = open_rendering(fspath(source.file or word))
    except InputError as error:
        if needed:
            raise InputError(f"{error}; masks need a scenario") from None
        return None
    return rendering, start
