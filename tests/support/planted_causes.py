"""Planted causes: games by rules, and scenes of four warm bars with a tracker that loses the target by a rule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import irsim
from irsim.types import Bools, Box, Floats, Frame
from irtrack.explain.game import Game, subsets
from irtrack.types import Estimate

BARS = ("a", "b", "c", "d")
LEVELS_K = {"a": 300, "b": 310, "c": 320, "d": 330}
"""Temperature of each bar, by which the tracker knows it."""


def scene(seed: int, frames: int = 16) -> irsim.Scenario:
    """Return a scene: bars at random places above the target, which goes along the lower edge."""
    drawn = np.random.default_rng(seed)
    bars = [
        f"  - {{kind: bar, id: {name}, center_px: [{drawn.uniform(6 + 12 * at, 8 + 12 * at):.2f}, "
        f"{drawn.uniform(8, 14):.2f}], size_px: [{drawn.uniform(6, 7):.2f}, {drawn.uniform(6, 9):.2f}], "
        f"range_m: 100, temperature_k: {LEVELS_K[name]}}}"
        for at, name in enumerate(drawn.permutation(BARS))
    ]
    text = f"""
seed: {seed}
frames: {frames}
camera: {{size: [52, 40], netd_mk: 40, range_k: [250, 350], noise: [], agc: {{kind: fixed}}}}
background: {{kind: sky, horizon_k: 280, zenith_k: 270}}
targets:
  - {{id: jet, shape: {{kind: point, contrast_k: 8}},
     path: {{kind: straight, start: [10, 32], speed: 1.5, range_m: 3000}}}}
occluders:
"""
    return irsim.loads(text + "\n".join(bars))


def grey(scenario: irsim.Scenario, name: str) -> float:
    """Return the grey level of a bar, at its middle."""
    bar = next(each for each in scenario.occluders if each.name == name)
    x, y = bar.center_px
    return float(irsim.Rendering(scenario).frame(0, "display").image[round(y), round(x)])


def _holds(image: Floats, level: float) -> bool:
    """Return whether 2 x 2 pixels have a level; one column has it at the blurred edge of a brighter bar, too."""
    near = abs(image - level) <= 1
    return bool((near[1:, 1:] & near[:-1, 1:] & near[1:, :-1] & near[:-1, :-1]).any())


@dataclass(frozen=True)
class Breaker:
    """Tracker that leaves the target if a rule holds on the bars that it sees at the start.

    rule    'a', 'a and b', 'a or b' or 'never'
    greys   grey level of each bar
    error   probability, drawn at the start, that it does the opposite of the rule
    """

    rule: str
    greys: tuple[float, ...]
    error: float = 0.0
    resumable = True

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Any:
        image = frame.image.astype(float)
        seen = {name: _holds(image, level) for name, level in zip(BARS, self.greys, strict=True)}
        breaks = {"a": seen["a"], "a and b": seen["a"] and seen["b"], "a or b": seen["a"] or seen["b"]}
        chance = self.error > 0 and rng.random() < self.error
        return box.cx, box.cy, breaks.get(self.rule, False) != chance

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, Estimate]:
        x, y, breaks = state
        x += 1.5
        return (x, y, breaks), Estimate((x, y - 20 if breaks else y), (5, 5))


def planted(seed: int, rule: str, error: float = 0.0) -> tuple[irsim.Scenario, Breaker]:
    """Return a scene and the tracker that it breaks."""
    scenario = scene(seed)
    return scenario, Breaker(rule, tuple(grey(scenario, name) for name in BARS), error)


Present = frozenset[str]


def game(causes: str, rule: Callable[[Present], bool], seeds: int = 5, error: float = 0.0, seed: int = 0) -> Game:
    """Return a game in which the track is lost where `rule` holds for the present causes, by chance the opposite."""
    drawn = np.random.default_rng(seed)

    def lost(present: Present) -> Bools:
        return np.asarray((drawn.random(seeds) < error) != rule(present))

    every = frozenset(causes)
    return Game(tuple(causes), {removed: lost(every - removed) for removed in subsets(causes)}, lost(every))


RULES: dict[str, tuple[Callable[[Present], bool], dict[str, float]]] = {
    "single": (lambda present: "a" in present, {"a": 1.0}),
    "and": (lambda present: {"a", "b"} <= present, {"a": 0.5, "b": 0.5}),
    "or": (lambda present: bool({"a", "b"} & present), {"a": 0.5, "b": 0.5}),
}
