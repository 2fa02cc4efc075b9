"""Warnings about point targets whose requested contrast or signal-to-clutter ratio is unreachable."""

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

_FRAMES = 3
"""Number of evenly spread frames in which each point target is drawn."""
_ENOUGH = 0.95
"""Fraction of the requested contrast or SCR that counts as reached."""


def contrast_unreachable(scenario: Scenario) -> Iterator[Notice]:
    """Warn of each point target, drawn alone and without flicker, that misses its requested contrast or SCR."""
    probe = _ContrastProbe(scenario)
    for index, target in enumerate(scenario.targets):
        if not scenario.is_on(target.id) or target.path.begins >= scenario.frames:
            continue
        key = next((key for key in ("contrast_k", "scr") if getattr(target.shape, key, None) is not None), None)
        if key is None:
            continue
        wanted, first = getattr(target.shape, key), max(target.path.begins, 0)
        for frame in np.unique(np.linspace(first, scenario.frames - 1, _FRAMES).round()).astype(int).tolist():
            reason = probe.shortfall(target.id, frame, key, wanted)
            if reason is not None:
                requested = f"an SCR of {wanted:g}" if key == "scr" else f"{wanted:g} K"
                message = f"{target.id} requires {requested}: at frame {frame} {reason}"
                yield Notice(("targets", index, "shape", key), message)
                break


@dataclass(frozen=True, eq=False)
class _ContrastProbe:
    """Renderer that draws point targets one by one. It is created when the first point target is drawn."""

    scenario: Scenario

    @cached_property
    def renderer(self) -> Renderer:
        return Renderer(self.scenario)

    def shortfall(self, name: str, frame: int, key: str, wanted: float) -> str | None:
        """Return the reason why a target misses its contrast in a frame; None where the contrast is reached or the
        target does not exist."""
        piece = self._point(name, frame)
        if piece is None:
            return None
        renderer, band = self.renderer, self.scenario.context.band
        view_direction, noise = renderer.now(frame).view_direction(frame), renderer.noise(frame)
        light, rendered = compose(renderer.layers, [piece], view_direction, band, noise)
        sprite = piece.sprite
        if key == "scr" and math.isinf(scr(light, sprite.box, noise)):
            return "it is invisible, with neither noise nor clutter around it; allowed: noise, clutter, or contrast_k"
        found = rendered[0].scr if key == "scr" else contrast_k(rendered[0], band)
        if found is None:
            return None
        if wanted < 0 and found > _ENOUGH * wanted:
            return f"{found:.3g} is the limit, a point without any radiance"
        return None if self.scenario.background.has_noise else self._cut_off(light, sprite.box, frame)

    def _cut_off(self, light: Floats, box: Box, frame: int) -> str | None:
        """Return the message if saturation removes too much of a box's contrast to its surroundings, else None."""
        sensor = self.renderer.sensor
        response = sensor.response
        whole = ring_contrast(
            response.signal(light if sensor.vignetting is None else light * sensor.vignetting(frame)), box
        )
        full = np.minimum(sensor.pixel_signal(light, frame), np.float32(response.top))
        ends = {"full": full, "at count 0": np.maximum(full, np.float32(response.bottom))}
        for state, held in ends.items():
            left = ring_contrast(held, box)
            if abs(whole) > 0 and left / whole < _ENOUGH:
                return f"{max(left / whole, 0):.0%} of that is left, as pixels are {state}"
        return None

    def _point(self, name: str, frame: int) -> NamedSprite | None:
        trajectory = next(each for each in self.renderer.now(frame).trajectories if each.target.id == name)
        if not trajectory.target.exists(frame):
            return None
        pose = self.renderer.pose(frame)
        sprite = trajectory.target.shape.draw(trajectory.view(frame, pose))
        if sprite is None or sprite.requested is None:
            return None
        constant = sprite._replace(requested=replace(sprite.requested, gain=1.0))
        return NamedSprite(name, constant, True, trajectory.range_from_origin_m(frame, pose))
