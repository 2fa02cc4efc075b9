"""Whether the ranges of a scenario can be: its `vary` and its severities, tried before anything is drawn."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from typing import Any

from irsim.config.diagnostics import formed, place_of
from irsim.config.overrides import placed
from irsim.config.schema import member, plain
from irsim.config.yaml_file import Document, KeyPath
from irsim.errors import InputError, Notice
from irsim.lint import unheeded
from irsim.scenario.model import Scenario
from irsim.scenario.placement_all import unmet
from irsim.scenario.severity import settle
from irsim.scenario.variation import Choice, Variation

_LONGEST = 40


def moved(document: Document, key: str, value: Any, place: str) -> Document:
    """The document with another value at an override's key, which then varies no more."""
    changed, path = placed(document, key, value, place, Scenario)
    return settle(changed, Scenario, [path])


def values_at(document: Document, scenario: Scenario, keys: Iterable[str]) -> dict[str, Any]:
    """What the scenario that the document says holds at override keys; None where there is nothing."""
    tree = plain(scenario)
    return {key: _reach(tree, placed(document, key, None, "vary", Scenario)[1]) for key in keys}


def range_faults(document: Document, scenario: Scenario) -> Iterator[Notice]:
    """Ranges that reach where no scenario can be, each value tried alone."""
    for key, base in values_at(document, scenario, scenario.vary).items():
        variation = scenario.vary[key]
        benign = base if variation.benign is None else variation.benign
        why = variation.misfit(benign)
        if why is not None:
            yield Notice(("vary", key), why)
            continue
        values = {("benign",): benign, **variation.probes()}
        # Of a choice each is a value of its own; of a span one that is wrong says enough.
        most = None if isinstance(variation, Choice) else 1
        yield from islice(_impossible(document, key, values), most)


def _impossible(document: Document, key: str, values: Mapping[KeyPath, Any]) -> Iterator[Notice]:
    """Those of a key's values, by where they are written under it, with which no scenario is formed."""
    for at, value in values.items():
        path = ("vary", key, *at)
        place = place_of(document, path)
        try:
            formed(moved(document, key, value, place), Scenario)
        except InputError as error:
            yield Notice(path, f"with {_seen(value)}: {_first(error, place)}")


def range_doubts(document: Document, scenario: Scenario) -> Iterator[Notice]:
    """Ranges that are legal but may not be meant."""
    off = places_of_parts(scenario, scenario.without)
    for key, variation in scenario.vary.items():
        path = placed(document, key, None, "vary", Scenario)[1]
        if any(path[: len(place)] == place for place in off):
            yield Notice(("vary", key), "what it varies is switched off")
        yield from islice(_unheeded(document, key, path, variation), 1)
        yield from islice(_unmakeable(document, key, variation), 1)


def places_of_parts(scenario: Scenario, names: Iterable[str]) -> list[KeyPath]:
    """Where the parts of those names stand in the scenario."""
    wanted = set(names)
    return [place[:-1] if place[-1] == "id" else place for name, place in scenario.names() if name in wanted]


def _unheeded(document: Document, key: str, path: KeyPath, variation: Variation) -> Iterator[Notice]:
    """Of a range's key that counts for nothing beside the others as the document has them."""
    for value in islice(variation.probes().values(), 1):
        for notice in unheeded(formed(moved(document, key, value, "vary"), Scenario)):
            if notice.at[: len(path)] == path or path[: len(notice.at)] == notice.at:
                yield Notice(("vary", key), notice.what)


def _unmakeable(document: Document, key: str, variation: Variation) -> Iterator[Notice]:
    """Those of a range's values with which a scenario is formed, but asks for what cannot be."""
    for at, value in reversed(variation.probes().items()):
        for notice in unmet(formed(moved(document, key, value, "vary"), Scenario)):
            yield Notice(("vary", key, *at), f"with {_seen(value)} no scenario can be made: {notice.what}")


def _reach(tree: Any, path: KeyPath) -> Any:
    for step in path:
        tree = member(tree, step)
    return tree


def _first(error: InputError, place: str) -> str:
    """The first line of an error, without the place that is told before it."""
    return str(error).splitlines()[0].removeprefix(f"{place}: ")


def _seen(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "..."
