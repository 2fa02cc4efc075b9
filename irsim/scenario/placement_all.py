"""All intents of a scenario: where its occluders go, what cannot be met, and what is met by too much."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from irsim.errors import InputError, Notice
from irsim.motion import Crossing
from irsim.occluders import Occluder
from irsim.scenario.model import Scenario
from irsim.scenario.placement_besides import besides
from irsim.scenario.placement_crossing import check_crossing
from irsim.scenario.placement_hold import Hold
from irsim.scenario.placement_placing import place
from irsim.scenario.placement_together import spoiled, unbroken
from irsim.scenario.placement_unmet import UnmetError
from irsim.scenario.placement_width import walled
from irsim.scenario.visibility import Watch
from irsim.types import Floats, arrays_frozen

_KEPT = 32
"""Scenarios whose occluders' places are kept: all severities of a suite's, by turns. Some take seconds to find."""


class _Parts:
    """What a scenario is made of, less what is switched off in it: copies that share their parts are the same, and so
    are those whose parts are equal, such as of a file that is read twice."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario.whole
        self.parts = tuple(getattr(scenario, key) for key in type(scenario).model_fields if key != "without")

    def __hash__(self) -> int:
        return hash((self.scenario.frames, self.scenario.seed))

    def __eq__(self, other: object) -> bool:
        try:
            return isinstance(other, _Parts) and self.parts == other.parts
        except (
            TypeError,
            ValueError,
        ):  # such as of an array that a kind of one's own holds
            return False


@dataclass(frozen=True, eq=False)
class _Placed:
    """An occluder in its place, and how much of its target it hides in each frame (`Hold.shares`), where it has one."""

    screen: Occluder
    shares: Floats | None = None


def _tried(scenario: Scenario) -> tuple[_Placed | UnmetError, ...]:
    """Each occluder in its place, or why it has none.

    What --without switches off plays no part: an occluder stays where it is.
    """
    if all(occluder.hides is None for occluder in scenario.whole.occluders):
        return tuple(map(_Placed, scenario.whole.occluders))
    return _placed_all(_Parts(scenario))


@lru_cache(maxsize=_KEPT)
def _placed_all(parts: _Parts) -> tuple[_Placed | UnmetError, ...]:
    """Worked out once for who checks a scenario, doubts and renders it."""
    watch = Watch(parts.scenario)
    return tuple(
        _place(watch, occluder) if occluder.hides is not None else _Placed(occluder)
        for occluder in parts.scenario.occluders
    )


def _place(watch: Watch, occluder: Occluder) -> _Placed | UnmetError:
    try:
        hold = place(watch, occluder)
        return arrays_frozen(_Placed(hold.screen, hold.shares))
    except UnmetError as fault:
        return UnmetError(fault.key, str(fault))  # without what it came through, which would be kept with it


def placed(scenario: Scenario) -> tuple[Occluder, ...]:
    """The occluders, each with its place. InputError for an intent that cannot be met."""
    found = []
    for occluder, tried in zip(scenario.occluders, _tried(scenario), strict=True):
        if isinstance(tried, UnmetError):
            raise InputError(f"occluders.{occluder.name}.{tried.key}: {tried}")
        found.append(tried.screen)
    return tuple(found)


def built(scenario: Scenario) -> Scenario:
    """The scenario with every occluder in its place, and what is off within parts at the value that switches it off."""
    return scenario.model_copy(update={"occluders": placed(scenario)}).shown


def unmet(scenario: Scenario) -> Iterator[Notice]:
    """What the scenario asks for that cannot be, with its place."""
    watch = Watch(scenario.whole)
    for index, target in enumerate(scenario.targets):
        if isinstance(target.path, Crossing):
            try:
                check_crossing(watch, index)
            except UnmetError as fault:
                yield Notice(("targets", index, "path", fault.key), str(fault))
    for index, screen in enumerate(_tried(scenario)):
        if isinstance(screen, UnmetError):
            yield Notice(("occluders", index, screen.key), str(screen))


def overdone(scenario: Scenario) -> Iterator[Notice]:
    """Occluders that hide whom they shall hide for much longer, or much more of it, than asked, alone or together, or
    have less than they say; those that a carried camera makes wide, and those that hide others. Every intent of the
    scenario can be met.

    Where they stand does not depend on what is switched off; for how long they hide does.
    """
    watch = Watch(scenario)
    # What has been found with nothing off holds where nothing is.
    tried = () if scenario.without else _tried(scenario)
    known = {index: each.shares for index, each in enumerate(tried) if isinstance(each, _Placed)}
    holds = {
        index: Hold(watch, screen, occluder, known.get(index))
        for index, (occluder, screen) in enumerate(zip(scenario.occluders, built(scenario).occluders, strict=True))
        if occluder.hides in watch.courses and scenario.is_on(occluder.name)
    }
    for index, hold in holds.items():
        for key, why in (("frames", hold.too_long()), ("fraction", hold.too_much()), ("range_m", walled(hold))):
            if why is not None:
                yield Notice(("occluders", index, key), why)
        lack = scenario.occluders[index].shortfall(hold.screen)
        if lack is not None:
            yield Notice(("occluders", index, lack[0]), lack[1])
    for doubt in (spoiled, unbroken, besides):
        yield from doubt(watch, holds)
