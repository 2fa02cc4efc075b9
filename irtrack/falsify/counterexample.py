"""Candidates for a counterexample (points of a scenario's parameter space with parts and frames removed); shrinking."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import irsim
from irtrack.errors import InputError


@dataclass(frozen=True, slots=True)
class Candidate:
    """Candidate for a counterexample: the scene of one trial.

    point     value of each searched key
    without   names of parts of the scenario (targets, occluders, noises, ...) that are switched off
    frames    number of frames; None: the scenario's own
    """

    point: Mapping[str, Any]
    without: tuple[str, ...] = ()
    frames: int | None = None

    def scenario(self, space: irsim.Variations, seed: int | None = None) -> irsim.Scenario | None:
        """Return the scene, its nuisance values drawn with the seed; None where the values make no valid scenario."""
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


Move = Callable[[Candidate], list[Candidate]]
"""Function that returns simpler candidates, the simplest first; an empty list where none is simpler."""


def shrink(
    candidate: Candidate, moves: Sequence[Move], breaks: Callable[[Sequence[Candidate]], Iterator[bool]]
) -> Iterator[Candidate]:
    """Yield ever simpler candidates that break the rule, until no move simplifies the last one.

    breaks   function that yields for each candidate, in order, whether it breaks the rule
    """
    while True:
        before = candidate
        for move in moves:
            simpler = move(candidate)
            broken = (each for each, is_broken in zip(simpler, breaks(simpler), strict=False) if is_broken)
            candidate = next(broken, candidate)
            if candidate in simpler:
                yield candidate
        if candidate == before:
            return


def all_moves(space: irsim.Variations, names: Sequence[str]) -> list[Move]:
    """Return the simplifications: all named parts off, each part off, each varied key at a lower severity."""
    off = [_switch_off(names), *(_switch_off([name]) for name in names)] if names else []
    return [*off, *map(_lower_severity, space.knobs)]


def removable_parts(scenario: irsim.Scenario, needed: Collection[str | None]) -> list[str]:
    """Return the names of parts of a scenario that can be switched off; `needed`: names of targets that rules refer to.

    Settings within parts stay: gain control, blur and texture change a scene rather than simplify it.
    """
    kept = {*needed, *(name for name, _ in scenario.settings())}
    return [name for name, _ in scenario.names() if scenario.is_on(name) and name not in kept]


def _switch_off(names: Sequence[str]) -> Move:
    def move(candidate: Candidate) -> list[Candidate]:
        more = [name for name in names if name not in candidate.without]
        return [replace(candidate, without=(*candidate.without, *more))] if more else []

    return move


def _lower_severity(knob: Any) -> Move:
    def move(candidate: Candidate) -> list[Candidate]:
        values = lower_values(knob, candidate.point[knob.key])
        return [replace(candidate, point={**candidate.point, knob.key: value}) for value in values]

    return move


def lower_values(knob: Any, value: Any) -> list[Any]:
    """Return the values of a key at whole severities between the benign value and `value`, nearest to benign first."""
    rising = sorted(knob.severities, key=lambda severity: (abs(severity), -severity))
    values = [knob.variation.at_severity(severity, knob.benign) for severity in rising]
    if value in values:
        severity = abs(rising[values.index(value)])
        return [each for each, lower in zip(values, rising, strict=True) if abs(lower) < severity]
    return [each for each in values if abs(each - knob.benign) < abs(value - knob.benign)]
