"""A thing drawn alone: the share of each pixel that it covers, and the light it puts there."""

from __future__ import annotations

from dataclasses import dataclass

from irsim.types import Box, Floats


@dataclass(frozen=True)
class Wanted:
    """A brightness that depends on what is behind: just one of contrast_k, K, and scr is given.

    noise_k  the camera's noise, K at 300 K: it counts as clutter
    gain     factor of the difference to what is behind
    """

    contrast_k: float | None = None
    scr: float | None = None
    noise_k: float = 0.0
    gain: float = 1.0


@dataclass(frozen=True, eq=False)
class Sprite:
    """A patch whose top-left pixel is (x0, y0); it may reach past the frame, and holds all of the thing
    that the frame can see. Arrays are (h, w) float64.

    cover     share of the pixel's area that the thing covers, 0..1, before optics: truth uses it
    alpha     share of the pixel's light that it replaces, after optics
    emission  in-band radiance that it adds, after optics, W/m2/sr: L <- L (1 - alpha) + emission
    center    (x, y) px, area centroid;  signal_center, weighted by emission
    box       tight box of the geometry
    area      px2 that the whole thing covers, what lies outside the patch too
    wanted    where its brightness depends on what is behind: what it is to be
    contrast  factor of its difference to what is behind it
    """

    x0: int
    y0: int
    cover: Floats
    alpha: Floats
    emission: Floats
    center: tuple[float, float]
    signal_center: tuple[float, float]
    box: Box
    range_m: float
    area: float
    wanted: Wanted | None = None
    contrast: float = 1.0
