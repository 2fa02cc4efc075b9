"""Textures on level ground in perspective: `GroundTexture` for ground of a known height, `perspective_texture` for
landscapes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import cv2
import numpy as np

from irsim.backgrounds.base import Place, ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.panorama import PanoramaGrid
from irsim.backgrounds.texture import blurred_periodic, closed
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.physics.psf import PSF, GaussianPSF
from irsim.types import Floats

LEAST_SINE = 0.05
"""Sine of the least depression, 2.9 degrees, at which the ground is a plane. Directions nearer to the horizon, and
above it, show rising ground, so no horizon is visible."""

LOWEST_M = 0.1
"""Least height of the camera above the ground, m."""

MOST_OCTAVES = 6
"""Limit of the blur of far ground: a pixel covers at most 2^MOST_OCTAVES texels across."""

SOFT_PX = 0.5
"""Least blur, sigma in px, of texels smaller than a pixel, so that moving ground does not flicker: a wave of two pixels
keeps exp(-2 pi^2 0.5^2 / 4) = 0.29 of its amplitude."""

VANISHING_PX = 40.0
"""Height of the vanishing line of a landscape's ground above its drawn horizon, px. The drawn ground thus ends before
the true horizon, as at a low rise: the farthest ground, with features thinner than a pixel, is not drawn."""

SUBSAMPLES = 4, 16
"""Least and greatest number of samples over the height of a pixel: far roads are thinner than a pixel. Within these
limits, samples are as far apart on the ground as a pixel is wide there."""

STRIP = 32
"""Number of rows that are sampled together, with equal numbers of samples; they stay in the processor's cache."""

TURNED_RAD = math.atan(((math.sqrt(5) - 1) / 2) ** 3)
"""Rotation of the map of roads and water; its tangent is a power of the golden ratio, so that repetitions do not line
up."""


@dataclass(frozen=True)
class GroundPlane:
    """Plane `height_m` below the first camera position, with a texture of periods `shape`, texels down and across.

    Where the first pointing meets the ground (no farther than at LEAST_SINE), a texel appears as wide and as high as a
    pixel; on the ground it is longer than wide.
    """

    geometry: Geometry
    height_m: float
    shape: tuple[int, int]

    def places(self, chart: Chart, place: Place) -> tuple[Floats, Floats, Floats]:
        """Return the texture's column and row at each pixel, and log2 of the number of texels across a pixel, (rows,
        cols) float32 each."""
        (x, y, z), geometry, unit = place, self.geometry, self.geometry.ifov_rad
        first = max(-math.sin(geometry.elevation_rad), LEAST_SINE)
        wide, long = unit / first, unit / first**2  # size of a texel, in units of height_m
        high = max(self.height_m - y, LOWEST_M) / self.height_m
        right, down, ahead = chart.rays
        away = _relative_range(chart.at_pixels(down)) * np.float32(high)
        left, top = ((length - 1) / 2 % 1 for length in geometry.size)
        across = left + x / self.height_m / wide
        along = top + (math.sqrt(1 - first**2) / first - z / self.height_m) / long
        # A pixel of angle w at a depression d covers (R w)^2 / sin d of ground, R = height / sin d.
        octaves = math.log2(high * chart.pixel_rad / unit) + 1.5 * np.log2(first * _relative_range(down))
        return (
            _modulo(away * chart.at_pixels(right / wide) + np.float32(across % self.shape[1]), self.shape[1]),
            _modulo(np.float32(along % self.shape[0]) - away * chart.at_pixels(ahead / long), self.shape[0]),
            chart.at_pixels(octaves),
        )


def _relative_range(down: Floats) -> Floats:
    """Return the distance of the ground, in heights of the camera, by `down`, the sine of the depression."""
    away = 1 / np.maximum(down, LEAST_SINE)
    rising = np.maximum(LEAST_SINE - down, 0) / LEAST_SINE**2
    return np.asarray(away + rising) if down.min() < LEAST_SINE else away


def _modulo(places: Floats, period: int) -> Floats:
    """Return positions modulo a period."""
    return np.asarray(places - np.floor(places * np.float32(1 / period)) * np.float32(period))


@lru_cache(maxsize=4)
def _places(plane: GroundPlane, chart: Chart, place: Place) -> tuple[Floats, Floats, Floats]:
    """Return `GroundPlane.places`, cached for all textures on one plane, and for a camera at rest."""
    return plane.places(chart, place)


def softened_psf(context: SceneContext) -> PSF:
    """Return the lens's PSF, broadened to at least SOFT_PX."""
    if context.psf_px >= SOFT_PX:
        return context.psf
    if isinstance(context.psf, GaussianPSF):
        return GaussianPSF(SOFT_PX)  # exact to the last bit
    return context.psf.broadened(math.sqrt(SOFT_PX**2 - context.psf_px**2))


class GroundTexture:
    """Periodic textures (rows, cols) of one shape on a ground plane."""

    def __init__(self, plane: GroundPlane, textures: tuple[Floats, ...], context: SceneContext) -> None:
        self._plane, self._textures = plane, textures
        self._psf, self._soft_psf = context.psf, softened_psf(context)
        self._octaves: dict[int, list[Floats]] = {}
        self._last: tuple[Floats, list[Floats]] | None = None

    def sample(self, view_direction: ViewDirection) -> list[Floats]:
        """Return the textures of one frame, each (rows, cols) float32."""
        columns, rows, octaves = _places(self._plane, view_direction.chart, view_direction.place)
        last = self._last  # read once: another thread may replace it
        if last is None or last[0] is not columns:
            last = self._last = columns, self._look_up(columns, rows, octaves)
        return last[1]

    def _look_up(self, columns: Floats, rows: Floats, octaves: Floats) -> list[Floats]:
        """Return the textures at given columns and rows, interpolated between two octaves of blur."""
        ends = np.floor(octaves.min()), np.ceil(octaves.max())
        least, most = (min(max(int(end), 0), MOST_OCTAVES) for end in ends)
        samples = [
            [np.asarray(cv2.remap(each, columns, rows, cv2.INTER_LINEAR), np.float32) for each in self._octave(number)]
            for number in range(least, most + 1)
        ]
        pictures = samples[0]
        for number, (finer, softer) in enumerate(pairwise(samples), least):
            share = np.clip(octaves - np.float32(number), 0, 1)
            pictures = [
                picture + share * (later - sooner)
                for picture, sooner, later in zip(pictures, finer, softer, strict=True)
            ]
        return pictures

    def _octave(self, number: int) -> list[Floats]:
        """Return the textures, blurred for pixels 2^number texels across."""
        if number not in self._octaves:
            psf = self._soft_psf if number else self._psf
            self._octaves[number] = [closed(blurred_periodic(texture, psf, 2**number)) for texture in self._textures]
        return self._octaves[number]


def perspective_texture(texture: Floats, grid: PanoramaGrid, below: Floats, finer: float, ifov_rad: float) -> Floats:
    """Return a periodic texture on a landscape's ground, (rows, cols); at the horizon a texel is 1 / `finer` px wide.

    below: (rows, cols) px below the horizon. Near ground has texels as long as wide. Far ground, where such texels
    would be less than a row high, has one texel a row, as finer ones would flicker.
    """
    under = below + VANISHING_PX
    side, steep = texture.shape[0], VANISHING_PX * finer / ifov_rad
    far = math.sqrt(steep)  # px below the vanishing line where a texel is a row high
    along = np.where(under < far, under, 2 * far - steep / np.maximum(under, far))
    x, y = (np.mod(at, side).astype(np.float32) for at in (grid.columns * VANISHING_PX * finer / under, along))
    return np.asarray(cv2.remap(closed(texture), x, y, cv2.INTER_LINEAR))


def perspective_cover(inside: Floats, grid: PanoramaGrid, below: Floats, ifov_rad: float) -> Floats:
    """Return the cover of each pixel, (rows, cols) 0..1, by an area on a landscape's ground, `below` px below the
    horizon.

    inside: signed distance from the area's edge, texels, on a periodic square map, (side, side). The farthest ground
    lies VANISHING_PX * ifov below the horizontal; a texel is a pixel wide there.
    """
    wide, side = closed(inside), inside.shape[0]
    cosine, sine = math.cos(TURNED_RAD) / side, math.sin(TURNED_RAD) / side
    # Map positions of the farthest ground, in sides of the map.
    x, y = cosine * grid.columns - sine / ifov_rad, sine * grid.columns + cosine / ifov_rad
    farthest = x.astype(np.float32), y.astype(np.float32)
    strips = [below[row : row + STRIP] / VANISHING_PX + 1 for row in range(0, len(below), STRIP)]
    return np.concatenate([_sampled_cover(wide, farthest, strip.astype(np.float32), ifov_rad) for strip in strips])


def _sampled_cover(wide: Floats, farthest: tuple[Floats, Floats], px_per_texel: Floats, ifov_rad: float) -> Floats:
    """Return the cover of a few rows, (rows, cols) float32; px_per_texel (rows, cols): width of a texel in the
    picture."""
    side = wide.shape[0] - 1
    high = 1 / (ifov_rad * VANISHING_PX * float(px_per_texel.min()))  # length of a pixel on the ground over its width
    samples = min(max(math.ceil(high), SUBSAMPLES[0]), SUBSAMPLES[1])
    total = np.zeros_like(px_per_texel)
    for shift in (np.arange(samples) + 0.5) / samples - 0.5:
        near = px_per_texel + np.float32(shift / VANISHING_PX)
        x, y = (at / near for at in farthest)
        for at in (x, y):
            at -= np.floor(at)
            at *= side
        edge: Floats = np.asarray(cv2.remap(wide, x, y, cv2.INTER_LINEAR), np.float32)
        edge *= near
        edge += np.float32(0.5)
        total += np.clip(edge, 0, 1, out=edge)
    return total / np.float32(samples)
