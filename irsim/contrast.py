"""What a target stands out by: its contrast and its signal-to-clutter ratio, measured and asked for.

SCR = |mean of the target's pixels - mean of a ring around them| / standard deviation of the ring
(Gao et al., IEEE Trans. Image Processing 22, 2013, whose ring reaches 20 px beyond the target). The
ring leaves out GUARD_PX next to the target, where its own blurred light falls. Here it has a sign, +
where the target is brighter.

Truth's SCR is that of the noiseless radiance of the target and all that is behind it, before anything
nearer hides some of it; the camera's noise counts as clutter: the standard deviation that pixels of one
frame have of it, as radiance at the mean light of the ring, is added to the ring's spread, in squares.
It is that of all noise terms, of those that stay and those that change (`irsim.detector.equivalent`),
but for bad pixels and what a whole frame is moved by, target and ring alike. A point that asks for an
SCR gets this one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from irsim.compiled import COMPILED, kernels
from irsim.radiometry import Band, radiance, temperature
from irsim.sprite import Sprite
from irsim.types import Box, Floats

RING_PX = 20
"""How far the ring reaches beyond the target."""
GUARD_PX = 4
"""How far from the target it begins."""

Noise = Callable[[float, Box], float]
"""Standard deviation of noise that a picture does not hold yet, in its unit, at a level of light around a box."""


def quiet(level: float, box: Box) -> float:
    """No noise."""
    return 0.0


def scr(picture: Floats, box: Box, noise: Noise = quiet) -> float:
    """Signal-to-clutter ratio in a picture (rows, cols) of what fills a box, positive where it is brighter.

    nan where the box or its ring lie outside the picture, inf where the ring is quite even and there is no noise.
    """
    signal, level, spread = _clutter(picture, box)
    if math.isnan(level):
        return math.nan
    spread = math.hypot(spread, noise(level, box))
    return signal / spread if spread > 0 else math.copysign(math.inf, signal)


def stands_out(picture: Floats, box: Box) -> float:
    """What the mean of a box lies above that of its ring, in the picture's unit; nan outside."""
    return _clutter(picture, box)[0]


def _clutter(picture: Floats, box: Box) -> tuple[float, float, float]:
    """What the mean of a box lies above that of its ring, and the ring's mean and standard deviation; nan outside."""
    if COMPILED and picture.dtype == np.float32 and picture.flags.c_contiguous:
        return kernels.clutter(picture, picture.shape[1], box.cx, box.cy, box.w, box.h, RING_PX, GUARD_PX)
    rows, columns = (
        _line(count, middle, max(side, 1.0) / 2)
        for count, middle, side in zip(picture.shape, (box.cy, box.cx), (box.h, box.w), strict=True)
    )
    weight = rows.shares.sum() * columns.shares.sum()
    outer = picture[rows.ring, columns.ring].astype(np.float64)
    guard = outer[rows.guard, columns.guard]
    count = outer.size - guard.size
    if not weight > 0 or count == 0:
        return math.nan, math.nan, math.nan
    reference = outer[0, 0]  # squares of differences from it lose no digits
    outer -= reference
    guard[:] = 0.0
    level = outer.sum() / count
    spread = math.sqrt(max(float(np.vdot(outer, outer)) / count - level**2, 0.0))
    held = picture[rows.held, columns.held]
    signal = float(rows.shares @ held @ columns.shares) / weight - reference - level
    return float(signal), float(reference + level), spread


@dataclass(frozen=True, eq=False)
class _Line:
    """Of the pixels along one axis: those that the box holds, and how much of each; the ring's, and within
    these the guard's, which do not belong to it."""

    held: slice
    shares: Floats
    ring: slice
    guard: slice


def _line(count: int, middle: float, half: float) -> _Line:
    def within(by: float) -> tuple[int, int]:
        first, last = math.ceil(middle - half - by), math.floor(middle + half + by)
        return min(max(first, 0), count), max(min(last + 1, count), 0)

    first, stop = within(0.5)
    places = np.arange(first, stop)
    shares = np.minimum(places + 0.5, middle + half) - np.maximum(places - 0.5, middle - half)
    (left, right), (inner, end) = within(RING_PX), within(GUARD_PX)
    return _Line(slice(first, stop), shares, slice(left, right), slice(inner - left, max(end - left, 0)))


def around(shape: tuple[int, ...], box: Box) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """(rows, cols) twice: the share of each pixel that the box holds (it has a pixel's size at least), and its ring.

    Shares rather than whole pixels, so that nothing jumps where the target moves by a part of a pixel.
    """
    x, y = np.arange(shape[1]), np.arange(shape[0])[:, None]
    wide, high = max(box.w, 1.0) / 2, max(box.h, 1.0) / 2

    def share(places: npt.NDArray[np.int64], middle: float, half: float) -> Floats:
        held = np.minimum(places + 0.5, middle + half) - np.maximum(places - 0.5, middle - half)
        return np.asarray(np.clip(held, 0, 1))

    def grown(by: float) -> npt.NDArray[np.bool_]:
        return np.asarray((np.abs(y - box.cy) <= high + by) & (np.abs(x - box.cx) <= wide + by))

    return share(y, box.cy, high) * share(x, box.cx, wide), grown(RING_PX) & ~grown(GUARD_PX)


def fulfilled(sprite: Sprite, light: Floats, band: Band, noise: Noise = quiet) -> Sprite:
    """A sprite with the light that gives the contrast or SCR which it asks for, before what is behind it.

    light  (rows, cols) W/m2/sr: what is behind it. A sprite that asks for nothing, or that lies
           outside the picture, stays as it is. Darker than without any light it cannot be.
    """
    wanted = sprite.wanted
    if wanted is None:
        return sprite
    light, left, top = _near(light, sprite)
    grid = np.indices(sprite.alpha.shape)
    rows, columns = grid[0] + sprite.y0 - top, grid[1] + sprite.x0 - left
    there = (rows >= 0) & (rows < light.shape[0]) & (columns >= 0) & (columns < light.shape[1])
    alpha = np.zeros(light.shape)
    alpha[rows[there], columns[there]] = sprite.alpha[there]
    if not alpha.any():
        return sprite
    behind = float((alpha * light).sum() / alpha.sum())
    if wanted.contrast_k is not None:
        own = float(radiance(band, max(float(temperature(band, behind)) + wanted.contrast_k, 1.0)))
    else:
        assert wanted.scr is not None
        box = sprite.box
        inside, ring = around(light.shape, Box(box.cx - left, box.cy - top, box.w, box.h))
        if not (inside * alpha).any() or not ring.any():
            return sprite
        values = light[ring].astype(np.float64)
        level = float(values.mean())
        spread = math.hypot(float(values.std()), noise(level, box))
        passed = float((inside * light * (1 - alpha)).sum())
        own = ((level + wanted.scr * spread) * float(inside.sum()) - passed) / float((inside * alpha).sum())
    own = max(behind + wanted.gain * (own - behind), 0.0)
    return replace(sprite, emission=own * sprite.alpha, signal_center=sprite.center)


def _near(light: Floats, sprite: Sprite) -> tuple[Floats, int, int]:
    """The part of a picture that the sprite's patch and ring lie in, and its first column and row."""
    box, (high, wide) = sprite.box, sprite.alpha.shape
    reach = RING_PX + 1
    left = max(min(math.floor(box.left) - reach, sprite.x0), 0)
    top = max(min(math.floor(box.top) - reach, sprite.y0), 0)
    right = max(math.ceil(box.right) + reach, sprite.x0 + wide) + 1
    bottom = max(math.ceil(box.bottom) + reach, sprite.y0 + high) + 1
    return light[top : max(bottom, top), left : max(right, left)], left, top
