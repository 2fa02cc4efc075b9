"""Suites: a bench written down, sources by severities by trackers by seeds, as a YAML file `*suite*.yaml`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

import irsim
from irsim.config.base import Name, Part, Several
from irsim.config.quantities import Index, Positive
from irsim.types import Input
from irtrack.bench.asked import Asked, SourceEntry, asked
from irtrack.bench.specs import Entry, parse_tracker_spec
from irtrack.errors import InputError

Found = TypeVar("Found")
Item = TypeVar("Item")


class SuiteSource(Part):
    """A scenario or a recording, and how it is to be used. Its name alone may stand for it."""

    source: Annotated[str, Field(min_length=1)]
    """A file, sought beside the suite first, or the name of a shipped scenario."""
    changes: Mapping[str, Any] = {}
    """Values by override keys, such as `camera.netd_mk: 80`."""
    severities: Literal["all"] | Several[Index] = ()
    """Which severities of a scenario that has some; the scenario's own where not given."""
    target: str | None = None
    """Id of the target to follow; the source's own where not given."""
    name: Name | None = None
    """What tables call it; its own name where not given."""

    @model_validator(mode="before")
    @classmethod
    def _from_word(cls, value: Any) -> Any:
        return {"source": value} if isinstance(value, str) else value


class SuiteTracker(Part):
    """A tracker. A spec as `--trackers` takes it may stand for it: `big=grey_pf:particles=500`."""

    tracker: Annotated[str, Field(min_length=1)]
    """A name of `irtrack list`, or module:Class."""
    label: Annotated[str, Field(min_length=1, max_length=64)] | None = None
    """What tables call it; the tracker's name where not given."""
    parameters: Mapping[str, Any] = {}
    """The tracker's parameters."""

    @model_validator(mode="before")
    @classmethod
    def _from_spec(cls, value: Any) -> Any:
        return {"tracker": value} if isinstance(value, str) else value


class SuiteFile(Part):
    """A bench written down."""

    about: str = ""
    """What it is for."""
    sources: Annotated[Several[SuiteSource], Field(min_length=1)]
    """Scenarios and recordings."""
    trackers: Annotated[Several[SuiteTracker], Field(min_length=1)]
    """The trackers that run on all of them."""
    seeds: Annotated[int, Field(ge=1, le=100_000)] = 10
    """How many scene seeds, from 0 on; each is the tracker's seed too."""
    tracker_seeds: Annotated[int, Field(ge=1, le=1000)] = 1
    """How often each scene is run, each time with another tracker seed."""
    input: Literal["display", "counts"] = "display"
    """What trackers look at."""
    time_limit_s: Positive | None = None
    """A tracker that takes longer in one run, rendering apart, is stopped; the run failed."""

    @model_validator(mode="before")
    @classmethod
    def _is_no_scenario(cls, value: Any) -> Any:
        """A scenario in a suite's place is one mistake, not one for each of its keys."""
        if isinstance(value, Mapping):
            own, of_scenes = cls.model_fields.keys(), irsim.Scenario.model_fields.keys()
            if value.keys() & (of_scenes - own) and not value.keys() & (own - of_scenes):
                raise PydanticCustomError(
                    "scenario",
                    "has the keys of a scenario, not of a suite; allowed: a suite, with the keys {keys}",
                    {"keys": ", ".join(own)},
                )
        return value


@dataclass(frozen=True, eq=False)
class Suite:
    """A suite read and checked: what `irtrack.run_bench` takes."""

    about: str
    sources: list[Asked]
    trackers: list[Entry]
    seeds: int
    tracker_seeds: int
    input: Input
    time_limit_s: float | None


def is_suite(word: str) -> bool:
    """Is a suite meant? By its name: `*suite*.yaml`, or the same without the ending for a shipped one."""
    path = Path(word)
    return "suite" in path.stem and path.suffix in {".yaml", ".yml", ""}


def load_suite(path: str | Path) -> Suite:
    """The suite in a YAML file, or the shipped one of that name (`suites/quick-suite`).

    InputError: a line for each thing that is wrong, 'file:line:column: key: what; allowed: ...'. All
    sources are opened and all trackers made.
    """
    written = irsim.read_part(path, SuiteFile, default_folder="suites")
    suite, folder = written.part, Path(path).parent
    wrong: list[str] = []

    def tried(key: str, items: tuple[Item, ...], make: Callable[[Item], Found]) -> Iterator[Found]:
        for index, item in enumerate(items):
            try:
                yield make(item)
            except InputError as error:
                wrong.extend(written.line((key, index), each) for each in str(error).splitlines())

    opened = list(tried("sources", suite.sources, lambda source: list(asked(_entry(source, folder)))))
    trackers = list(tried("trackers", suite.trackers, _tracker))
    if wrong:
        raise InputError("\n".join(wrong))
    sources = [each for several in opened for each in several]
    seeds = (suite.seeds, suite.tracker_seeds)
    return Suite(suite.about, sources, trackers, *seeds, suite.input, suite.time_limit_s)


def _entry(source: SuiteSource, folder: Path) -> SourceEntry:
    beside = folder / source.source
    changes = [f"{key}={json.dumps(value)}" for key, value in source.changes.items()]  # JSON is YAML
    word = str(beside) if beside.is_file() else source.source
    return SourceEntry(word, changes, source.severities, source.target, source.name)


def _tracker(tracker: SuiteTracker) -> Entry:
    from irtrack.registry.table import make

    if tracker.label is None and not tracker.parameters:
        return parse_tracker_spec(tracker.tracker)
    return Entry(tracker.label or tracker.tracker, make(tracker.tracker, tracker.parameters))
