"""Point targets, flares, and elliptic hot spots: targets without a resolved shape."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from irsim.config.quantities import Area, Fraction, Kelvin, KelvinDifference, NotNegative, Number, Positive
from irsim.geometry.context import SceneContext
from irsim.geometry.polygon import polygon_edges
from irsim.geometry.silhouette import LayeredPolygons, clip_to_view, draw_sprite
from irsim.geometry.sprite import RequestedContrast, Sprite
from irsim.physics.diffraction import with_wings
from irsim.physics.radiometry import slope
from irsim.targets.base import Shape, View, wrong_value
from irsim.types import Band, Box, Floats

FAINT_K = 0.01
"""Radiance below which the wings of a point's PSF are cut off, as a temperature difference at 300 K, K."""

SMALL_PX = 1.0
"""Diameter, px, above which a point is drawn as a disc."""

_BURNT_OUT = 1e-3
"""Share of full intensity below which a flare is absent."""

_CORNERS = 20
"""Corners of the polygon that represents an ellipse."""
_CORNER_RADIUS = math.sqrt(2 * math.pi / (_CORNERS * math.sin(2 * math.pi / _CORNERS)))
"""Distance of the corners from the centre, in semi-axes, that gives the polygon the ellipse's area. Rotated by half a
corner, the polygon lies within the ellipse's box."""


class Point(Shape):
    """Point target: an area smaller than a pixel, blurred by the optics.

    It replaces the share phi of one pixel's light, distributed by the PSF; phi is the ratio of the target's solid angle
    to the pixel's. Above one pixel in diameter the target becomes a disc of its area with blurred edges. Below, the
    blur is widened by the disc's variance, so that light and width are continuous at the transition.
    """

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = dict.fromkeys(
        ("contrast_k", "scr"), ("temperature_k", "emissivity")
    )

    area_m2: Area = 0.2
    """Projected area, m2."""
    temperature_k: Kelvin = 350.0
    """Temperature, kelvin."""
    emissivity: Fraction = 0.95
    """Emissivity."""
    contrast_k: KelvinDifference | None = None
    """Apparent temperature of the point minus its background's, K; replaces `temperature_k`. It is reached with
    nothing switched off."""
    scr: Number | None = None
    """Signal-to-clutter ratio against the background and the camera noise there; replaces `temperature_k`. A negative
    value is darker than the background, as far as `area_m2` permits. It is reached with
    nothing switched off."""

    @model_validator(mode="after")
    def _one_brightness(self) -> Point:
        if self.contrast_k is not None and self.scr is not None:
            raise wrong_value("contrast_k and scr are both set; allowed: one of them", "scr")
        return self

    def draw(self, view: View) -> Sprite | None:
        context = view.context
        middle = context.geometry.project(view.position)
        if not np.isfinite(middle).all():
            return None
        range_m = float(np.linalg.norm(view.position))
        phi = self.area_m2 * context.geometry.scale(view.position) ** 2
        gain = self.brightness(view)
        glow = float(context.grey_body_radiance(self.temperature_k, self.emissivity)) * gain
        requested = None
        if self.contrast_k is not None or self.scr is not None:
            requested = RequestedContrast(self.contrast_k, self.scr, gain)
        width = 2 * math.sqrt(phi / math.pi)
        if width <= SMALL_PX:
            return _unresolved(middle, phi, glow, range_m, requested, context)
        disc = ellipse(middle, np.full(2, width / 2), glow, range_m, context)
        if disc is None:
            return None
        side = max(width, context.psf.fwhm_px)
        return disc._replace(box=Box(*disc.center, side, side), requested=requested)


def _unresolved(
    middle: Floats, phi: float, glow: float, range_m: float, requested: RequestedContrast | None, context: SceneContext
) -> Sprite:
    """Return the sprite of a point with a solid angle of `phi` pixels; the variance of a disc is added to the PSF."""
    x, y = middle.tolist()
    spread = context.psf.broadened(math.sqrt(phi / math.pi) / 2)
    if phi * glow > 0:
        spread = with_wings(spread, _faint(context.band) / (phi * glow))
    reach = spread.support_px
    x0, y0 = round(x) - reach, round(y) - reach
    pixels = np.arange(2 * reach + 1)
    cover = spread.pixel_integral(y0 + pixels - y, x0 + pixels - x)
    alpha, width = phi * cover, context.psf.fwhm_px
    return Sprite(x0, y0, cover, alpha, glow * alpha, (x, y), (x, y), Box(x, y, width, width), range_m, 1.0, requested)


@lru_cache
def _faint(band: Band) -> float:
    """Return FAINT_K as radiance, W/m2/sr."""
    return FAINT_K * slope(band, 300.0)


class Flare(Point):
    """A flare that ignites when thrown (`path: {kind: thrown, ...}`), burns, and goes out: a point target of varying
    intensity. On a path without a beginning it burns steadily."""

    area_m2: Area = 0.3
    """Projected area at full intensity, m2."""
    temperature_k: Kelvin = 2000.0
    """Temperature of the fire, kelvin (magnesium and teflon: about 2000)."""
    rise_s: NotNegative = 0.15
    """Time constant of ignition, to 63 %, s. Above 0 the flare is dark in the frame of release and enters the ground
    truth one frame later."""
    burn_s: NotNegative = 2.5
    """Burning time before it begins to fade, s."""
    fade_s: Positive = 0.6
    """Time constant of fading, to 37 %, s."""

    @property
    def default_class(self) -> str:
        return "decoy"

    def intensity(self, age_s: float) -> float:
        """Return the intensity, 0..1, at a time after release, s."""
        if age_s == math.inf:
            return 1.0
        risen = 1 - math.exp(-age_s / self.rise_s) if self.rise_s > 0 else float(age_s >= 0)
        return risen * math.exp(-max(age_s - self.burn_s, 0.0) / self.fade_s)

    def draw(self, view: View) -> Sprite | None:
        intensity = self.intensity(view.age)
        if intensity < _BURNT_OUT:
            return None
        return Point.draw(self.model_copy(update={"area_m2": self.area_m2 * intensity}), view)


class HotSpot(Shape):
    """A warm patch, such as a fire, a sun-heated rock or a vent: an ellipse perpendicular to the line of sight."""

    size_m: Annotated[tuple[Positive, Positive], Field(strict=False)] = (2.0, 1.2)
    """[width, height], m."""
    temperature_k: Kelvin = 330.0
    """Temperature, kelvin."""
    emissivity: Fraction = 0.95
    """Emissivity."""

    @property
    def default_class(self) -> str:
        return "decoy"

    def draw(self, view: View) -> Sprite | None:
        context = view.context
        middle = context.geometry.project(view.position)
        if not np.isfinite(middle).all():
            return None
        range_m = float(np.linalg.norm(view.position))
        halves = np.array(self.size_m) / 2 * context.geometry.scale(view.position)
        glow = float(context.grey_body_radiance(self.temperature_k, self.emissivity)) * self.brightness(view)
        return ellipse(middle, halves, glow, range_m, context)


def ellipse(middle: Floats, halves: Floats, glow: float, range_m: float, context: SceneContext) -> Sprite | None:
    """Return the sprite of an ellipse of radiance `glow`, W/m2/sr; None if it is larger than the frame and out of view.

    middle, halves  (2,) px, its centre and semi-axes
    """
    angles = 2 * np.pi * (np.arange(_CORNERS) + 0.5) / _CORNERS
    corners = middle + _CORNER_RADIUS * halves * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    box = Box.from_edges(*(middle - halves).tolist(), *(middle + halves).tolist())
    window = clip_to_view(box, context) if max(box.w, box.h) > max(context.geometry.size) else box
    if window is None:
        return None
    edges = (*polygon_edges(corners), np.zeros(_CORNERS, dtype=np.int64))
    return draw_sprite(LayeredPolygons(edges, np.atleast_1d(glow), box, window, context.psf, range_m))
