"""Points that ask for more contrast or signal-to-clutter ratio than they can have."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irsim.backgrounds import Layer
from irsim.compose import Piece, compose, contrasts
from irsim.contrast import quiet, stands_out
from irsim.detector import Sensor
from irsim.errors import Notice
from irsim.instant import Instant
from irsim.scenario import Scenario
from irsim.sprite import Sprite
from irsim.types import Box, Floats

LOOKED = 3
"""Frames, evenly spread, at which a point's light is looked at."""
ENOUGH = 0.95
"""Share of what is asked for that is no cause for a warning."""


def out_of_reach(scenario: Scenario) -> Iterator[Notice]:
    """For each point, alone before the background and without flicker, the first frame in which it falls short."""
    asking = [
        (index, key)
        for index, target in enumerate(scenario.targets)
        for key in ("contrast_k", "scr")
        if getattr(target.shape, key, None) is not None
        and scenario.is_on(target.id)
        and target.path.begins < scenario.frames
    ]
    scene = _Scene(scenario)
    for index, key in asking:
        target = scenario.targets[index]
        wanted = getattr(target.shape, key)
        first = max(target.path.begins, 0)
        for frame in np.unique(np.linspace(first, scenario.frames - 1, LOOKED).round()).astype(int).tolist():
            why = scene.shortfall(target.id, frame, key, wanted)
            if why is not None:
                asked = f"an SCR of {wanted:g}" if key == "scr" else f"{wanted:g} K"
                yield Notice(("targets", index, "shape", key), f"{target.id} asks for {asked}: at frame {frame} {why}")
                break


@dataclass(frozen=True, eq=False)
class _Scene:
    """The background of a scenario, before which points are laid one by one. Made when the first is asked for."""

    scenario: Scenario

    @cached_property
    def instant(self) -> Instant:
        return Instant.of(self.scenario, self.scenario.stage)

    @cached_property
    def layers(self) -> list[Layer]:
        farthest, *nearer = self.scenario.background.layers(self.instant.stage)
        return [farthest, *(layer for layer in nearer if self.scenario.is_on(layer.name))]

    @cached_property
    def sensor(self) -> Sensor:
        return self.scenario.camera.sensor(self.scenario.seed, self.scenario.is_on)

    def shortfall(self, name: str, frame: int, key: str, wanted: float) -> str | None:
        """What keeps a point from the brightness that it wants; None where nothing does, or it is not there."""
        sprite = self._sprite(name, frame)
        if sprite is None:
            return None
        band, noisy = self.scenario.stage.band, self.scenario.background.noisy
        noise = quiet if noisy else self.sensor.equivalent(frame)
        light, seen = compose(self.layers, [Piece(name, sprite, True)], self.instant.gaze(frame), band, noise)
        found = seen[0].scr if key == "scr" else contrasts(seen, band)[0]
        if found is None:
            return None
        if wanted < 0 and found > ENOUGH * wanted:
            return f"{found:.3g} is the most, as darker than without any light it cannot be"
        kept = 1.0 if noisy else self._kept(light, sprite.box)
        if wanted > 0 and kept < ENOUGH:
            return f"{kept:.0%} of that is left, as pixels are full"
        return None

    def _kept(self, light: Floats, box: Box) -> float:
        """Share of what a box stands out by that is left where pixels are full."""
        response = self.sensor.response
        signal = response.signal(light.astype(np.float32))
        cut = np.minimum(signal, np.float32(response.top))
        whole, left = stands_out(signal, box), stands_out(cut, box)
        return left / whole if whole > 0 else 1.0

    def _sprite(self, name: str, frame: int) -> Sprite | None:
        course = next(course for course in self.instant.courses if course.target.id == name)
        if not course.target.exists(frame):
            return None
        sprite = course.target.shape.draw(course.view(frame, self.instant.sight(frame)))
        if sprite is None or sprite.wanted is None:
            return None
        return replace(sprite, wanted=replace(sprite.wanted, gain=1.0))
