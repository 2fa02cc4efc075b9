"""Warnings of a scenario as lines of text with their positions in the file, at all severities and for `vary`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import count, islice
from os import PathLike
from pathlib import Path

from irsim.config.base import KeyPath, importing_nothing
from irsim.config.diagnostics import place_of
from irsim.config.overrides import expect_overrides, place_of_override, set_value
from irsim.config.paths import is_recording
from irsim.config.schema import Slot
from irsim.config.yaml_text import Document, parse_yaml
from irsim.errors import InputError, Notice
from irsim.lint.registry import CHECKS, ineffective, lint
from irsim.lint.values import implausible_values
from irsim.recording import open_recording
from irsim.scenario.loader import apply_overrides, read_document, scenario_document
from irsim.scenario.model import Scenario
from irsim.scenario.severity import apply_severity
from irsim.scenario.validation import infeasible, notice_line, scenario_with, short_text, validate_scenario
from irsim.scenario.variation import Variation

Progress = Callable[[int, int], None]
Finding = tuple[Document, Notice]
"""Warning, with the document that holds the position of its key."""

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
"""Number in a message. Digits in names, such as jet2, do not match."""


def warnings(
    scenario: str | PathLike[str] | Scenario, overrides: Iterable[str] = (), progress: Progress | None = None
) -> list[str]:
    """Return a line 'file:line:column: key: warning: message' for each valid but doubtful value of a scenario.

    scenario    file, name of a shipped scenario, or loaded scenario
    overrides   KEY=VALUE. Unless one of them sets `severity`, all severities are checked, and a warning that holds at
                some of them lists them and has the position at the first
    progress    called with the number of checks done and the number of all checks

    Raises InputError as in `irsim.load`.
    """
    read = scenario_document(scenario) if isinstance(scenario, Scenario) else read_document(scenario, Scenario)
    document, given = apply_overrides(read, overrides)
    try:
        found = list(_merged(_at_each_severity(document, given, progress)))
    except InputError:
        validate_scenario(document, given, all_severities=True)  # all faults at once
        raise
    return [_warning(*each) for each in found]


def unheeded(path: str | PathLike[str], overrides: Sequence[str], without: Sequence[str] = ()) -> list[str]:
    """Return a warning for each override without effect on a scenario, or on the scenario in a recording.

    An override has no effect if another key replaces its key, or if `without` switches off its part: "override
    camera.netd_mk: warning: does not count for a detector of kind electrons: its own keys decide". Raises InputError as
    `irsim.load`.
    """
    if not overrides:
        return []
    if not is_recording(Path(path)):
        return _unheeded(read_document(path, Scenario), expect_overrides(overrides), without)
    text = open_recording(Path(path)).scenario_text
    if text is None:
        return []
    with importing_nothing():
        return _unheeded(parse_yaml(text, f"{path}: scenario"), list(overrides), without)


def _unheeded(document: Document, overrides: list[str], without: Sequence[str]) -> list[str]:
    document, paths = apply_overrides(document, overrides)
    scenario = validate_scenario(document, paths)
    document = apply_severity(document, Scenario, paths)
    off = scenario.model_copy(update={"without": (*scenario.without, *without)})
    keys = {place_of_override(text): text.partition("=")[0].strip() for text in overrides}
    found = [notice for notice in ineffective(off) if place_of(document, notice.at) in keys]
    places = _places_of_parts(scenario, without)
    for place, key in keys.items():
        path = set_value(document, key, None, place, Scenario)[1]
        if any(path[: len(part)] == part for part in places):
            found.append(Notice(path, "its part is switched off"))
    return [_warning(document, notice) for notice in found]


def _at_each_severity(document: Document, given: list[KeyPath], progress: Progress | None) -> list[list[Finding]]:
    """Return the warnings at each severity. Each severity is validated once, as placing occluders takes long."""
    chosen = ("severity",) in given
    scenario = validate_scenario(document, given, all_severities=chosen)
    severities = 0 if chosen else min(map(len, scenario.severities.values()), default=0)
    done, total = count(1), len(CHECKS) * max(severities, 1)

    def checked() -> None:
        if progress is not None:
            progress(next(done), total)

    if not severities:
        return [_findings(document, given, scenario, checked)]
    found = []
    for severity in range(severities):
        other, path = set_value(document, "severity", severity, f"severity {severity}", Scenario)
        paths = [*given, path]
        judged = scenario if severity == scenario.severity else validate_scenario(other, paths)
        found.append(_findings(other, paths, judged, checked))
    return found


def _findings(
    document: Document, given: list[KeyPath], scenario: Scenario, checked: Callable[[], None]
) -> list[Finding]:
    document = apply_severity(document, Scenario, given)
    values = implausible_values(Slot.of(Scenario), document.value)
    notices = (*values, *lint(scenario, checked), *_range_notices(document, scenario))
    return [(document, notice) for notice in notices]


def _merged(found: Sequence[Iterable[Finding]]) -> Iterator[Finding]:
    """Yield each distinct warning once, naming its severities unless it holds at all of them.

    Warnings that differ only in numbers are not distinct: the first one represents them.
    """
    groups: dict[tuple[object, ...], list[tuple[int, Document, Notice]]] = {}
    for severity, findings in enumerate(found):
        times: Counter[tuple[object, ...]] = Counter()
        for document, notice in findings:
            key = (notice.at, _NUMBER.sub("#", notice.message))
            times[key] += 1
            groups.setdefault((*key, times[key]), []).append((severity, document, notice))
    for each in groups.values():
        (_, document, notice), at = each[0], [severity for severity, _, _ in each]
        equal = all(other.message == notice.message for _, _, other in each)
        where = "" if equal and len(at) == len(found) else f"{_severities_text(at)}: "
        first = "" if equal else "at the first of them: "
        yield document, notice._replace(message=f"{where}{first}{notice.message}")


def _severities_text(severities: Sequence[int]) -> str:
    """Return severities as text: 'at severity 2', 'at severities 2, 3 and 5', 'at severities 1 to 4'."""
    *others, last = map(str, severities)
    if len(others) > 1 and severities[-1] - severities[0] == len(others):
        return f"at severities {others[0]} to {last}"
    return f"at severities {', '.join(others)} and {last}" if others else f"at severity {last}"


def _range_notices(document: Document, scenario: Scenario) -> Iterator[Notice]:
    """Yield warnings of entries under `vary`: of parts switched off, without effect, or with impossible placements."""
    off = _places_of_parts(scenario, scenario.without)
    for key, variation in scenario.vary.items():
        path = set_value(document, key, None, "vary", Scenario)[1]
        if any(path[: len(place)] == place for place in off):
            yield Notice(("vary", key), "its part is switched off")
        yield from islice(_ineffective_range(document, key, path, variation), 1)
        yield from islice(_unplaceable(document, key, variation), 1)


def _ineffective_range(document: Document, key: str, path: KeyPath, variation: Variation) -> Iterator[Notice]:
    for value in islice(variation.probes().values(), 1):
        for notice in ineffective(scenario_with(document, key, value, "vary")):
            if notice.at[: len(path)] == path or path[: len(notice.at)] == notice.at:
                yield Notice(("vary", key), notice.message)


def _unplaceable(document: Document, key: str, variation: Variation) -> Iterator[Notice]:
    for at, value in reversed(variation.probes().items()):
        for notice in infeasible(scenario_with(document, key, value, "vary")):
            message = f"with {short_text(value)} no scenario can be made: {notice.message}"
            yield Notice(("vary", key, *at), message)


def _places_of_parts(scenario: Scenario, names: Iterable[str]) -> list[KeyPath]:
    wanted = set(names)
    return [place[:-1] if place[-1] == "id" else place for name, place in scenario.names() if name in wanted]


def _warning(document: Document, notice: Notice) -> str:
    return notice_line(document, notice, "warning: ")
