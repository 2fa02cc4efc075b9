"""All intents of a scenario: where its occluders go, what cannot be met, and what is met by too much."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.errors import InputError, Notice
from irsim.intent.crossing import check_crossing
from irsim.intent.hold import Hold
from irsim.intent.placing import place
from irsim.intent.unmet import UnmetError
from irsim.motion import Crossing
from irsim.occluders import Occluder
from irsim.scenario import Scenario
from irsim.watch import Watch


def placed(scenario: Scenario) -> tuple[Occluder, ...]:
    """The occluders, each with its place. InputError for an intent that cannot be met.

    What --without switches off plays no part: an occluder stays where it is.
    """
    if all(occluder.hides is None for occluder in scenario.occluders):
        return scenario.occluders
    watch = Watch(scenario.whole)
    found = []
    for occluder in scenario.occluders:
        try:
            found.append(place(watch, occluder) if occluder.hides is not None else occluder)
        except UnmetError as unmet:
            raise InputError(f"occluders.{occluder.name}.{unmet.key}: {unmet}") from None
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
    for index, occluder in enumerate(scenario.occluders):
        if occluder.hides is not None:
            try:
                place(watch, occluder)
            except UnmetError as fault:
                yield Notice(("occluders", index, fault.key), str(fault))


def overdone(scenario: Scenario) -> Iterator[Notice]:
    """Occluders that hide whom they shall hide for much longer, or much more of it, than asked. Every intent of the
    scenario can be met.

    Where they stand does not depend on what is switched off; for how long they hide does.
    """
    watch = Watch(scenario)
    for index, (occluder, screen) in enumerate(zip(scenario.occluders, built(scenario).occluders, strict=True)):
        if occluder.hides is None or occluder.hides not in watch.courses:
            continue
        hold = Hold(watch, screen, occluder)
        for key, why in (("frames", hold.too_long()), ("fraction", hold.too_much())):
            if why is not None:
                yield Notice(("occluders", index, key), why)
