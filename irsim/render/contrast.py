"""Contrast and signal-to-clutter ratio (SCR) of a target, measured or requested.

SCR = |mean of the target's pixels - mean of a ring around them| / standard deviation of the ring
(Gao et al., IEEE Trans. Image Processing 22, 2013, whose ring reaches 20 px beyond the target). The
ring leaves out GUARD_PX next to the target, where its own blurred light falls. Here SCR is signed, positive
where the target is brighter.

Truth's SCR is that of the noiseless radiance of the unoccluded target and of its background. The camera's noise counts
as clutter: its standard deviation over the pixels of one frame, as the radiance that raises the signal by as much at
the mean radiance of the ring (noise-equivalent radiance, `SignalChain.noise_equivalent`), is added in squares to the
ring's standard deviation. All noise terms count, fixed and temporal, but for bad pixels and offsets of the whole frame,
which shift target and ring alike. The key `scr` of a point requests an SCR of this definition.
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
"""Outer distance of the ring from the target, px."""
GUARD_PX = 4
"""Inner distance of the ring from the target, px."""

NoiseRadiance = Callable[[float, Box], float]
"""Function that returns the standard deviation of noise that the picture does not yet contain, in the picture's unit,
from the mean of the ring and the target's box."""


def no_noise(level: float, box: Box) -> float:
    """Return 0, for pictures that already contain all noise."""
    return 0.0


def scr(picture: Floats, box: Box, noise: NoiseRadiance = no_noise) -> float:
    """Return the signal-to-clutter ratio of a box in a picture (rows, cols), positive where the box is brighter.

    It is nan where the box or its ring lies outside the picture, infinite where the ring is uniform without noise.
    """
    signal, level, spread = _clutter(picture, box)
    if math.isnan(level):
        return math.nan
    spread = math.hypot(spread, noise(level, box))
    return signal / spread if spread > 0 else math.copysign(math.inf, signal)


def ring_contrast(picture: Floats, box: Box) -> float:
    """Return the mean of a box less that of its ring, in the picture's unit; nan outside the picture."""
    return _clutter(picture, box)[0]


def _clutter(picture: Floats, box: Box) -> tuple[float, float, float]:
    """Return the mean of a box less that of its ring, and the ring's mean and standard deviation; nan outside."""
    if COMPILED and picture.dtype == np.float32 and picture.flags.c_contiguous:
        return kernels.clutter(picture, picture.shape[1], box.cx, box.cy, box.w, box.h, RING_PX, GUARD_PX)
    rows, columns = _lines(picture.shape, box)
    weight = rows.shares.sum() * columns.shares.sum()
    outer = picture[rows.ring, columns.ring].astype(np.float64)
    guard = outer[rows.guard, columns.guard]
    count = outer.size - guard.size
    if not weight > 0 or count == 0:
        return math.nan, math.nan, math.nan
    reference = outer[0, 0]  # squares of small differences from it keep their digits
    outer -= reference
    guard[:] = 0.0
    level = outer.sum() / count
    spread = math.sqrt(max(float(np.vdot(outer, outer)) / count - level**2, 0.0))
    held = picture[rows.held, columns.held]
    signal = float(rows.shares @ held @ columns.shares) / weight - reference - level
    return float(signal), float(reference + level), spread


@dataclass(frozen=True, eq=False)
class _Line:
    """Pixels along one axis: those of the box with their covered fractions, those of the ring, and those of the guard
    between box and ring."""

    held: slice
    shares: Floats
    ring: slice
    guard: slice


def _lines(shape: tuple[int, ...], box: Box) -> tuple[_Line, _Line]:
    """Return the pixels of box, ring and guard along the rows and along the columns of a picture."""
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
    """Return the fraction of each pixel along one axis that a box, at least one pixel wide, covers.

    Fractions instead of whole pixels make the SCR continuous in the target's sub-pixel position.
    """
    half = max(side, 1.0) / 2
    held = np.minimum(places + 0.5, middle + half) - np.maximum(places - 0.5, middle - half)
    return np.asarray(np.clip(held, 0, 1))


def requested_radiance(sprite: Sprite, light: Floats, band: Band, noise: NoiseRadiance = no_noise) -> float | None:
    """Return the radiance, W/m2/sr, that gives a sprite its requested contrast or SCR; not below 0.

    light  (rows, cols) W/m2/sr of the background

    None where no contrast or SCR is requested, and outside the picture.
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


def with_radiance(sprite: Sprite, light: float) -> Sprite:
    """Return the sprite with uniform radiance, W/m2/sr, and no requested contrast or SCR."""
    samples = sprite.samples and sprite.samples.relit(0.0, light)
    return sprite._replace(emission=light * sprite.alpha, signal_center=sprite.center, requested=None, samples=samples)
