"""The counts that a frame has in the mean, exactly: all of them, or a region's at the cost of what is drawn there.

What is worked out of the whole picture all the same: the layers of the background, whose fields are looked up all at
once (kept for the frames that were asked for last), what saturated pixels spill, and recorded frames, whose own noise
is taken from all of each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from irsim.backgrounds import Layer, crop
from irsim.camera.detectors import Sensor
from irsim.render.composite import Piece, compose, uncovered
from irsim.render.frame import NOWHERE, Renderer
from irsim.render.instant import Shifts
from irsim.types import Floats, Slices

Region = tuple[int, int, int, int]
"""First column, first row, columns, rows."""
BLOCK_PX = 16
"""What a target touches is told in blocks of so many pixels: small shifts of it touch the same ones, whose background
is kept."""


class Levels:
    """The counts of a scenario's frames before they are rounded and clipped, (rows, cols) float64: noiseless, but for
    the noise that a recorded frame has itself. It keeps what stands in the last frames that the detector remembers."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        frames = len(renderer.lag.weights)
        self._standing = lru_cache(maxsize=frames)(self._drawn)
        self._layers = lru_cache(maxsize=2 * frames)(self._cut)
        self._without = lru_cache(maxsize=2)(lambda index, name, region: self.of(index, NOWHERE, name, region))

    def added(self, index: int, target: str, shift: tuple[float, float], region: Region | None = None) -> Floats:
        """What a target adds to a frame, moved by (dx, dy) px: the levels with it less those without it."""
        shifts = {target: shift} if any(shift) else NOWHERE
        left, top, columns, rows = whole = region or (0, 0, *self._renderer.context.geometry.size)
        touched = self._touched(index, target, shifts, whole)
        added = np.zeros((rows, columns))
        if touched is not None:
            part = slices((touched[0] - left, touched[1] - top, *touched[2:]))
            added[part] = self.of(index, shifts, region=touched) - self._without(index, target, touched)
        return added

    def _touched(self, index: int, target: str, shifts: Shifts, region: Region) -> Region | None:
        """The part of a region in which a target may change a frame; None where that is none of it."""
        renderer = self._renderer
        if self._spreads:
            return region
        shown = renderer.sensor.shown(index)
        frames = {max(shown - back, 0) for back in range(len(renderer.lag.weights))}
        sprites = [piece.sprite for k in frames for piece in self._pieces(k, shifts, None) if piece.name == target]
        if not sprites:
            return None
        firsts = np.array([(sprite.x0, sprite.y0) for sprite in sprites])
        lasts = firsts + np.array([sprite.alpha.shape[::-1] for sprite in sprites])
        left, top = np.maximum(firsts.min(axis=0) // BLOCK_PX * BLOCK_PX, region[:2]).tolist()
        ends = -(-lasts.max(axis=0) // BLOCK_PX) * BLOCK_PX
        right, bottom = np.minimum(ends, np.add(region[:2], region[2:])).tolist()
        return (left, top, right - left, bottom - top) if left < right and top < bottom else None

    @property
    def _spreads(self) -> bool:
        """May a change of light in one place change counts anywhere else?"""
        return self._renderer.film is not None or self._renderer.sensor.bloom is not None

    def of(
        self, index: int, shifts: Shifts = NOWHERE, absent: str | None = None, region: Region | None = None
    ) -> Floats:
        """Those of a frame, with targets moved, and one not drawn at all; of a region within the picture, if given.

        Targets that ask for a contrast or an SCR have the light that frames show, whatever is moved or left out.
        """
        renderer, sensor = self._renderer, self._renderer.sensor
        renderer.check(index)
        if region is not None and self._spreads:
            return self.of(index, shifts, absent)[slices(region)]
        if renderer.film is not None:
            pieces = self._pieces(index, shifts, absent)
            light = self._whole(index, pieces)
            return renderer.film.insert_into(light, index, uncovered(pieces, light))
        lag = renderer.scenario.camera.lag(renderer.scenario.is_on)  # its own: what it keeps is that of these targets
        shown = sensor.shown(index)

        def light_of(frame: int) -> Floats:
            return self._light(frame, self._pieces(frame, shifts, absent), region)

        return self._sensor(region).mean(lag.light(shown, light_of), shown)

    def _sensor(self, region: Region | None) -> Sensor:
        """The detector; of a region alone, where none of it blooms."""
        sensor = self._renderer.sensor
        falloff = sensor.falloff
        if region is None or falloff is None:
            return sensor
        return replace(sensor, falloff=lambda index: falloff(index)[slices(region)])

    def _drawn(self, frame: int) -> Sequence[Piece]:
        """All that stands in a frame, nothing moved."""
        return list(self._renderer.pieces(frame, exactly=True))

    def _pieces(self, frame: int, shifts: Shifts, absent: str | None) -> Sequence[Piece]:
        pieces = [piece for piece in self._standing(frame) if piece.name != absent]
        if not shifts:
            return pieces
        moved = {piece.name: piece for piece in self._renderer.pieces(frame, shifts, exactly=True, only=list(shifts))}
        return [moved.get(piece.name, piece) for piece in pieces]

    def _light(self, frame: int, pieces: Sequence[Piece], region: Region | None) -> Floats:
        if region is None:
            return self._whole(frame, pieces)
        left, top, columns, rows = region
        near = [piece for piece in pieces if piece.sprite.within((rows, columns), (left, top)) is not None]
        layers = self._layers(frame, region)
        if layers is None or any(piece.sprite.wanted is not None for piece in near):  # that depends on more around it
            return self._whole(frame, pieces)[slices(region)]
        within = [
            piece._replace(sprite=piece.sprite._replace(x0=piece.sprite.x0 - left, y0=piece.sprite.y0 - top))
            for piece in near
        ]
        return self._composed(frame, layers, within, (rows, columns))

    def _whole(self, frame: int, pieces: Sequence[Piece]) -> Floats:
        renderer = self._renderer
        return self._composed(frame, renderer.layers_at(frame), pieces, renderer.context.geometry.size[::-1])

    def _composed(self, frame: int, layers: Sequence[Layer], pieces: Sequence[Piece], shape: tuple[int, int]) -> Floats:
        renderer, out = self._renderer, np.empty(shape, np.float64)
        view_direction, noise = renderer.now.view_direction(frame), renderer.noise(frame)
        return compose(layers, pieces, view_direction, renderer.context.band, noise, out, truth=False)[0]

    def _cut(self, frame: int, region: Region) -> Sequence[Layer] | None:
        """What the layers are in a region of a frame; None where one of them cannot be told by parts."""
        view_direction = self._renderer.now.view_direction(frame)
        parts = [crop(layer, view_direction, slices(region)) for layer in self._renderer.layers_at(frame)]
        found = [part for part in parts if part is not None]
        return found if len(found) == len(parts) else None


def slices(region: Region) -> Slices:
    """Rows and columns of a region."""
    left, top, columns, rows = region
    return slice(top, top + rows), slice(left, left + columns)
