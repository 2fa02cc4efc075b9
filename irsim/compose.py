"""Compositing: what is drawn far to near, and what nearer things leave of each target."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import TypeGuard

import numpy as np

from irsim.backgrounds import Gaze, Layer, Slices, is_veil, veiled
from irsim.compiled import COMPILED, kernels
from irsim.contrast import Noise, asked_light, lit, quiet, scr
from irsim.radiometry import temperature
from irsim.sprite import Sprite
from irsim.types import Band, Floats

HIDES = 0.01
"""Truth names as an occluder what hides at least this share of a target."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A sprite in the scene. `tracked` says whether truth is wanted of it: targets, not occluders.

    first_m: how far it is from the camera's first place, where the camera is not there any more: what stands all around
    that place at a range hides what is farther from it.
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
    """A target as it is drawn: the share of each pixel's area that is still seen, and who hides the rest; `levels`
    are its mean light and that of what it replaces, W/m2/sr, nan outside the picture; `asked` is the light, W/m2/sr,
    that gives the contrast or SCR which it asks for, None where it asks for none."""

    piece: Piece
    left: Floats
    levels: tuple[float, float]
    scr: float | None
    asked: float | None = None
    occluders: list[str] = field(default_factory=list)

    @property
    def visible(self) -> float:
        """Fraction 0..1 of the target's area that is in the frame and not hidden."""
        return float(min(max(self.left.sum() / self.piece.sprite.area, 0.0), 1.0))

    def hide(self, name: str, where: Slices, passed: Floats) -> None:
        """Something nearer lets only `passed` (0..1) of the patch's pixels `where` through."""
        part = self.left[where]
        after = part * passed
        if part.sum() - after.sum() >= HIDES * self.piece.sprite.area:
            self.occluders.append(name)
        self.left[where] = after


def overlap(
    corner: tuple[int, int], shape: tuple[int, int], other: tuple[int, int], size: tuple[int, int]
) -> tuple[Slices, Slices] | None:
    """Where two patches meet, as slices (rows, columns) of each; None where they do not.

    A patch is its top-left pixel (x, y) and its shape (rows, columns).
    """
    (x, y), (rows, columns), (other_x, other_y), (other_rows, other_columns) = corner, shape, other, size
    if x >= other_x + other_columns or other_x >= x + columns or y >= other_y + other_rows or other_y >= y + rows:
        return None
    left, top = max(x, other_x), max(y, other_y)
    right, bottom = min(x + columns, other_x + other_columns), min(y + rows, other_y + other_rows)
    if left >= right or top >= bottom:  # one of them is empty
        return None

    def within(origin: tuple[int, int]) -> Slices:
        return slice(top - origin[1], bottom - origin[1]), slice(left - origin[0], right - origin[0])

    return within(corner), within(other)


def compose(
    layers: Sequence[Layer],
    pieces: Iterable[Piece],
    gaze: Gaze,
    band: Band,
    noise: Noise = quiet,
    out: Floats | None = None,
) -> tuple[Floats, list[Seen]]:
    """Everything drawn far to near on the first layer: radiance (rows, cols) float32, and the targets seen.

    At one range a layer is behind a sprite. Between what stands around the camera's first place, targets are far to
    near from where the camera is.

    noise  the camera's in this frame, for the targets' SCR
    out    where it is put, (rows, cols); summed up in float64 if it is so
    """
    under: Floats = layers[0].light(gaze)[1]
    light = np.empty(under.shape, np.float32) if out is None else out
    seen: list[Seen] = []
    things = list(_far_to_near(layers[1:], pieces))
    if not things or isinstance(things[0], Piece) or under.dtype != light.dtype:
        light[...] = under  # else the first layer is laid over what another one keeps, which saves the copy
        under = light
    for thing in things:
        if isinstance(thing, Piece):
            _draw(light, thing, seen, band, noise)
        else:
            _veil(under, light, thing, gaze, seen)
        under = light
    return light, seen


def uncovered(pieces: Iterable[Piece], light: Floats) -> Floats:
    """The share of each pixel's light, with pieces drawn, that comes from the background: like the light."""
    left = np.ones_like(light)
    for sprite in (piece.sprite for piece in pieces):
        met = overlap((sprite.x0, sprite.y0), sprite.alpha.shape, (0, 0), left.shape)
        if met is not None:
            left[met[1]] *= np.maximum(1 - sprite.contrast * sprite.alpha[met[0]], 0)
    return left


def _far_to_near(layers: Sequence[Layer], pieces: Iterable[Piece]) -> Iterator[Layer | Piece]:
    """All but the first layer, as they are drawn."""
    things: list[Layer | Piece] = sorted([*layers, *pieces], key=lambda thing: -thing.range_m)
    for _, run in groupby(things, key=_is_target):
        yield from sorted(run, key=lambda thing: -thing.sprite.range_m if _is_target(thing) else 0.0)


def _is_target(thing: Layer | Piece) -> TypeGuard[Piece]:
    return isinstance(thing, Piece) and thing.tracked


def contrasts(seen: Sequence[Seen], band: Band) -> list[float | None]:
    """Apparent temperature of each target's mean light less that of the light that it replaces, K; None outside the
    picture."""
    levels = np.array([target.levels for target in seen]).reshape(-1, 2)
    return [own - behind if not math.isnan(own) else None for own, behind in temperature(band, levels).tolist()]


def _draw(light: Floats, piece: Piece, seen: list[Seen], band: Band, noise: Noise) -> None:
    asked = asked_light(piece.sprite, light, band, noise)
    if asked is not None:
        piece = replace(piece, sprite=lit(piece.sprite, asked))
    if piece.sprite.contrast != 1:
        piece = replace(piece, sprite=_faded(piece.sprite, light))
    sprite = piece.sprite
    corner = (sprite.x0, sprite.y0)
    for target in seen:
        behind = target.piece.sprite
        met = overlap((behind.x0, behind.y0), behind.cover.shape, corner, sprite.cover.shape)
        if met is not None:
            target.hide(piece.name, met[0], 1 - sprite.cover[met[1]])
    left, alpha, own, replaced = _laid(light, sprite)
    if piece.tracked:
        levels = (own / alpha, replaced / alpha) if alpha > 0 else (math.nan, math.nan)
        ratio = scr(light, sprite.box, noise)
        seen.append(Seen(piece, left, levels, ratio if math.isfinite(ratio) else None, asked))


def _laid(light: Floats, sprite: Sprite) -> tuple[Floats, float, float, float]:
    """Lay a sprite over the light. Its cover within the picture, and sums there: of its alpha, of its own light,
    and of the light that it replaces."""
    if COMPILED and light.dtype == np.float32 and light.flags.c_contiguous and sprite.cover.size:
        left = np.empty(sprite.cover.shape)
        fields = sprite.alpha, sprite.emission, sprite.cover
        own, lit, cover = (np.ascontiguousarray(field, np.float64) for field in fields)
        columns, wide = light.shape[1], own.shape[1]
        return left, *kernels.lay(light, columns, own, lit, wide, int(sprite.x0), int(sprite.y0), cover, left)
    left = np.zeros_like(sprite.cover)
    met = overlap((sprite.x0, sprite.y0), sprite.cover.shape, (0, 0), light.shape)
    if met is None:
        return left, 0.0, 0.0, 0.0
    inner, outer = met
    alpha, emission = sprite.alpha[inner], sprite.emission[inner]
    sums = float(alpha.sum()), float(emission.sum()), float(np.vdot(alpha, light[outer]))
    light[outer] += emission - alpha * light[outer]
    left[inner] = sprite.cover[inner]
    return left, *sums


def _faded(sprite: Sprite, light: Floats) -> Sprite:
    """A sprite whose light differs from what is behind it by its `contrast` times as much as it would."""
    met = overlap((sprite.x0, sprite.y0), sprite.cover.shape, (0, 0), light.shape)
    if met is None:
        return sprite
    inner, outer = met
    emission, share = sprite.emission.copy(), sprite.contrast
    behind = sprite.alpha[inner] * light[outer]
    emission[inner] = np.maximum(behind + share * (emission[inner] - behind), 0.0)
    own, lent = share * float(sprite.emission.sum()), (1 - share) * float(behind.sum())
    part = lent / (own + lent) if own + lent > 0 else 1.0
    (x, y), (own_x, own_y) = sprite.center, sprite.signal_center
    return replace(sprite, emission=emission, signal_center=(own_x + part * (x - own_x), own_y + part * (y - own_y)))


def _veil(under: Floats, light: Floats, layer: Layer, gaze: Gaze, seen: list[Seen]) -> None:
    covers = ((target, target.piece.sprite) for target in seen)
    behind = [
        (target, *met)
        for target, sprite in covers
        if (met := overlap((sprite.x0, sprite.y0), sprite.cover.shape, (0, 0), light.shape)) is not None
    ]
    patches = [outer for _, _, outer in behind]
    if is_veil(layer):
        passed = layer.veil(under, light, gaze, patches)
    else:
        through, emission = layer.light(gaze)
        if through is None:
            raise ValueError(f"layer {layer.name}: only the farthest layer may be opaque")
        passed = veiled(under, light, through, emission, patches)
    for (target, inner, _), part in zip(behind, passed, strict=True):
        target.hide(layer.name, inner, part)
