"""Textures as the camera sees them: warped for one frame of a block, and only moved for its neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Protocol

import cv2
import numpy as np

from irsim.backgrounds.base import ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.texture import Tile
from irsim.types import Floats

BLOCK = 8
"""Frames that share a key frame; a worker of `--jobs` gets whole blocks."""

MARGIN = 16
"""How far beyond the frame's edges a key frame is painted, px: neighbours may be moved that far."""

BENT = 0.05
"""Largest bend, px, over the frame for which a neighbour counts as moved only. Backgrounds are no
truth: a twentieth of a pixel at the frame's corner is not seen, and a look-up of every pixel (four a
frame with two cloud layers, 1 ms each at 640x512) costs ten times a move."""


Move = tuple[float, float]
"""px to the right and down."""


class Seen(Protocol):
    """Textures, as a camera sees them."""

    def seen(self, view_direction: ViewDirection) -> list[Floats]:
        """The textures of one frame, each (rows, cols) float32, only to be read."""
        ...


class Painting:
    """Textures that lie in one place and drift together.

    The key frame's pictures are kept until another key is asked for, and what was last seen of them as long as nothing
    moves: what a frame looks like does not depend on which frames were asked for before.
    """

    def __init__(self, tiles: tuple[Tile, ...], drift_px_s: tuple[float, float] = (0.0, 0.0)) -> None:
        self.tiles = tiles
        self.drift_px_s = drift_px_s
        self._kept: tuple[Floats, list[Floats]] | None = None
        self._last: tuple[list[Floats], Move, list[Floats]] | None = None

    def seen(self, view_direction: ViewDirection) -> list[Floats]:
        """The textures of one frame, each (rows, cols) float32, only to be read."""
        move = None if view_direction.key is None else self._move(view_direction, view_direction.key)
        if view_direction.key is None or move is None:
            return self._look_up(view_direction)
        key = view_direction.key.chart.uv - self._drift(view_direction.key)[:, None, None]
        kept = self._kept  # once: another thread may put its own there
        if kept is None or not np.array_equal(key, kept[0]):
            kept = self._kept = key, self._look_up(view_direction.key)
        last = self._last
        if last is None or last[0] is not kept[1] or last[1] != move:
            last = self._last = kept[1], move, _shifted(kept[1], view_direction.chart.geometry.size, move)
        return last[2]

    def _drift(self, view_direction: ViewDirection) -> Floats:
        """(2,) px, right and down."""
        return np.array(self.drift_px_s) * view_direction.time

    def _look_up(self, view_direction: ViewDirection) -> list[Floats]:
        right, down = self._drift(view_direction).tolist()
        columns, rows = self.tiles[0].places(view_direction.chart, (right, down))
        return [tile.at(columns, rows) for tile in self.tiles]

    def _move(self, view_direction: ViewDirection, key: ViewDirection) -> Move | None:
        """By how much the key frame's picture has to be moved; None where that would not do."""
        right, down = (self._drift(key) - self._drift(view_direction)).tolist()
        return _move_to(view_direction.chart, key.chart, (right, down))


@lru_cache(maxsize=32)
def _move_to(chart: Chart, key: Chart, drift: Move) -> Move | None:
    """The same of two charts. Those of a camera that stands are the same ones in all frames, and textures that stand
    have one drift."""
    wanted = chart.uv + np.array(drift)[:, None, None]
    move = np.zeros(2)
    for _ in range(3):  # Newton: the map's slope is one within a few percent
        move = move + (wanted - key.moved(move)).mean(axis=(1, 2))
        if np.abs(move).max() > MARGIN - 1:
            return None
    bent = np.abs(wanted - key.moved(move)).max()
    right, down = move.tolist()
    return (right, down) if bent <= BENT else None


def _shifted(pictures: Sequence[Floats], size: tuple[int, int], move: Move) -> list[Floats]:
    """What of wider pictures is seen, only to be read."""
    middle = tuple(MARGIN + (length - 1) / 2 + by for length, by in zip(size, move, strict=True))
    shifted: list[Floats] = [np.asarray(cv2.getRectSubPix(wide, size, middle)) for wide in pictures]
    for each in shifted:
        each.flags.writeable = False
    return shifted
