"""What a target stands out by: its contrast and its signal-to-clutter ratio, measured and asked for.

SCR = |mean of the target's pixels - mean of a ring around them| / standard deviation of the ring
(Gao et al., IEEE Trans. Image Processing 22, 2013, whose ring reaches 20 px beyond the target). The
ring leaves out GUARD_PX next to the target, where its own blurred light falls. Here it has a sign, +
where the target is brighter.

Truth's SCR is that of the noiseless radiance of the target and all that is behind it, before anything
nearer hides some of it; the camera's noise counts as clutter: the standard deviation that pixels of one
frame have of it, as the light that raises the signal by it at the mean light of the ring, is added to the
ring's spread, in squares. It is that of all noise terms, of those that stay and those that change
(`irsim.camera.noise_equivalent`), but for bad pixels and what a whole frame is moved by, target and ring
alike. A point that asks for an SCR gets this one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from irsim._native import COMPILED, kernels
from irsim.geometry.sprite import Sprite
from irsim.physics.radiometry import radiance, temperature_of
from irsim.types import Band, Box, Floats

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
    rows, columns = _lines(picture.shape, box)
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


def _lines(shape: tuple[int, ...], box: Box) -> tuple[_Line, _Line]:
    """Down and across a picture."""
    return _line(shape[0], box.cy, box.h), _line(shape[1], box.cx, box.w)


def _line(count: int, middle: float, side: float) -> _Line:
    half = max(side, 1.0) / 2

    def within(by: float) -> tuple[int, int]:
        first, last = math.ceil(middle - half - by), math.floor(middle + half + by)
        return min(max(first, 0), count), max(min(last + 1, count), 0)

    first, stop = within(0.5)
    (left, right), (inner, end) = within(RING_PX), within(GUARD_PX)
    shares = _shares(np.arange(first, stop), middle, side)
    return _Line(slice(first, stop), shares, slice(left, right), slice(inner - left, max(end - left, 0)))


def _shares(places: npt.NDArray[np.int64], middle: float, side: float) -> Floats:
    """How much of each pixel a box holds along one axis: it has a pixel's size at least.

    Shares rather than whole pixels, so that nothing jumps where the target moves by a part of a pixel.
    """
    half = max(side, 1.0) / 2
    held = np.minimum(places + 0.5, middle + half) - np.maximum(places - 0.5, middle - half)
    return np.asarray(np.clip(held, 0, 1))


def asked_light(sprite: Sprite, light: Floats, band: Band, noise: Noise = quiet) -> float | None:
    """The light, W/m2/sr, that gives a sprite the contrast or SCR which it asks for, before what is behind it.

    light  (rows, cols) W/m2/sr: what is behind it

    None where it asks for nothing, and outside the picture. Darker than without any light it cannot be.
    """
    wanted = sprite.requested
    if wanted is None:
        return None
    met = sprite.within(light.shape)
    if met is None:
        return None
    inner, (rows, columns) = met
    alpha = sprite.alpha[inner]
    if not alpha.any():
        return None
    under = light[rows, columns].astype(np.float64)
    behind = float((alpha * under).sum() / alpha.sum())
    if wanted.contrast_k is not None:
        own = float(radiance(band, max(temperature_of(band, behind) + wanted.contrast_k, 1.0)))
    else:
        assert wanted.scr is not None
        box = sprite.box
        signal, level, spread = _clutter(light, box)
        down, across = _lines(light.shape, box)
        held = alpha * np.outer(
            _shares(np.arange(rows.start, rows.stop), box.cy, box.h),
            _shares(np.arange(columns.start, columns.stop), box.cx, box.w),
        )
        if math.isnan(level) or not held.any():
            return None
        lacking = wanted.scr * math.hypot(spread, noise(level, box)) - signal
        own = float((lacking * down.shares.sum() * across.shares.sum() + (held * under).sum()) / held.sum())
    return max(behind + wanted.gain * (own - behind), 0.0)


def lit(sprite: Sprite, light: float) -> Sprite:
    """A sprite of one light all over, W/m2/sr, that asks for no contrast or SCR."""
    samples = sprite.samples and sprite.samples.relit(0.0, light)
    return sprite._replace(emission=light * sprite.alpha, signal_center=sprite.center, requested=None, samples=samples)
