"""Validation: a document becomes a scenario, or an error with all its faults at once.

Besides the checks of the model, placements must be possible, and both ends of each variation under `vary` are tried.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from irsim.config.base import KeyPath
from irsim.config.diagnostics import by_place, error_line, place_of, validate_part
from irsim.config.overrides import TABLES, set_value, table_entries
from irsim.config.schema import Slot, member, path_text
from irsim.config.serialization import plain_value
from irsim.config.yaml_text import Document
from irsim.errors import InputError, Notice
from irsim.motion import Crosses, Crossing
from irsim.scenario.model import Scenario
from irsim.scenario.occlusion_window import STILL_PX, InfeasibleError, no_frame
from irsim.scenario.placement import placements
from irsim.scenario.severity import apply_severity, table_faults
from irsim.scenario.variation import Choice
from irsim.scenario.visibility import TargetVisibility

_LONGEST = 40
"""Largest number of characters of a quoted value."""


def validate_scenario(document: Document, given: Iterable[KeyPath] = (), all_severities: bool = False) -> Scenario:
    """Return the scenario of a document at its severity. Raises InputError with one line for each fault.

    given            key paths of values set by the user: they do not vary
    all_severities   validate the scenario at its other severities too
    """
    given = list(given)
    applied, in_tables = apply_severity(document, Scenario, given), table_faults(document, Scenario)
    faults = [*in_tables.values()]
    try:
        scenario = validate_part(applied, Scenario)
    except InputError as error:
        faults += str(error).splitlines()
    else:
        if not faults:
            faults += _faults(applied, scenario, all_severities)
            if not faults:
                return scenario
    faults += _faults_of_tables(document, given, all_severities)
    raise InputError("\n".join(by_place(dict.fromkeys(faults))))


def notice_line(document: Document, notice: Notice, prefix: str = "") -> str:
    """Return 'file:line:column: key: message' for a warning or fault."""
    name = path_text(notice.at, Slot.of(Scenario), document.value)
    return error_line(document, notice.at, name, prefix + notice.message)


def values_at(document: Document, scenario: Scenario, keys: Iterable[str]) -> dict[str, Any]:
    """Return the values of the document's scenario at override keys; None where a key has no value."""
    tree = plain_value(scenario)
    found = {}
    for key in keys:
        value = tree
        for step in set_value(document, key, None, "vary", Scenario)[1]:
            value = member(value, step)
        found[key] = value
    return found


def scenario_with(document: Document, key: str, value: Any, place: str) -> Scenario:
    """Return the document's scenario with another value at an override key, which then no longer varies. Raises
    InputError if the scenario is invalid."""
    changed, path = set_value(document, key, value, place, Scenario)
    return validate_part(apply_severity(changed, Scenario, [path]), Scenario)


def short_text(value: Any) -> str:
    """Return a value as text, cut to _LONGEST characters."""
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "..."


def _faults(document: Document, scenario: Scenario, all_severities: bool) -> Iterator[str]:
    """Yield faults that the validation of the scenario's model does not find."""
    for notice in (*infeasible(scenario), *_range_faults(document, scenario)):
        yield notice_line(document, notice)
    if all_severities:
        count = min(map(len, scenario.severities.values()), default=1)
        for severity in set(range(count)) - {scenario.severity}:
            other, path = set_value(document, "severity", severity, f"severity {severity}", Scenario)
            try:
                validate_scenario(other, [path])
            except InputError as error:
                yield from str(error).splitlines()


def _faults_of_tables(document: Document, given: list[KeyPath], all_severities: bool) -> list[str]:
    """Return the faults of table entries with valid keys, for a document that has other faults too. Each entry is added
    alone to the scenario without tables; if that scenario has faults itself, none are returned."""
    in_tables = table_faults(document, Scenario)
    rest = replace(document, value={**document.value, "severity": 0, **{name: {} for name in TABLES}})
    faults: list[str] = []
    try:
        scenario = validate_part(rest, Scenario)
    except InputError:
        return []
    for name, key in table_entries(document):
        if (name, key) in in_tables:
            continue
        more = replace(rest, value={**rest.value, name: {**rest.value[name], key: document.value[name][key]}})
        try:
            scenario = validate_part(apply_severity(more, Scenario, given), Scenario)
        except InputError as error:
            faults += str(error).splitlines()
        else:
            rest = more
    return [*faults, *_faults(apply_severity(rest, Scenario, given), scenario, all_severities)]


def _range_faults(document: Document, scenario: Scenario) -> Iterator[Notice]:
    """Yield variations under `vary` with values that make the scenario invalid. Each value is tried alone."""
    for key, base in values_at(document, scenario, scenario.vary).items():
        variation = scenario.vary[key]
        benign = base if variation.benign is None else variation.benign
        misfit = variation.misfit(benign)
        if misfit is not None:
            yield Notice(("vary", key), misfit)
            continue
        values = {("benign",): benign, **variation.probes()}
        # Each value of a choice is reported, but only the first fault of an interval.
        most = None if isinstance(variation, Choice) else 1
        yield from islice(_invalid_values(document, key, values), most)


def _invalid_values(document: Document, key: str, values: Mapping[KeyPath, Any]) -> Iterator[Notice]:
    for at, value in values.items():
        path = ("vary", key, *at)
        place = place_of(document, path)
        try:
            scenario_with(document, key, value, place)
        except InputError as error:
            first = str(error).splitlines()[0].removeprefix(f"{place}: ")
            yield Notice(path, f"with {short_text(value)}: {first}")


def infeasible(scenario: Scenario) -> Iterator[Notice]:
    """Yield the crossings and placements that are impossible."""
    visibility = TargetVisibility(scenario.whole)
    for index, target in enumerate(scenario.targets):
        if isinstance(target.path, Crossing):
            try:
                _check_crossing(visibility, index)
            except InfeasibleError as fault:
                yield Notice(("targets", index, "path", fault.key), str(fault))
    for index, result in enumerate(placements(scenario)):
        if isinstance(result, InfeasibleError):
            yield Notice(("occluders", index, result.key), str(result))


def _check_crossing(visibility: TargetVisibility, index: int) -> None:
    """Raise InfeasibleError for a crossing that is impossible."""
    target = visibility.scenario.targets[index]
    path, context = target.path, visibility.context
    assert isinstance(path, Crossing)
    if path.at_frame > visibility.scenario.frames - 1:
        raise InfeasibleError("at_frame", no_frame(path.at_frame, visibility.scenario.frames))
    frame = round(path.at_frame)
    for name in (path.target, target.id):
        if not visibility.trajectories[name].target.exists(frame):
            raise InfeasibleError(
                "at_frame", f"{name} does not exist in frame {frame}; allowed: a frame in which it does"
            )
    if isinstance(path, Crosses):
        _check_range(path, visibility, frame)
    if path.separation_speed_px(context) < STILL_PX:
        raise InfeasibleError(
            "angle_deg", f"at this speed and angle it never separates from {path.target}; allowed: another angle"
        )
    for name in (path.target, target.id):
        x, y = visibility.camera.project(visibility.trajectories[name].positions)[frame]
        if not visibility.scenario.camera.geometry.inside(x, y):
            raise InfeasibleError(
                "at_frame", f"{name} is outside the picture in frame {frame}; allowed: a frame in which it is inside"
            )


def _check_range(path: Crosses, visibility: TargetVisibility, frame: int) -> None:
    """Raise InfeasibleError where the other target, or the crossing point, is behind the camera."""
    here, _, _, range_m = path.meeting(visibility.context)
    if not np.isfinite(here).all():
        raise InfeasibleError(
            "at_frame", f"{path.target} is outside the picture in frame {frame}; allowed: a frame in which it is inside"
        )
    if range_m + path.farther_m <= 0:
        away = round(range_m, 1)
        raise InfeasibleError("farther_m", f"{path.target} is at {away:g} m; allowed: more than {0 - away:g}")
