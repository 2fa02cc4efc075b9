"""Level ground below a camera, covered with textures: seen in perspective, and passing by as the camera is carried."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import cv2
import numpy as np

from irsim.backgrounds.base import Place, ViewDirection
from irsim.backgrounds.blur import blurred
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.plane import closed
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.physics.psf import PSF, GaussianPSF
from irsim.types import Floats

LEAST = 0.05
"""Sine of the angle below the level, 2.9 degrees, down to which the ground is a plane; what is seen nearer to the
horizon, or above it, is drawn as if the ground rose there, and has no horizon."""

LOWEST_M = 0.1
"""It is seen from so far above at least, m."""

MOST = 6
"""Far ground is drawn no softer than where a pixel sees 2^MOST texels across."""

SOFT_PX = 0.5
"""Where a pixel sees several texels, they are blurred by this sigma at least, px, so that what passes by does not
flicker: of a cycle of two pixels exp(-2 pi^2 0.5^2 / 4) = 0.29 is left. A pixel itself blurs by 1 / sqrt(12) px,
0.29."""


@dataclass(frozen=True)
class Level:
    """Ground `height_m` below the first place of a camera of that first geometry, under a texture of periods `shape`,
    texels down and across.

    Where the first pointing meets the ground (no farther off than at LEAST), a texel is as wide and as high in the
    picture as a pixel; on the ground it is longer than wide.
    """

    geometry: Geometry
    height_m: float
    shape: tuple[int, int]

    def seen(self, chart: Chart, place: Place) -> tuple[Floats, Floats, Floats]:
        """(rows, cols) float32 each: the column and the row of the texture that each pixel sees, and by how many
        factors of 2 it sees the texels smaller than itself."""
        (x, y, z), geometry, unit = place, self.geometry, self.geometry.ifov_rad
        first = max(-math.sin(geometry.elevation_rad), LEAST)
        wide, long = unit / first, unit / first**2  # of a texel, in heights of the first place, as all lengths here
        high = max(self.height_m - y, LOWEST_M) / self.height_m
        right, down, ahead = chart.rays
        away = _away(chart.spread(down)) * np.float32(high)
        left, top = ((length - 1) / 2 % 1 for length in geometry.size)
        across = left + x / self.height_m / wide
        along = top + (math.sqrt(1 - first**2) / first - z / self.height_m) / long
        # A pixel that sees an angle w at a depression d sees (R w)^2 / sin d of ground, R = height / sin d.
        smaller = math.log2(high * chart.pixel_rad / unit) + 1.5 * np.log2(first * _away(down))
        return (
            _within(away * chart.spread(right / wide) + np.float32(across % self.shape[1]), self.shape[1]),
            _within(np.float32(along % self.shape[0]) - away * chart.spread(ahead / long), self.shape[0]),
            chart.spread(smaller),
        )


def _away(down: Floats) -> Floats:
    """Range of the ground, in heights of the camera, by the sine of the depression."""
    away = 1 / np.maximum(down, LEAST)
    return np.asarray(away + np.maximum(LEAST - down, 0) / LEAST**2) if down.min() < LEAST else away


def _within(places: Floats, period: int) -> Floats:
    """Places less their whole periods."""
    return np.asarray(places - np.floor(places * np.float32(1 / period)) * np.float32(period))


@lru_cache(maxsize=4)
def _seen(level: Level, chart: Chart, place: Place) -> tuple[Floats, Floats, Floats]:
    """`Level.seen`, kept for all that lies on the same ground, and for a camera that stands still."""
    return level.seen(chart, place)


def _no_sharper(context: SceneContext) -> PSF:
    """The lens, with so much of a Gaussian beside it as makes it SOFT_PX wide."""
    if context.psf_px >= SOFT_PX:
        return context.psf
    if isinstance(context.psf, GaussianPSF):
        return GaussianPSF(SOFT_PX)  # to the last bit
    return context.psf.broadened(math.sqrt(SOFT_PX**2 - context.psf_px**2))


class Carpet:
    """Periodic textures (rows, cols) of one shape that lie on level ground together."""

    def __init__(self, level: Level, textures: tuple[Floats, ...], context: SceneContext) -> None:
        self._level, self._textures = level, textures
        self._psf, self._soft = context.psf, _no_sharper(context)
        self._softer: dict[int, list[Floats]] = {}
        self._kept: tuple[Floats, list[Floats]] | None = None

    def seen(self, view_direction: ViewDirection) -> list[Floats]:
        """The textures of one frame, each (rows, cols) float32."""
        columns, rows, smaller = _seen(self._level, view_direction.chart, view_direction.place)
        kept = self._kept  # once: another thread may put its own there
        if kept is None or kept[0] is not columns:
            kept = self._kept = columns, self._look_up(columns, rows, smaller)
        return kept[1]

    def _look_up(self, columns: Floats, rows: Floats, smaller: Floats) -> list[Floats]:
        """Between two softnesses, a mix of both."""
        least, most = (min(max(int(end), 0), MOST) for end in (np.floor(smaller.min()), np.ceil(smaller.max())))
        looks = [
            [np.asarray(cv2.remap(each, columns, rows, cv2.INTER_LINEAR), np.float32) for each in self._at(number)]
            for number in range(least, most + 1)
        ]
        pictures = looks[0]
        for number, (finer, softer) in enumerate(pairwise(looks), least):
            share = np.clip(smaller - np.float32(number), 0, 1)
            pictures = [
                picture + share * (later - sooner)
                for picture, sooner, later in zip(pictures, finer, softer, strict=True)
            ]
        return pictures

    def _at(self, number: int) -> list[Floats]:
        """The textures, blurred for pixels that see 2^number of their texels across."""
        if number not in self._softer:
            psf = self._soft if number else self._psf
            self._softer[number] = [closed(blurred(texture, psf, 2**number)) for texture in self._textures]
        return self._softer[number]
