"""Suites: YAML files `*suite*.yaml` of sources, severities, trackers and seeds, run in all combinations; the stress
suite."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

import irsim
from irsim.config.base import Name, Part, Several, suggestion
from irsim.config.quantities import Index, Positive
from irsim.types import Input
from irtrack.bench.spec import (
    Entry,
    SourceEntry,
    SourceSpec,
    parse_detectors,
    parse_tracker_spec,
    read_spec,
    source_specs,
)
from irtrack.errors import InputError

Found = TypeVar("Found")
Item = TypeVar("Item")


class SuiteSource(Part):
    """Scenario or recording of a suite, with its overrides and severities; a text is taken as `source`."""

    source: Annotated[str, Field(min_length=1)]
    """File, looked up beside the suite first, or name of a shipped scenario."""
    changes: Mapping[str, Any] = {}
    """Values by override keys, such as `camera.netd_mk: 80`."""
    severities: Literal["all"] | Several[Index] = ()
    """Severities to run; by default the scenario's own severity."""
    target: str | None = None
    """Id of the target to track; by default the one that the source names."""
    name: Name | None = None
    """Name in tables; by default the name of the scenario or recording."""

    @model_validator(mode="before")
    @classmethod
    def _from_word(cls, value: Any) -> Any:
        return {"source": value} if isinstance(value, str) else value


class SuiteTracker(Part):
    """Tracker of a suite; a text is taken as a spec of `--trackers`: `big=grey_pf:particles=500`."""

    tracker: Annotated[str, Field(min_length=1)]
    """Name of `irtrack list`, or module:Class."""
    label: Annotated[str, Field(min_length=1, max_length=64)] | None = None
    """Label in tables; by default the name of the tracker."""
    parameters: Mapping[str, Any] = {}
    """Parameters of the tracker."""

    @model_validator(mode="before")
    @classmethod
    def _from_spec(cls, value: Any) -> Any:
        return {"tracker": value} if isinstance(value, str) else value


class SuiteFile(Part):
    """Suite as written in a YAML file."""

    about: str = ""
    """Purpose of the suite."""
    sources: Annotated[Several[SuiteSource], Field(min_length=1)]
    """Scenarios and recordings."""
    trackers: Several[SuiteTracker] = ()
    """Trackers, of one target or of many, each of which runs on all sources."""
    detectors: Several[SuiteTracker] = ()
    """Detectors, each of which runs on all sources."""
    seeds: Annotated[int, Field(ge=1, le=100_000)] = 10
    """Number of scene seeds, from 0 on; the tracker has the same seed."""
    tracker_seeds: Annotated[int, Field(ge=1, le=1000)] = 1
    """Runs of each scene, each with another tracker seed."""
    input: Literal["display", "counts"] = "display"
    """Images that trackers see."""
    time_limit_s: Positive | None = None
    """Longest time of a tracker in one run, without rendering, s; a run that takes longer fails."""

    @model_validator(mode="before")
    @classmethod
    def _is_no_scenario(cls, value: Any) -> Any:
        """Report a scenario given in place of a suite as one error instead of one for each key."""
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
    """Suite after reading and checking, as arguments of `irtrack.run_bench`."""

    about: str
    sources: list[SourceSpec]
    trackers: list[Entry]
    seeds: int
    tracker_seeds: int
    input: Input
    time_limit_s: float | None


def is_suite(word: str) -> bool:
    """Return whether an argument names a suite: `*suite*.yaml`, or without the ending a shipped suite."""
    path = Path(word)
    return "suite" in path.stem and path.suffix in {".yaml", ".yml", ""}


def load_suite(path: str | Path, trust: bool = False) -> Suite:
    """Return the suite in a YAML file, or the shipped one of that name (`suites/quick-suite`).

    trust   True: trackers of the suite may run commands (`program`, `trax`)

    All sources are opened and all trackers made. InputError with a line for each error,
    'file:line:column: key: problem; allowed: ...'.
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

    opened = list(tried("sources", suite.sources, lambda source: list(source_specs(_entry(source, folder)))))
    trackers = list(tried("trackers", suite.trackers, partial(_tracker, trust=trust)))
    trackers += tried("detectors", suite.detectors, _detector)
    if not suite.trackers and not suite.detectors:
        wrong.append(written.line(("trackers",), "it is missing; allowed: a list of trackers, or of detectors"))
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


def _tracker(tracker: SuiteTracker, trust: bool) -> Entry:
    from irtrack.registry.table import check_trusted, make

    spec = read_spec(tracker.tracker)
    check_trusted(spec.name, {**spec.parameters, **tracker.parameters}, trust)
    if tracker.label is None and not tracker.parameters:
        return parse_tracker_spec(tracker.tracker)
    return Entry(tracker.label or tracker.tracker, make(tracker.tracker, tracker.parameters))


def _detector(detector: SuiteTracker) -> Entry:
    from irtrack.detectors import make_detector

    if detector.label is None and not detector.parameters:
        (found,) = parse_detectors(detector.tracker)
        return found
    return Entry(detector.label or detector.tracker, make_detector(detector.tracker, detector.parameters))


STRESS_SUITE = "suites/stress-suite"
"""Shipped suite with a stress scenario for each cause of failure, at all of its severities."""


def stress_suite(trackers: Sequence[Entry], seeds: int, causes: Sequence[str] = (), path: str = STRESS_SUITE) -> Suite:
    """Return the stress suite for these trackers: each source varies one cause of failure, from harmless to severe.

    path   file of a suite, or name of a shipped one;  causes  names of its sources; all by default

    InputError for an unknown cause, for a source at fewer than two severities, and as for `load_suite`.
    """
    suite = load_suite(path, trust=True)  # its own trackers do not run
    by_cause = {each.name: each.family for each in suite.sources}
    known = Counter(by_cause.values())
    for name, severities in known.items():
        if severities < 2:
            raise InputError(f"{path}: {name} has at most one severity; allowed: two of its `severities`, or more")
    for cause in causes:
        if cause not in known:
            raise InputError(f"cause '{cause}': allowed: {', '.join(known)}{suggestion(cause, known)}")
    sources = [each for each in suite.sources if not causes or by_cause[each.name] in causes]
    return replace(suite, sources=sources, trackers=list(trackers), seeds=seeds)
