"""A document as a scenario, or all that is wrong with it at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from irsim.config.diagnostics import formed, in_order, line
from irsim.config.overrides import placed
from irsim.config.schema import Slot, shown
from irsim.config.yaml_file import Document, KeyPath
from irsim.errors import InputError, Notice
from irsim.scenario.model import Scenario
from irsim.scenario.placement_all import unmet
from irsim.scenario.ranges import range_faults
from irsim.scenario.severity import TABLES, astray, entries, settle


def validated(document: Document, given: Iterable[KeyPath] = (), at_all_severities: bool = False) -> Scenario:
    """The scenario that a document says, at its severity; InputError, a line for each thing that is wrong.

    given              places whose values were given by hand: they vary no more
    at_all_severities  it is to be a scenario at its other severities, too
    """
    given = list(given)
    settled, lost = settle(document, Scenario, given), astray(document, Scenario)
    wrong = [*lost.values()]
    try:
        scenario = formed(settled, Scenario)
    except InputError as error:
        wrong += str(error).splitlines()
    else:
        if not wrong:
            wrong += _faults(settled, scenario, at_all_severities)
            if not wrong:
                return scenario
    wrong += _faults_of_the_rest(document, given, at_all_severities)
    raise InputError("\n".join(in_order(dict.fromkeys(wrong))))


def told(document: Document, notice: Notice, what: str) -> str:
    """'file:line:column: key: what'."""
    return line(document, notice.at, shown(notice.at, Slot.of(Scenario), document.value), what)


def _faults(document: Document, scenario: Scenario, at_all_severities: bool) -> Iterator[str]:
    """Lines on what is well formed and yet cannot be."""
    for notice in (*unmet(scenario), *range_faults(document, scenario)):
        yield told(document, notice, notice.what)
    if at_all_severities:
        most = min(map(len, scenario.severities.values()), default=1)
        for severity in set(range(most)) - {scenario.severity}:
            other, path = placed(document, "severity", severity, f"severity {severity}", Scenario)
            try:
                validated(other, [path])
            except InputError as error:
                yield from str(error).splitlines()


def _faults_of_the_rest(document: Document, given: list[KeyPath], at_all_severities: bool) -> list[str]:
    """Lines on what cannot be in a table when other keys of it are wrong; none where the scenario has faults without
    its tables, for then nothing can be tried."""
    lost = astray(document, Scenario)
    rest = replace(document, value={**document.value, "severity": 0, **{table: {} for table in TABLES}})
    wrong: list[str] = []
    try:
        scenario = formed(rest, Scenario)
    except InputError:
        return []
    for table, key in entries(document):
        if (table, key) in lost:
            continue
        more = replace(rest, value={**rest.value, table: {**rest.value[table], key: document.value[table][key]}})
        try:
            scenario = formed(settle(more, Scenario, given), Scenario)
        except InputError as error:
            wrong += str(error).splitlines()
        else:
            rest = more
    return [*wrong, *_faults(settle(rest, Scenario, given), scenario, at_all_severities)]
