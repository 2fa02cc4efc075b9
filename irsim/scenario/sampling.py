"""Sampling: the space of scenes that a scenario's `vary` spans, drawn at random or searched.

A *point* is a value for each key that is searched. Values of nuisance keys follow from the scene's seed.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral
from pathlib import Path
from typing import Any

from irsim.errors import InputError, counted, is_number, whole_number
from irsim.rng import stream
from irsim.scenario.loader import change, dumps, values_of
from irsim.scenario.model import Scenario, expect_scenario
from irsim.scenario.variation import Variation

Point = Mapping[str, Any]
"""Values by override key."""

_SEEDS = 2**31
"""Exclusive upper bound of the seeds of drawn scenes."""


@dataclass(frozen=True)
class Knob:
    """Key under `vary`, with its variation."""

    key: str
    """Override key."""
    variation: Variation
    benign: Any
    """Value at severity 0."""

    @property
    def severities(self) -> range:
        """Severities of the key: 0 is the benign value, and negative ones lie on its other side."""
        return self.variation.severities(self.benign)


@dataclass(frozen=True)
class Variations:
    """Keys under a scenario's `vary`, in the order of its text."""

    scenario: Scenario
    knobs: tuple[Knob, ...]
    """Keys that a search chooses."""
    nuisances: tuple[Knob, ...]
    """Keys that follow from the scene's seed."""

    def benign(self) -> Point:
        """Return the point at severity 0 of every key."""
        return {knob.key: knob.benign for knob in self.knobs}

    def at(self, shares: Sequence[float]) -> Point:
        """Return the point at quantiles from 0 to 1, one for each knob. Uniform quantiles give random draws. Raises
        InputError for other numbers."""
        place = self._coordinates("shares", shares)
        if not all(is_number(share) and 0 <= share <= 1 for share in place):
            raise InputError(f"{place}: no place in the unit cube; allowed: shares from 0 to 1")
        return {knob.key: knob.variation.quantile(float(share)) for knob, share in zip(self.knobs, place, strict=True)}

    def at_severities(self, severities: Sequence[int]) -> Point:
        """Return the point at one severity for each knob. InputError for other severities."""
        point = {}
        for knob, severity in zip(self.knobs, self._coordinates("severities", severities), strict=True):
            allowed = knob.severities
            if not isinstance(severity, Integral) or severity not in allowed:
                raise InputError(
                    f"vary: {knob.key}: there is no severity {severity!r}; allowed: {allowed[0]} to {allowed[-1]}"
                )
            point[knob.key] = knob.variation.at_severity(int(severity), knob.benign)
        return point

    def draw(self, seed: int) -> Point:
        """Return the random point that belongs to a seed. Raises InputError for a seed that is not an integer."""
        whole_number("seed", seed)
        return self.at([float(stream(seed, "sample", knob.key).random()) for knob in self.knobs])

    def concrete(self, point: Point, seed: int | None = None) -> Scenario:
        """Return the scenario at a point. `seed` sets the nuisances; by default it is the scene's own seed.

        Keys missing from the point have their benign values; the point may contain nuisances too. Raises InputError if
        the scenario is invalid.
        """
        if not isinstance(point, Mapping):
            raise InputError(f"point {point!r}: allowed: a mapping of override keys to values, such as `at` gives")
        seed = self.scenario.seed if seed is None else whole_number("seed", seed)
        known = [knob.key for knob in (*self.knobs, *self.nuisances)]
        for key in point:
            if key not in known:
                raise InputError(f"vary: there is no '{key}'; allowed: {', '.join(known) or 'nothing'}")
        circumstances = {
            knob.key: knob.variation.quantile(float(stream(seed, "nuisance", knob.key).random()))
            for knob in self.nuisances
        }
        return change(self.scenario, {"seed": seed, **self.benign(), **circumstances, **point})

    def _coordinates(self, name: str, given: Any) -> list[Any]:
        """Return `given` as a list with one value for each knob. Errors call it `name`."""
        wanted = f"{len(self.knobs)}, for {', '.join(knob.key for knob in self.knobs) or 'nothing'}"
        if not isinstance(given, Iterable) or isinstance(given, str | Mapping):
            raise InputError(f"{name} {given!r}: allowed: a list of {wanted}")
        found = list(given)
        if len(found) != len(self.knobs):
            raise InputError(f"{counted(len(found), 'coordinate')}; allowed: {wanted}")
        return found


def variations(scenario: Scenario) -> Variations:
    """Return the space of scenes that a scenario's `vary` spans."""
    expect_scenario("variations", scenario)
    bases = values_of(scenario, scenario.vary)
    knobs = [
        Knob(key, variation, bases[key] if variation.benign is None else variation.benign)
        for key, variation in scenario.vary.items()
    ]
    searched = tuple(knob for knob in knobs if not knob.variation.nuisance)
    return Variations(scenario, searched, tuple(knob for knob in knobs if knob.variation.nuisance))


def sample(scenario: Scenario, n: int, seed: int = 0, start: int = 0) -> list[Scenario]:
    """Draw `n` scenarios from a scenario's `vary`, numbered from `start` on, each with its own scene seed.

    Draw k does not depend on `n`. Raises InputError if nothing varies or a drawn scenario is invalid.
    """
    expect_scenario("sample", scenario)
    for name, given in (("n", n), ("seed", seed), ("start", start)):
        whole_number(name, given)
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


def sample_names(name: str, n: int) -> list[str]:
    """Return the file names of `n` samples, from NAME-0.yaml on, with as many digits as the last number has."""
    return [f"{name}-{index:0{len(str(n - 1))}}.yaml" for index in range(n)]


def sample_texts(
    scenario: Scenario,
    name: str,
    n: int,
    seed: int,
    repeat: str,
    folder: Path,
    progress: Callable[[int], None] | None = None,
) -> list[str]:
    """Return `n` draws of `sample` as YAML texts. Each begins with the drawn values and the command as comments.

    Raises InputError as in `sample`.

    name     name of the scenario
    repeat   command that draws the same scenarios again
    folder   folder in which the texts are stored; names of other files become relative to it
    """
    texts = []
    for index in range(n):
        (drawn,) = sample(scenario, 1, seed, start=index)
        texts.append(_sample_text(drawn, name, index, n, repeat, scenario.vary, folder))
        if progress is not None:
            progress(index + 1)
    return texts


def _sample_text(drawn: Scenario, name: str, index: int, n: int, repeat: str, keys: Iterable[str], folder: Path) -> str:
    head = [f"Sample {index} of {n} drawn from {name}; all of them again: {repeat}"]
    head += [f"{key} = {json.dumps(value)}" for key, value in values_of(drawn, keys).items()]
    return "".join(f"# {' '.join(line.split())}\n" for line in head) + dumps(drawn, True, folder)
