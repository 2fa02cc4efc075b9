"""Points that ask for more contrast or signal-to-clutter ratio than they can have."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irsim.errors import Notice
from irsim.render.composite import NamedSprite, compose, contrast_k
from irsim.render.contrast import ring_contrast, scr
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
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
    """A scenario, before whose background points are laid one by one; made ready when the first is asked for."""

    scenario: Scenario

    @cached_property
    def renderer(self) -> Renderer:
        return Renderer(self.scenario)

    def shortfall(self, name: str, frame: int, key: str, wanted: float) -> str | None:
        """What keeps a point from the brightness that it wants; None where nothing does, or it is not there."""
        piece = self._piece(name, frame)
        if piece is None:
            return None
        renderer, band = self.renderer, self.scenario.context.band
        view_direction, noise = renderer.now.view_direction(frame), renderer.noise(frame)
        light, seen = compose(renderer.layers, [piece], view_direction, band, noise)
        sprite = piece.sprite
        if key == "scr" and math.isinf(scr(light, sprite.box, noise)):
            return "neither noise nor clutter is around it, and it is invisible; allowed: noise, clutter, or contrast_k"
        found = seen[0].scr if key == "scr" else contrast_k(seen[0], band)
        if found is None:
            return None
        if wanted < 0 and found > ENOUGH * wanted:
            return f"{found:.3g} is the most, as darker than without any light it cannot be"
        return None if self.scenario.background.has_noise else self._cut_off(light, sprite.box, frame)

    def _cut_off(self, light: Floats, box: Box, frame: int) -> str | None:
        """How much of what a box stands out by is left at the ends of the counts' scale, where that is too little."""
        sensor = self.renderer.sensor
        response = sensor.response
        whole = ring_contrast(
            response.signal(light if sensor.vignetting is None else light * sensor.vignetting(frame)), box
        )
        full = np.minimum(sensor.pixel_signal(light, frame), np.float32(response.top))
        ends = {"full": full, "at count 0": np.maximum(full, np.float32(response.bottom))}
        for what, held in ends.items():
            left = ring_contrast(held, box)
            if abs(whole) > 0 and left / whole < ENOUGH:
                return f"{max(left / whole, 0):.0%} of that is left, as pixels are {what}"
        return None

    def _piece(self, name: str, frame: int) -> NamedSprite | None:
        course = next(course for course in self.renderer.courses if course.target.id == name)
        if not course.target.exists(frame):
            return None
        pose = self.renderer.pose(frame)
        sprite = course.target.shape.draw(course.view(frame, pose))
        if sprite is None or sprite.requested is None:
            return None
        steady = sprite._replace(requested=replace(sprite.requested, gain=1.0))
        return NamedSprite(name, steady, True, course.first_m(frame, pose))
