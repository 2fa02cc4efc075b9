"""Compositing: layers and sprites drawn far to near, and the visible part of each target."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from operator import attrgetter
from typing import NamedTuple, TypeGuard

import numpy as np

from irsim._native import COMPILED, kernels
from irsim.backgrounds import Layer, ViewDirection, blend_over, is_semi_transparent, opaque_error
from irsim.geometry.sprite import AREA_ROUNDING, FULL_PATCH, OccludedBlur, Sprite, overlap
from irsim.physics.radiometry import temperature_of
from irsim.render.contrast import NoiseRadiance, no_noise, requested_radiance, scr, with_radiance
from irsim.types import Band, Floats, Slices

OCCLUDER_SHARE = 0.01
"""Least fraction of a target's area that an occluder must hide to be named in the target's truth."""


class NamedSprite(NamedTuple):
    """Sprite of a target (`tracked` is True) or of an occluder.

    range_from_origin_m  distance from the camera's first position, m, if the camera has moved, as distances of
                         occluders are measured from there. The path through the atmosphere is the sprite's distance
                         from the moved camera.
    """

    name: str
    sprite: Sprite
    tracked: bool
    range_from_origin_m: float | None = None

    @property
    def range_m(self) -> float:
        return self.sprite.range_m if self.range_from_origin_m is None else self.range_from_origin_m


@dataclass(eq=False)
class DrawnTarget:
    """Drawn target and its visible part.

    within      overlap of the target's patch and the picture, as slices of the patch and of the picture; None where
                there is none
    shown       fraction of each pixel of the patch that the target covers within the picture, (h, w), or (n, h, w) at
                the n instants of an exposure
    unoccluded  `shown` less the occluded part; both may be the sprite's own arrays and must not be changed
    inside      fraction 0..1 of the target's area that is in the picture, occluded or not
    radiances   mean radiance of the target and of the background that it replaces, W/m2/sr; nan outside the picture
    scr         signal-to-clutter ratio; None outside the picture, and where the surroundings are uniform
    requested   radiance, W/m2/sr, that gives the requested contrast or SCR; None where none is requested
    """

    piece: NamedSprite
    within: tuple[Slices, Slices] | None
    shown: Floats
    unoccluded: Floats
    inside: float
    radiances: tuple[float, float]
    scr: float | None
    requested: float | None = None
    occluders: list[str] = field(default_factory=list)

    @property
    def visible(self) -> float:
        """Return the fraction 0..1 of the target's area that is in the frame and not occluded, over the exposure."""
        if self.unoccluded is self.shown or self.within is None:
            return self.inside
        return _share(self.unoccluded, self.piece.sprite)

    @property
    def visible_cover(self) -> Floats:
        """Return the fraction of each pixel that the target visibly covers, mean over the exposure, (h, w)."""
        return self.unoccluded if self.unoccluded.ndim == 2 else np.asarray(self.unoccluded.mean(axis=0))

    def occlude(self, name: str, where: Slices, transmittance: Floats) -> None:
        """Multiply the pixels `where` of the visible patch by the transmittance (0..1) of a nearer object.

        The object is named an occluder if the part that it would hide alone is large enough, even if another object
        hides the same part.
        """
        place = (..., *where)
        there = self.shown[place]
        if _total(there * (1 - transmittance)) >= OCCLUDER_SHARE * self.piece.sprite.area:
            self.occluders.append(name)
        if there.shape == self.shown.shape:  # the object covers the whole patch: one pass
            self.unoccluded = self.unoccluded * transmittance
        else:
            unoccluded = self.unoccluded.copy()
            unoccluded[place] *= transmittance
            self.unoccluded = unoccluded


def _inside(shown: Floats, sprite: Sprite) -> float:
    """Return the fraction 0..1 of a sprite's area that is in the picture."""
    return 1.0 if shown is sprite.covers and sprite.whole else _share(shown, sprite)


def _share(cover: Floats, sprite: Sprite) -> float:
    """Return the area of a coverage map as a fraction 0..1 of the sprite's area."""
    return min(max(_total(cover) / sprite.area, 0.0), 1.0)


def _total(cover: Floats) -> float:
    """Return the area of a coverage map (h, w), px2, or its mean over the instants of (n, h, w)."""
    total = float(np.add.reduce(cover, axis=None))  # takes half the time of `cover.sum()`
    return total if cover.ndim == 2 else total / len(cover)


def compose(
    layers: Sequence[Layer],
    pieces: Iterable[NamedSprite],
    view_direction: ViewDirection,
    band: Band,
    noise: NoiseRadiance = no_noise,
    out: Floats | None = None,
    truth: bool = True,
) -> tuple[Floats, list[DrawnTarget]]:
    """Return the radiance (rows, cols), W/m2/sr, of all layers and sprites drawn far to near, and the drawn targets.

    At equal distance a layer is behind a sprite. Occluders are ordered by distance from the camera's first position.
    Targets between two occluders are drawn far to near as seen from the camera's present position.

    noise  camera noise in this frame, as radiance, for the targets' SCR
    out    (rows, cols) memory for the picture, float32 (default) or float64, which sets the precision of the sum
    truth  False: no targets are returned
    """
    under: Floats = layers[0].light(view_direction)[1]
    light = np.empty(under.shape, np.float32) if out is None else out
    targets: list[DrawnTarget] = []
    moving: list[OccludedBlur] = []
    items = _far_to_near(layers[1:], list(pieces))
    if not items or isinstance(items[0], NamedSprite) or under.dtype != light.dtype:
        light[...] = under  # Otherwise the next layer is composed from the first layer's own array, without a copy.
        under = light
    for item in items:
        if isinstance(item, NamedSprite):
            _draw(light, item if truth else item._replace(tracked=False), targets, moving, band, noise)
        else:
            _draw_layer(under, light, item, view_direction, targets, moving)
        under = light
    return light, targets


def uncovered(pieces: Iterable[NamedSprite], light: Floats) -> Floats:
    """Return the fraction of each pixel's light that comes from the background, not from sprites drawn over it; shape
    and type are those of `light`."""
    share = np.ones_like(light)
    for sprite in (piece.sprite for piece in pieces):
        met = sprite.within(share.shape)
        if met is not None:
            share[met[1]] *= np.maximum(1 - sprite.contrast * sprite.alpha[met[0]], 0)
    return share


def _far_to_near(layers: Sequence[Layer], pieces: Sequence[NamedSprite]) -> list[Layer | NamedSprite]:
    items: list[Layer | NamedSprite] = sorted([*layers, *pieces], key=attrgetter("range_m"), reverse=True)
    if all(piece.range_from_origin_m is None for piece in pieces):
        return items
    runs = [list(run) for _, run in groupby(items, key=_is_target)]
    return [item for run in runs for item in sorted(run, key=_range_key)]


def _range_key(item: Layer | NamedSprite) -> float:
    """Return a sort key that orders targets from far to near and keeps the order of layers and occluders."""
    return -item.sprite.range_m if _is_target(item) else 0.0


def _is_target(item: Layer | NamedSprite) -> TypeGuard[NamedSprite]:
    return isinstance(item, NamedSprite) and item.tracked


def contrast_k(target: DrawnTarget, band: Band) -> float | None:
    """Return the apparent temperature of a target less that of the background behind it, K, from mean radiances."""
    own, behind = target.radiances
    return None if math.isnan(own) else temperature_of(band, own) - temperature_of(band, behind)


def _draw(
    light: Floats,
    piece: NamedSprite,
    targets: list[DrawnTarget],
    moving: list[OccludedBlur],
    band: Band,
    noise: NoiseRadiance,
) -> None:
    """Draw a sprite over the light, and occlude the targets behind it."""
    sprite = piece.sprite
    within = sprite.within(light.shape)
    if within is None:
        if piece.tracked:
            nothing = np.zeros(sprite.covers.shape)
            targets.append(DrawnTarget(piece, None, nothing, nothing, 0.0, (math.nan, math.nan), None))
        return
    requested = None if sprite.requested is None else requested_radiance(sprite, light, band, noise)
    if requested is not None:
        sprite = with_radiance(sprite, requested)
    if sprite.contrast != 1:
        sprite = _faded(sprite, light, within)
    for target in targets:
        met = target.piece.sprite.meets(sprite)
        if met is not None:
            target.occlude(piece.name, met[0], 1 - sprite.covers[(..., *met[1])])
    blur = None if sprite.samples is None else OccludedBlur.of(sprite.samples, light, within)
    alpha, own, replaced = draw_over(light, sprite)
    for each in moving:
        rows, columns = each.patch
        met = overlap((columns.start, rows.start), each.light.shape[1:], (sprite.x0, sprite.y0), sprite.alpha.shape)
        if met is not None:
            each.hide(light, met[0], sprite.alphas[(..., *met[1])])
    if blur is not None:
        moving.append(blur)
    if piece.tracked:
        radiances = (own / alpha, replaced / alpha) if alpha > 0 else (math.nan, math.nan)
        drawn = piece if sprite is piece.sprite else piece._replace(sprite=sprite)
        shown = _shown(sprite.covers, within[0])
        # A corner of the box, or light spread by blur, may be in the picture while the target is not.
        inside = _inside(shown, sprite)
        ratio = scr(light, sprite.box, noise) if inside > AREA_ROUNDING else math.nan
        found = ratio if math.isfinite(ratio) else None
        targets.append(DrawnTarget(drawn, within, shown, shown, inside, radiances, found, requested))


def draw_over(light: Floats, sprite: Sprite) -> tuple[float, float, float]:
    """Draw a sprite over the light (rows, cols), in place: L <- L (1 - alpha) + emission.

    Return the sums, within the picture, of the sprite's alpha, of its emission, and of the light that it replaces.
    """
    if COMPILED and light.dtype == np.float32 and light.flags.c_contiguous and sprite.alpha.size:
        own = np.ascontiguousarray(sprite.alpha, np.float64)
        lit = np.ascontiguousarray(sprite.emission, np.float64)
        return kernels.lay(light, light.shape[1], own, lit, own.shape[1], int(sprite.x0), int(sprite.y0))
    met = sprite.within(light.shape)
    if met is None:
        return 0.0, 0.0, 0.0
    inner, outer = met
    alpha, emission = sprite.alpha[inner], sprite.emission[inner]
    sums = float(alpha.sum()), float(emission.sum()), float(np.vdot(alpha, light[outer]))
    light[outer] += emission - alpha * light[outer]
    return sums


def _shown(cover: Floats, inner: Slices) -> Floats:
    """Return a coverage map with zeros outside the picture; the map itself where all of it is inside."""
    rows, columns = inner
    if cover.shape[-2:] == (rows.stop - rows.start, columns.stop - columns.start):
        return cover
    shown = np.zeros(cover.shape)
    shown[..., rows, columns] = cover[..., rows, columns]
    return shown


def _faded(sprite: Sprite, light: Floats, within: tuple[Slices, Slices]) -> Sprite:
    """Return the sprite with the difference of its radiance from the background's multiplied by its `contrast`."""
    inner, outer = within
    emission, share = sprite.emission.copy(), sprite.contrast
    behind = sprite.alpha[inner] * light[outer]
    emission[inner] = np.maximum(behind + share * (emission[inner] - behind), 0.0)
    if sprite.samples is not None:
        lent_light = np.zeros(emission.shape)
        lent_light[inner] = (1 - share) * light[outer]
        sprite = sprite._replace(samples=sprite.samples.relit(share, lent_light))
    own, lent = share * float(sprite.emission.sum()), (1 - share) * float(behind.sum())
    part = lent / (own + lent) if own + lent > 0 else 1.0
    (x, y), (own_x, own_y) = sprite.center, sprite.signal_center
    return sprite._replace(emission=emission, signal_center=(own_x + part * (x - own_x), own_y + part * (y - own_y)))


def _draw_layer(
    under: Floats,
    light: Floats,
    layer: Layer,
    view_direction: ViewDirection,
    targets: list[DrawnTarget],
    moving: list[OccludedBlur],
) -> None:
    """Draw a semi-transparent layer over `under` into `light`, and occlude the targets behind it."""
    behind = [(target, target.within) for target in targets if target.within is not None]
    patches = [within[1] for _, within in behind] + [each.patch for each in moving]
    if is_semi_transparent(layer):
        transmittances = layer.blend(under, light, view_direction, patches)
    else:
        transmittance, emission = layer.light(view_direction)
        if transmittance is None:
            raise opaque_error(layer.name)
        transmittances = blend_over(under, light, transmittance, emission, patches)
    for (target, within), part in zip(behind, transmittances, strict=False):
        target.occlude(layer.name, within[0], part)
    for each, part in zip(moving, transmittances[len(behind) :], strict=True):
        each.hide(light, FULL_PATCH, 1 - part)
