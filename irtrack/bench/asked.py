"""Sources as a bench is asked for them: with changes, and at severities."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

import irsim
from irsim.types import Source
from irtrack.bench.cell import family
from irtrack.errors import InputError

AnySource: TypeAlias = str | Path | irsim.Scenario | Source


@dataclass(frozen=True, eq=False)
class SourceEntry:
    """A source and how it is to be used.

    source       a scenario's or recording's path or name, a Scenario, or a Source
    changes      KEY=VALUE over a scenario's keys
    severities   of a scenario that has some: which of them, or 'all'; none: the scenario's own
    target       id of the target to follow; None: the source's own
    name         in tables; None: its own. At severity 3 `@3` is added
    """

    source: AnySource
    changes: Sequence[str] = ()
    severities: Sequence[int] | Literal["all"] = ()
    target: str | None = None
    name: str | None = None


@dataclass(frozen=True, eq=False)
class Asked:
    """A source opened: its name in tables, and how a command names it (None, where Python gave a value).

    severity   of a scenario that has severities;  changes  KEY=VALUE
    """

    source: Source
    name: str
    word: str | None
    changes: tuple[str, ...]
    severity: int | None
    target: str | None

    @property
    def family(self) -> str:
        """What it is called at all of its severities."""
        return family(self.name, self.severity)


def asked(entry: AnySource | SourceEntry | Asked) -> Iterator[Asked]:
    """What an entry stands for, one for each severity; InputError where there is no such source or severity."""
    if isinstance(entry, Asked):
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
        yield Asked(first, name, word, changes, severity, wanted.target)
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
        yield Asked(source, named, word, (*changes, change), severity, wanted.target)


def severity_count(source: Source) -> int:
    """How many severities a source has, 0 among them; 0 of one that has none."""
    if not isinstance(source, irsim.Rendering):
        return 0
    return min(map(len, source.scenario.severities.values()), default=0)
