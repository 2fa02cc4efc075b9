"""Specs of a bench: trackers, ``[LABEL=]NAME[:KEY=VALUE...]`` separated by commas, and sources with their changes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import irsim
from irsim.types import Source
from irtrack.bench.records import family
from irtrack.errors import InputError
from irtrack.tracks import MultiTracker
from irtrack.types import Detector, GivenTracker

_LABEL = re.compile(r"[\w.+-]{1,64}")

_PAIR = re.compile(r"\w+=")


@dataclass(frozen=True, slots=True)
class Entry:
    """Tracker, tracker of many, or detector, and its label in tables."""

    label: str
    tracker: Any


def parse_trackers(text: str) -> list[Entry]:
    """Return the entries of a list such as ``grey_pf,big=grey_pf:n=500:damping=0.9,mine=pkg.mod:Class``.

    A comma or colon within brackets or quotes belongs to its value. InputError as for `parse_tracker_spec`.
    """
    return [parse_tracker_spec(part) for part in _split(text, ",")]


@dataclass(frozen=True, slots=True)
class Spec:
    """Parts of a tracker's spec as text; `label` is None where the spec gives none."""

    label: str | None
    name: str
    parameters: dict[str, object]


def parse_tracker_spec(text: str) -> Entry:
    """Return the entry of a spec; without a label the whole spec is the label.

    InputError as for `read_spec` and `irtrack.registry.table.make`.
    """
    from irtrack.registry.table import make

    spec = read_spec(text)
    return Entry(spec.label or text.strip(), make(spec.name, spec.parameters))


def parse_detectors(text: str) -> list[Entry]:
    """Return the entries of a list of detectors such as ``tophat,strict=mpcm:threshold=8,mine=pkg.mod:detect``."""
    from irtrack.detectors import make_detector

    found = []
    for part in _split(text, ","):
        spec = read_spec(part, "detector")
        found.append(Entry(spec.label or part.strip(), make_detector(spec.name, spec.parameters)))
    return found


def read_spec(text: str, what: str = "tracker") -> Spec:
    """Return the parts of a spec. VALUE is read as YAML.

    A part without ``KEY=`` continues the part before it: a VALUE (``path=a:b``), or the NAME (``trax:mine --fast=1``).
    InputError, with the spec, for an empty or unreadable spec or a repeated parameter.
    """
    first, *rest = _split(text.strip(), ":")
    label, is_labelled, name = first.rpartition("=")
    if is_labelled and not _LABEL.fullmatch(label):
        raise InputError(f"{what} '{text}': the label '{label}'; allowed: letters, digits and _ . + -")
    pairs: list[str] = []
    for part in rest:
        if _PAIR.match(part):
            pairs.append(part)
        elif pairs:
            pairs[-1] += f":{part}"
        else:
            name += f":{part}"
    if not name:
        raise InputError(f"{what} '{text}': it has no name; allowed: [LABEL=]NAME[:KEY=VALUE...]")
    parameters: dict[str, object] = {}
    for pair in pairs:
        key, _, value = pair.partition("=")
        if key in parameters:
            raise InputError(f"{what} '{text}': the parameter '{key}' is given twice")
        try:
            parameters[key] = irsim.scalar(value)
        except irsim.InputError as error:
            raise InputError(f"{what} '{text}': {key}: {error}") from None
    return Spec(label or None, name, parameters)


def entry(tracker: str | GivenTracker | MultiTracker | Detector | Entry) -> Entry:
    """Return the entry of a spec, a tracker, a plain tracker (`irtrack.types.PlainTracker`), or a detector made by
    `irtrack.make_detector`. An `Entry` of any of them keeps its label."""
    from irtrack.registry.identity import tracker_name
    from irtrack.registry.table import of

    if isinstance(tracker, Entry):
        return Entry(tracker.label, entry(tracker.tracker).tracker)
    if isinstance(tracker, str):
        return parse_tracker_spec(tracker)
    made: Any = tracker if getattr(tracker, "task", "") == "detect" else of(tracker)
    return Entry(tracker_name(made), made)


def _split(text: str, mark: str) -> list[str]:
    """Split a text at a separator, except within brackets and quotes."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        elif letter in "[{(":
            depth += 1
        elif letter in ")}]":
            depth -= 1
        if letter == mark and depth <= 0 and not quote:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


AnySource: TypeAlias = str | Path | irsim.Scenario | Source


@dataclass(frozen=True, eq=False)
class SourceEntry:
    """Source of a bench, with its overrides, severities, target and name.

    source       a scenario's or recording's path or name, a Scenario, or a Source
    changes      KEY=VALUE overrides of a scenario's keys
    severities   severities to run, or 'all'; empty: the scenario's own severity
    target       id of the target to track; None: the source's default
    name         name in tables; None: the source's own. At severity 3 `@3` is appended
    """

    source: AnySource
    changes: Sequence[str] = ()
    severities: Sequence[int] | Literal["all"] = ()
    target: str | None = None
    name: str | None = None


@dataclass(frozen=True, eq=False)
class SourceSpec:
    """Source spec: an open source, its name in tables, and its `word` on a command line (None: a Python object).

    severity   severity of a scenario that has severities;  changes  KEY=VALUE overrides
    """

    source: Source
    name: str
    word: str | None
    changes: tuple[str, ...]
    severity: int | None
    target: str | None

    @property
    def family(self) -> str:
        """Name without its severity."""
        return family(self.name, self.severity)


def source_specs(entry: AnySource | SourceEntry | SourceSpec) -> Iterator[SourceSpec]:
    """Yield the source specs of an entry, one for each severity; InputError where a source or severity is unknown."""
    if isinstance(entry, SourceSpec):
        yield entry
        return
    wanted = entry if isinstance(entry, SourceEntry) else SourceEntry(entry)
    word = str(wanted.source) if isinstance(wanted.source, str | Path) else None
    changes = tuple(wanted.changes)
    first = irsim.open_source(wanted.source, changes)
    name = wanted.name or first.name
    count = severity_count(first)
    if not wanted.severities:
        severity = first.scenario.severity if isinstance(first, irsim.Rendering) and count else None
        yield SourceSpec(first, name, word, changes, severity, wanted.target)
        return
    if not isinstance(first, irsim.Rendering) or not count:
        raise InputError(f"{name}: it has no severities; allowed: a scenario with the key `severities`")
    for severity in range(count) if wanted.severities == "all" else wanted.severities:
        if not 0 <= severity < count:
            raise InputError(f"{name}: severity {severity}: allowed: 0 to {count - 1}")
        change = f"severity={severity}"
        named = f"{name}@{severity}"
        if word is None:
            source = irsim.Rendering(irsim.change(first.scenario, {"severity": severity}), named)
        else:
            scenario = irsim.load(word, [*changes, change])
            source = irsim.Rendering(scenario, named)
        yield SourceSpec(source, named, word, (*changes, change), severity, wanted.target)


def severity_count(source: Source) -> int:
    """Return the number of severities of a source, 0 where it has none."""
    if not isinstance(source, irsim.Rendering):
        return 0
    return min(map(len, source.scenario.severities.values()), default=0)
