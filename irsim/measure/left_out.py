"""What differs from place to place in a picture and is neither texture nor fixed pattern, as haze or shading."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from irsim.measure.pattern import Pattern
from irsim.types import Floats

_STEEP = 4.0
"""Sigmas of the noise, and of what fixed pattern makes by chance, by which a picture without texture rises from side to
side where it is worth a word."""
_SEEN = 1 / 3
"""Sigmas of the noise from which what is left out of a picture without texture is worth a word: a lone smooth thing of
that rms is as high as the noise or higher. Of 40 skies of irsim without clouds what their rise leaves is less than a
tenth."""
_LITTLE = 0.01
"""Share of the whole variance that is not worth a word beside a rise."""
_MORE = 10.0
"""Times the variance that texture and pattern make, from which a picture with texture has more: its largest waves are
few. Of 89 grounds and cloudy skies of irsim the most is 5.1 with the rise, 3.5 without."""
_WAYS = {1: ("top to bottom", "bottom to top"), 0: ("left to right", "right to left")}
"""Of an axis over which the mean is taken."""


def left_out_notes(fixed: Pattern, picture: Floats, noise: float) -> Iterator[str]:
    """Of a picture (rows, columns) and what is told of it, beside the noise of a pixel in time: by what it rises from
    side to side, and what differs besides by more than texture, pixels, rows and columns make."""
    textured = fixed.spectrum.texture is not None
    told = _told(fixed, picture.shape)
    least = {
        axis: math.sqrt(12 * _MORE * told) if textured else _STEEP * math.hypot(noise, _by_chance(fixed, picture, axis))
        for axis in _WAYS
    }
    risen = [axis for axis in _WAYS if abs(_rise(picture, axis)) > least[axis]]
    for axis in risen:
        rise = _rise(picture, axis)
        yield (
            f"the picture rises by {abs(rise):.3g} counts from {_WAYS[axis][rise < 0]}, which is no texture: the "
            "background is written without it; a sky has it of horizon_k and zenith_k"
        )
    rest = float(_without_rise(picture, _WAYS).var())
    more = _MORE * told if textured else told + (_SEEN * noise) ** 2
    if rest > max(more, told + _LITTLE * float(picture.var())):
        left = math.sqrt(float(_without_rise(picture, risen).var()) - told)
        yield (
            f"{left:.3g} counts rms of what differs from place to place are smoother than texture, "
            "as haze, shading or a large thing is: the background is written without them"
        )


def _told(fixed: Pattern, shape: tuple[int, ...]) -> float:
    """The variance in a picture (rows, columns) that is told of it: what is expected with a texture, the most that
    there may be without one."""
    if fixed.spectrum.texture is None:
        return fixed.floor.high + fixed.row.high**2 + fixed.column.high**2
    density = fixed.spectrum.density.copy()
    density[0, 0] = 0
    twice = density[:, 1 : (shape[1] + 1) // 2]  # rfft2 has but one half of the spectrum
    return float(density.sum() + twice.sum()) / math.prod(shape) + fixed.row.value**2 + fixed.column.value**2


def _by_chance(fixed: Pattern, picture: Floats, axis: int) -> float:
    """Sigma of the rise that lines and pixels of a fixed pattern make in the mean over an axis: of n values of sigma s
    it is s (12 / n)^1/2."""
    line = fixed.row if axis == 1 else fixed.column
    variance = line.high**2 + fixed.floor.high / picture.shape[axis]
    return math.sqrt(12 * variance / picture.shape[1 - axis])


def _rise(picture: Floats, axis: int) -> float:
    """From side to side, by a straight line through the means over an axis."""
    means = picture.mean(axis=axis)
    return float(np.polyfit(np.linspace(-0.5, 0.5, len(means)), means - means.mean(), 1)[0])


def _without_rise(picture: Floats, axes: Iterable[int]) -> Floats:
    """A picture (rows, columns) without what rises all the way from one side to the other, in whatever steps, in means
    over these axes."""
    from scipy.optimize import isotonic_regression

    rest = picture
    for axis in axes:
        profile = isotonic_regression(rest.mean(axis=axis), increasing=_rise(rest, axis) > 0).x
        rest = rest - np.expand_dims(profile, axis)
    return rest
