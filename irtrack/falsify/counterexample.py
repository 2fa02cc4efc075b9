"""A case: one point of a scenario's space, less some of its parts and of its frames; and how to make it smaller."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import irsim
from irtrack.errors import InputError


@dataclass(frozen=True, slots=True)
class Case:
    """What a trial is of.

    point     value of each key that is searched
    without   parts that are switched off besides those that the scenario has off
    frames    how many; the scenario's own where None
    """

    point: Mapping[str, Any]
    without: tuple[str, ...] = ()
    frames: int | None = None

    def scenario(self, space: irsim.Variations, seed: int | None = None) -> irsim.Scenario | None:
        """The scene, its nuisances by the seed; None where there can be none."""
        try:
            scene = space.concrete(self.point, seed)
            changes: dict[str, Any] = {}
            if self.without:
                changes["without"] = [*scene.without, *self.without]
            if self.frames is not None:
                changes["frames"] = self.frames
            return irsim.change(scene, changes) if changes else scene
        except InputError:
            return None


Move = Callable[[Case], list[Case]]
"""Cases that are simpler than the given one, the simplest first; none where it is as simple as it gets."""


def shrink(case: Case, moves: Sequence[Move], breaks: Callable[[Sequence[Case]], Iterator[bool]]) -> Iterator[Case]:
    """Ever simpler cases that still break the rule; of the last one no move gives another.

    breaks   of cases, whether each breaks it, in their order
    """
    while True:
        before = case
        for move in moves:
            simpler = move(case)
            case = next((each for each, broken in zip(simpler, breaks(simpler), strict=False) if broken), case)
            if case in simpler:
                yield case
        if case == before:
            return


def moves(space: irsim.Variations, droppable: Sequence[str]) -> list[Move]:
    """All parts off, each part off, each key at a lower severity."""
    off = [_dropping(droppable), *(_dropping([name]) for name in droppable)] if droppable else []
    return [*off, *map(_lowering, space.knobs)]


def droppable(scenario: irsim.Scenario, needed: Collection[str | None]) -> list[str]:
    """Names of the parts that can be switched off; `needed` are those of targets that rules are about. What is set
    within parts stays: without gain control, blur or texture a scene is another one, not a simpler one."""
    kept = {*needed, *(name for name, _ in scenario.settings())}
    return [name for name, _ in scenario.names() if scenario.is_on(name) and name not in kept]


def _dropping(names: Sequence[str]) -> Move:
    def move(case: Case) -> list[Case]:
        more = [name for name in names if name not in case.without]
        return [replace(case, without=(*case.without, *more))] if more else []

    return move


def _lowering(knob: Any) -> Move:
    def move(case: Case) -> list[Case]:
        return [replace(case, point={**case.point, knob.key: value}) for value in nearer(knob, case.point[knob.key])]

    return move


def nearer(knob: Any, value: Any) -> list[Any]:
    """Values of the knob's whole severities that are nearer to its benign one than `value` is, the nearest first."""
    rising = sorted(knob.severities, key=lambda severity: (abs(severity), -severity))
    values = [knob.variation.at_severity(severity, knob.benign) for severity in rising]
    if value in values:
        severity = abs(rising[values.index(value)])
        return [each for each, lower in zip(values, rising, strict=True) if abs(lower) < severity]
    return [each for each in values if abs(each - knob.benign) < abs(value - knob.benign)]
