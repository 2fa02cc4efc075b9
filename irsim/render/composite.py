"""Compositing: what is drawn far to near, and what nearer things leave of each target."""

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
from irsim.geometry.occluded_blur import WHOLE, Unsteady
from irsim.geometry.sprite import Sprite, overlap
from irsim.physics.radiometry import temperature_of
from irsim.render.contrast import Noise, asked_light, lit, quiet, scr
from irsim.types import Band, Floats, Slices

HIDES = 0.01
"""Truth names as an occluder what hides at least this share of a target."""
ROUNDING = 1e-9
"""A share of a target that is no more than sums of areas miss."""


class Piece(NamedTuple):
    """A sprite in the scene. `tracked` says whether truth is wanted of it: targets, not occluders.

    first_m: how far it is from the camera's first place, where the camera is not there any more: what stands all around
    that place at a range hides what is farther from it. The air before it is that of the sprite's range, from the
    camera.
    """

    name: str
    sprite: Sprite
    tracked: bool
    first_m: float | None = None

    @property
    def range_m(self) -> float:
        return self.sprite.range_m if self.first_m is None else self.first_m


@dataclass(eq=False)
class Seen:
    """A target as it is drawn.

    within  where its patch and the picture meet, as slices of each; None where they do not
    shown   the share of each pixel's area of the patch that it covers in the picture, and of it what is still seen,
    left    both only to be read, as they are the sprite's own where that is all of it: (h, w), or (n, h, w) at each
            instant of an exposure
    inside  fraction 0..1 of its area that is in the picture, hidden or not
    scr     None where no part of it is in the picture, and where nothing varies around it
    levels  its mean light and that of what it replaces, W/m2/sr, nan outside the picture
    asked   the light, W/m2/sr, that gives the contrast or SCR which it asks for, None where it asks for none
    """

    piece: Piece
    within: tuple[Slices, Slices] | None
    shown: Floats
    left: Floats
    inside: float
    levels: tuple[float, float]
    scr: float | None
    asked: float | None = None
    occluders: list[str] = field(default_factory=list)

    @property
    def visible(self) -> float:
        """Fraction 0..1 of the target's area that is in the frame and not hidden: over the whole exposure."""
        if self.left is self.shown or self.within is None:
            return self.inside
        return _share(self.left, self.piece.sprite)

    @property
    def kept(self) -> Floats:
        """(h, w): of each pixel's area the share that is still seen of it, over the whole exposure."""
        return self.left if self.left.ndim == 2 else np.asarray(self.left.mean(axis=0))

    def hide(self, name: str, where: Slices, passed: Floats) -> None:
        """Something nearer lets only `passed` (0..1) of the patch's pixels `where` through. It is named for what it
        hides by itself, though something between the two may hide as much."""
        place = (..., *where)
        there = self.shown[place]
        if _total(there * (1 - passed)) >= HIDES * self.piece.sprite.area:
            self.occluders.append(name)
        if there.shape == self.shown.shape:  # all of it, in one pass
            self.left = self.left * passed
        else:
            left = self.left.copy()
            left[place] *= passed
            self.left = left


def _inside(shown: Floats, sprite: Sprite) -> float:
    """Fraction 0..1 of a sprite's area that is in the picture."""
    return 1.0 if shown is sprite.covers and sprite.whole else _share(shown, sprite)


def _share(left: Floats, sprite: Sprite) -> float:
    """Fraction 0..1 of a sprite's area, by what is left of each pixel's share of it."""
    return min(max(_total(left) / sprite.area, 0.0), 1.0)


def _total(shares: Floats) -> float:
    """Their sum over (h, w), in half the time of the method's; the mean of sums of (n, h, w)."""
    total = float(np.add.reduce(shares, axis=None))
    return total if shares.ndim == 2 else total / len(shares)


def compose(
    layers: Sequence[Layer],
    pieces: Iterable[Piece],
    view_direction: ViewDirection,
    band: Band,
    noise: Noise = quiet,
    out: Floats | None = None,
    truth: bool = True,
) -> tuple[Floats, list[Seen]]:
    """Everything drawn far to near on the first layer: radiance (rows, cols) float32, and the targets seen.

    At one range a layer is behind a sprite. Between what stands around the camera's first place, targets are far to
    near from where the camera is.

    noise  the camera's in this frame, for the targets' SCR
    out    where it is put, (rows, cols); summed up in float64 if it is so
    truth  whether what is seen of the targets is asked for; else none is told
    """
    under: Floats = layers[0].light(view_direction)[1]
    light = np.empty(under.shape, np.float32) if out is None else out
    seen: list[Seen] = []
    moving: list[Unsteady] = []
    things = _far_to_near(layers[1:], list(pieces))
    if not things or isinstance(things[0], Piece) or under.dtype != light.dtype:
        light[...] = under  # else the first layer is laid over what another one keeps, which saves the copy
        under = light
    for thing in things:
        if isinstance(thing, Piece):
            _draw(light, thing if truth else thing._replace(tracked=False), seen, moving, band, noise)
        else:
            _veil(under, light, thing, view_direction, seen, moving)
        under = light
    return light, seen


def uncovered(pieces: Iterable[Piece], light: Floats) -> Floats:
    """The share of each pixel's light, with pieces drawn, that comes from the background: like the light."""
    left = np.ones_like(light)
    for sprite in (piece.sprite for piece in pieces):
        met = sprite.within(left.shape)
        if met is not None:
            left[met[1]] *= np.maximum(1 - sprite.contrast * sprite.alpha[met[0]], 0)
    return left


def _far_to_near(layers: Sequence[Layer], pieces: Sequence[Piece]) -> list[Layer | Piece]:
    """All but the first layer, as they are drawn."""
    things: list[Layer | Piece] = sorted([*layers, *pieces], key=attrgetter("range_m"), reverse=True)
    if all(piece.first_m is None for piece in pieces):
        return things
    runs = [list(run) for _, run in groupby(things, key=_is_target)]
    return [thing for run in runs for thing in sorted(run, key=_from_camera)]


def _from_camera(thing: Layer | Piece) -> float:
    """What orders targets, the farthest first, and leaves all else as it is."""
    return -thing.sprite.range_m if _is_target(thing) else 0.0


def _is_target(thing: Layer | Piece) -> TypeGuard[Piece]:
    return isinstance(thing, Piece) and thing.tracked


def contrast_k(seen: Seen, band: Band) -> float | None:
    """Apparent temperature of a target's mean light less that of the light that it replaces, K; None outside the
    picture."""
    own, behind = seen.levels
    return None if math.isnan(own) else temperature_of(band, own) - temperature_of(band, behind)


def _draw(light: Floats, piece: Piece, seen: list[Seen], moving: list[Unsteady], band: Band, noise: Noise) -> None:
    sprite = piece.sprite
    within = sprite.within(light.shape)
    if within is None:
        if piece.tracked:
            nothing = np.zeros(sprite.covers.shape)
            seen.append(Seen(piece, None, nothing, nothing, 0.0, (math.nan, math.nan), None))
        return
    asked = None if sprite.wanted is None else asked_light(sprite, light, band, noise)
    if asked is not None:
        sprite = lit(sprite, asked)
    if sprite.contrast != 1:
        sprite = _faded(sprite, light, within)
    for target in seen:
        met = target.piece.sprite.meets(sprite)
        if met is not None:
            target.hide(piece.name, met[0], 1 - sprite.covers[(..., *met[1])])
    brought = None if sprite.during is None else Unsteady.of(sprite.during, light, within)
    alpha, own, replaced = lay(light, sprite)
    for each in moving:
        rows, columns = each.patch
        met = overlap((columns.start, rows.start), each.light.shape[1:], (sprite.x0, sprite.y0), sprite.alpha.shape)
        if met is not None:
            each.hide(light, met[0], sprite.alphas[(..., *met[1])])
    if brought is not None:
        moving.append(brought)
    if piece.tracked:
        levels = (own / alpha, replaced / alpha) if alpha > 0 else (math.nan, math.nan)
        drawn = piece if sprite is piece.sprite else piece._replace(sprite=sprite)
        shown = _shown(sprite.covers, within[0])
        # A corner of the box may be in the picture where the target is not, and its light is blurred beyond it.
        inside = _inside(shown, sprite)
        ratio = scr(light, sprite.box, noise) if inside > ROUNDING else math.nan
        seen.append(Seen(drawn, within, shown, shown, inside, levels, ratio if math.isfinite(ratio) else None, asked))


def lay(light: Floats, sprite: Sprite) -> tuple[float, float, float]:
    """Lay a sprite over the light (rows, cols), in place. Sums within the picture: of its alpha, of its own light, and
    of the light that it replaces."""
    if COMPILED and light.dtype == np.float32 and light.flags.c_contiguous and sprite.alpha.size:
        own, lit = np.ascontiguousarray(sprite.alpha, np.float64), np.ascontiguousarray(sprite.emission, np.float64)
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
    """A cover, 0 but for the part of it in the picture; itself where that is all of it."""
    rows, columns = inner
    if cover.shape[-2:] == (rows.stop - rows.start, columns.stop - columns.start):
        return cover
    shown = np.zeros(cover.shape)
    shown[..., rows, columns] = cover[..., rows, columns]
    return shown


def _faded(sprite: Sprite, light: Floats, within: tuple[Slices, Slices]) -> Sprite:
    """A sprite whose light differs from what is behind it by its `contrast` times as much as it would."""
    inner, outer = within
    emission, share = sprite.emission.copy(), sprite.contrast
    behind = sprite.alpha[inner] * light[outer]
    emission[inner] = np.maximum(behind + share * (emission[inner] - behind), 0.0)
    if sprite.during is not None:
        lent_light = np.zeros(emission.shape)
        lent_light[inner] = (1 - share) * light[outer]
        sprite = sprite._replace(during=sprite.during.shining(share, lent_light))
    own, lent = share * float(sprite.emission.sum()), (1 - share) * float(behind.sum())
    part = lent / (own + lent) if own + lent > 0 else 1.0
    (x, y), (own_x, own_y) = sprite.center, sprite.signal_center
    return sprite._replace(emission=emission, signal_center=(own_x + part * (x - own_x), own_y + part * (y - own_y)))


def _veil(
    under: Floats, light: Floats, layer: Layer, view_direction: ViewDirection, seen: list[Seen], moving: list[Unsteady]
) -> None:
    behind = [(target, target.within) for target in seen if target.within is not None]
    patches = [within[1] for _, within in behind] + [each.patch for each in moving]
    if is_semi_transparent(layer):
        passed = layer.blend(under, light, view_direction, patches)
    else:
        through, emission = layer.light(view_direction)
        if through is None:
            raise opaque_error(layer.name)
        passed = blend_over(under, light, through, emission, patches)
    for (target, within), part in zip(behind, passed, strict=False):
        target.hide(layer.name, within[0], part)
    for each, part in zip(moving, passed[len(behind) :], strict=True):
        each.hide(light, WHOLE, 1 - part)
