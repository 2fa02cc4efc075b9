"""The space of scenes around a scenario: what its `vary` allows, drawn from by chance or searched.

A *point* is a value for each key that is searched. Nuisances are no part of it: they follow from the seed
of the scene, so that the same point is met under other circumstances by another seed.
"""

from __future__ import annotations

import json
import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from irsim.errors import InputError, as_whole, whole
from irsim.rng import stream
from irsim.scenario.loader import change, reach
from irsim.scenario.model import Scenario, expect_scenario
from irsim.scenario.variation import Variation
from irsim.wording import counted

Point = Mapping[str, Any]
"""Values by override key."""

_SEEDS = 2**31
"""Seeds of drawn scenes lie below this."""


@dataclass(frozen=True)
class Knob:
    """A key that varies."""

    key: str
    """As an override says it."""
    variation: Variation
    benign: Any
    """The value at severity 0."""

    @property
    def severities(self) -> range:
        """Whole severities, 0 the benign value; below 0 where values lie on both sides of it."""
        return self.variation.severities(self.benign)


@dataclass(frozen=True)
class Variations:
    """What may vary about a scenario, in the order of its text."""

    scenario: Scenario
    knobs: tuple[Knob, ...]
    """Those that a search chooses."""
    nuisances: tuple[Knob, ...]
    """Those that follow from the scene's seed."""

    def benign(self) -> Point:
        """The point where every severity is 0."""
        return {knob.key: knob.benign for knob in self.knobs}

    def at(self, shares: Sequence[float]) -> Point:
        """The point of a place in the unit cube, a share from 0 to 1 for each knob; uniform shares are fair draws.

        InputError for anything else.
        """
        place = self._coordinates("shares", shares)
        if not all(isinstance(share, int | float | np.integer | np.floating) and 0 <= share <= 1 for share in place):
            raise InputError(f"{place}: no place in the unit cube; allowed: shares from 0 to 1")
        return {knob.key: knob.variation.quantile(float(share)) for knob, share in zip(self.knobs, place, strict=True)}

    def at_severities(self, severities: Sequence[int]) -> Point:
        """The point of a whole severity for each knob, each one of the knob's `severities`; InputError for anything
        else."""
        steps = self._coordinates("severities", severities)
        return {
            knob.key: knob.variation.at_severity(_severity(knob, step), knob.benign)
            for knob, step in zip(self.knobs, steps, strict=True)
        }

    def draw(self, seed: int) -> Point:
        """The point that a seed gives; InputError for what is none."""
        whole("seed", seed)
        return self.at([float(stream(seed, "sample", knob.key).random()) for knob in self.knobs])

    def concrete(self, point: Point, seed: int | None = None) -> Scenario:
        """The scenario at a point, where nothing varies any more; nuisances by the scene's seed, its own where None.

        A point may lack keys, which then have their benign values, and may hold nuisances too.
        InputError where no scenario can be made of it, and for what is no point or no seed.
        """
        if not isinstance(point, Mapping):
            raise InputError(
                f"point {reprlib.repr(point)}: allowed: a mapping of override keys to values, such as `at` gives"
            )
        seed = self.scenario.seed if seed is None else whole("seed", seed)
        known = [knob.key for knob in (*self.knobs, *self.nuisances)]
        for key in point:
            if key not in known:
                raise InputError(f"vary: there is no '{key}'; allowed: {', '.join(known) or 'nothing'}")
        circumstances = {
            knob.key: knob.variation.quantile(float(stream(seed, "nuisance", knob.key).random()))
            for knob in self.nuisances
        }
        return change(self.scenario, {"seed": seed, **self.benign(), **circumstances, **point})

    def _coordinates(self, what: str, given: Any) -> list[Any]:
        """One for each knob, of whatever type, from what a caller gave for `what`."""
        wanted = f"{len(self.knobs)}, for {', '.join(knob.key for knob in self.knobs) or 'nothing'}"
        try:
            found = None if isinstance(given, str | bytes | Mapping) else list(given)
        except TypeError:
            found = None
        if found is None:
            raise InputError(f"{what} {reprlib.repr(given)}: allowed: a list of {wanted}")
        if len(found) != len(self.knobs):
            raise InputError(f"{counted(len(found), 'coordinate')}; allowed: {wanted}")
        return found


def _severity(knob: Knob, given: Any) -> int:
    """One of a knob's severities from what a caller gave for it."""
    try:
        severity = as_whole(given)
    except TypeError:
        severity = None
    if severity is None or severity not in knob.severities:
        first, last = knob.severities[0], knob.severities[-1]
        raise InputError(f"vary: {knob.key}: there is no severity {given!r}; allowed: {first} to {last}")
    return severity


def variations(scenario: Scenario) -> Variations:
    """The space that a scenario's `vary` spans around it."""
    expect_scenario("variations", scenario)
    bases = reach(scenario, scenario.vary)
    knobs = [
        Knob(key, variation, bases[key] if variation.benign is None else variation.benign)
        for key, variation in scenario.vary.items()
    ]
    searched = tuple(knob for knob in knobs if not knob.variation.nuisance)
    return Variations(scenario, searched, tuple(knob for knob in knobs if knob.variation.nuisance))


def sample(scenario: Scenario, n: int, seed: int = 0, start: int = 0) -> list[Scenario]:
    """`n` scenarios drawn from what `vary` allows, each with a scene seed of its own.

    Draw k is the same for any `n`; those from `start` on are given. InputError where nothing varies,
    where no scenario can be made of a draw, and for what is no whole number.
    """
    expect_scenario("sample", scenario)
    for what, given in (("n", n), ("seed", seed), ("start", start)):
        whole(what, given)
    if not scenario.vary:
        raise InputError("vary: nothing varies in this scenario; allowed: override keys, each with a kind of variation")
    space = variations(scenario)
    drawn = []
    for k in range(start, start + n):
        own = int(stream(seed, "sample", k).integers(_SEEDS))
        point = space.draw(own)
        try:
            drawn.append(space.concrete(point, own))
        except InputError as error:
            values = ", ".join(f"{key}={json.dumps(value)}" for key, value in point.items())
            raise InputError(f"draw {k} of seed {seed} cannot be ({values}): {error}") from None
    return drawn
