"""A still picture as a random field: texture with a power-law spectrum, and what is white from pixel to pixel.

The spectrum is S(f) = A G(f) / (1 + |s c fx|^bx + |c fy|^by) + w^2, which is how backgrounds of kind
ground are made (`betas`, `correlation_mrad`, `stretch`), under the power transfer G of a Gaussian blur.
It is fitted to the periodogram by P. Whittle's likelihood ("Estimation and information in stationary
time series", Arkiv for Matematik 2, 1953): the sum over frequencies of log S + P / S is least.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from irsim.measure.hann import HANN_FREEDOM
from irsim.measure.interval import ENDS, Measured
from irsim.measure.picked import coarseness
from irsim.types import Floats, Indices

TILE = 1024
"""Side of the field whose standard deviation is told, px: backgrounds are made as large."""
_REFERENCE = 0.04
"""Cycles a px at which the strength of the texture is fitted: there it hangs least on the slopes."""
_CLEAR = 2
"""Cycles a side that stay out on either side of the axes: rows and columns of a detector lie there."""
_LOW = 128
"""Cycles a side up to which each frequency of a large picture counts by itself: there the texture's are."""
_SEEN = 30.0
"""Gain of log likelihood from which there is texture: four parameters bring 2 by chance, and a few bad pixels 10."""
_NOTHING = 1e-24
"""Stands for no power at all, counts^2."""
_NEAR = 0.01
"""A parameter so near to its bound is held there."""
_PRIOR = np.array([0, 0, 0, 1 / 0.7, 1 / 0.7, 0]) ** 2 * HANN_FREEDOM**2
"""Weight of what is thought before of log c, the half of the longer side, and of log s, 0, each give or take 0.7: a
picture hardly tells the size of what is larger than itself."""
_STEPS = 60


@dataclass(frozen=True)
class Field:
    """Texture of a picture, in its units; lengths in px, each figure with its 95 % interval.

    spread          standard deviation before the blur, over 1024 x 1024 px
    beta_x, beta_y  slopes of the 2-D power spectrum along the axes
    correlation_px  size of the largest features
    stretch         how much wider than high they are
    """

    spread: Measured
    beta_x: Measured
    beta_y: Measured
    correlation_px: Measured
    stretch: Measured


@dataclass(frozen=True)
class Spectrum:
    """What `fit_field` finds.

    texture     None where there is none
    floor       variance of what is white from pixel to pixel
    density     of the model, (rows, columns // 2 + 1), in the order of numpy's rfft2
    loss        by how much log likelihood falls short, but for a constant of the periodogram
    """

    texture: Field | None
    floor: Measured
    density: Floats
    loss: float


@dataclass(frozen=True, eq=False)
class _Frequencies:
    """Frequencies x (X,) and |y| (Y,), cycles a px, what a `blur` leaves of power there (Y, X), and how many of a
    picture's each stands for."""

    x: Floats
    y: Floats
    blur: Floats
    count: Floats

    @classmethod
    def of(cls, x: Floats, y: Floats, psf_px: float, count: Floats) -> _Frequencies:
        return cls(x, np.abs(y), np.exp(-4 * np.pi**2 * psf_px**2 * (x**2 + y[:, None] ** 2)), count)

    @classmethod
    def all(cls, shape: tuple[int, int], psf_px: float) -> _Frequencies:
        """Those of a picture (rows, columns), in the order of numpy's rfft2."""
        return cls.of(np.fft.rfftfreq(shape[1]), np.fft.fftfreq(shape[0]), psf_px, np.ones((1, 1)))


def _used(powers: Floats, shape: tuple[int, int], psf_px: float) -> tuple[_Frequencies, Floats]:
    """The frequencies that a spectrum is fitted at, and the power there (Y, X), of a picture's periodogram.

    Of a large picture they are few: frequencies of y and -y, and beyond the low ones so many neighbours along either
    axis, count as one, with their mean. The spectrum is even over them, and of their powers P no more than the mean is
    in the sum of log S + P / S.
    """
    x, y = np.fft.rfftfreq(shape[1]), np.fft.fftfreq(shape[0])
    across, down = (
        np.flatnonzero((np.abs(axis) * side > _CLEAR + 0.5) & (axis < 0.5))
        for axis, side in zip((x, y), shape[::-1], strict=True)
    )
    step = coarseness(shape)
    if step == 1:
        return _Frequencies.of(x[across], y[down], psf_px, np.ones((1, 1))), powers[np.ix_(down, across)]
    down = down[y[down] > 0]
    folded = powers[np.ix_(down, across)] + powers[np.ix_(-down, across)]
    for axis, places in enumerate((down, across)):
        folded = np.add.reduceat(folded, _starts(places, step), axis=axis)
    (y, rows), (x, columns) = (_means(axis[places], _starts(places, step)) for axis, places in ((y, down), (x, across)))
    count = 2 * rows[:, None] * columns
    return _Frequencies.of(x, y, psf_px, count), folded / count


def _starts(cycles: Indices, step: int) -> Indices:
    """Where each of the groups of frequencies (N,), which rise, begins: of one up to `_LOW`, then of `step` each."""
    low = cycles <= _LOW
    return np.flatnonzero(low | ((np.arange(len(cycles)) - int(low.sum())) % step == 0))


def _means(values: Floats, starts: Indices) -> tuple[Floats, Floats]:
    """Means of the groups that begin there, and how many are in each."""
    count = np.diff(np.append(starts, len(values))).astype(np.float64)
    return np.add.reduceat(values, starts) / count, count


def fit_field(periodogram: Floats, shape: tuple[int, int], psf_px: float) -> Spectrum:
    """Texture and white floor of a picture (rows, columns) from its `periodogram`, blurred by a Gaussian of `psf_px`.

    Intervals are those of the Fisher information, for a Gaussian field; a real scene is none, and differs
    from place to place by more. What ends at a bound of the search has all of it as its interval.
    """
    at, power = _used(periodogram, shape, psf_px)
    if not power.any():  # all pixels are alike, as where all are full or at 0
        return Spectrum(None, Measured(_NOTHING, 0.0, _NOTHING), np.full(periodogram.shape, _NOTHING), 0.0)
    radius = np.hypot(at.x, at.y[:, None])
    floor = float(power[radius > 0.45].mean()) + 1e-12
    middle = power[radius < max(_REFERENCE * 2, float(radius.min()) * 2)]
    start = np.array([np.log(max(middle.mean() - floor, floor * 1e-3)), 2.5, 2.5, np.log(max(shape) / 2), 0.0, 0.0])
    bounds = np.array([(-60, 60), (0.5, 6), (0.5, 6), (np.log(4), np.log(4 * max(shape))), (-2, 2), (-20, 5)])
    theta, loss = _scored(start, bounds, power, at, floor)
    loss /= HANN_FREEDOM**2
    count = float(np.broadcast_to(at.count, power.shape).sum())
    flat = float((power * at.count).sum()) / count
    flat_loss = count * (np.log(flat) + 1) / HANN_FREEDOM**2
    if flat_loss - loss < _SEEN:
        error = ENDS * flat * HANN_FREEDOM / np.sqrt(count)
        return Spectrum(None, Measured(flat, flat - error, flat + error), np.full(periodogram.shape, flat), flat_loss)
    covariance = _covariance(theta, bounds, at, floor)

    def parameter(number: int, back: Callable[[float], float] = float) -> Measured:
        low, high = bounds[number]
        if low + _NEAR < theta[number] < high - _NEAR:
            return told(lambda t: t[number], back)
        return Measured(*(float(back(x)) for x in (theta[number], low, high)))  # all that was searched

    def told(value: Callable[[Floats], float], back: Callable[[float], float] = float) -> Measured:
        steps = np.array([(value(theta + step) - value(theta - step)) / 2e-3 for step in 1e-3 * np.eye(len(theta))])
        reach = ENDS * float(np.sqrt(max(steps @ covariance @ steps, 0.0)))
        middle = value(theta)
        return Measured(*(float(back(x)) for x in (middle, middle - reach, middle + reach)))

    texture = Field(
        spread=told(lambda t: _log_variance(t) / 2, _exp),
        beta_x=parameter(1),
        beta_y=parameter(2),
        correlation_px=parameter(3, _exp),
        stretch=parameter(4, _exp),
    )
    density = _density(theta, _Frequencies.all(shape, psf_px), floor)
    return Spectrum(texture, told(lambda t: t[5] + np.log(floor), _exp), density, loss)


def _exp(value: float) -> float:
    """Infinite where that is: of what hardly shows, a logarithm may have any upper end."""
    return math.exp(value) if value < math.log(np.finfo(np.float64).max) else math.inf


def periodogram(picture: Floats) -> Floats:
    """Of a picture (rows, columns) less its plane, under a Hann window; 1 for white noise of variance 1."""
    rows, columns = picture.shape
    y, x = np.mgrid[:rows, :columns]
    plane = np.stack([np.ones(picture.size), x.ravel(), y.ravel()], axis=1)
    rest = picture - (plane @ np.linalg.lstsq(plane, picture.ravel(), rcond=None)[0]).reshape(picture.shape)
    window = np.outer(np.hanning(rows + 1)[:-1], np.hanning(columns + 1)[:-1])
    found: Floats = np.square(np.abs(np.fft.rfft2(rest * window))) / np.square(window).sum()
    return found


def _shape(theta: Floats, x: Floats, y: Floats) -> Floats:
    """The texture's power, without its strength, at frequencies x and |y|."""
    along = np.exp(theta[3])
    return np.asarray(1 / (1 + (np.exp(theta[4]) * along * x) ** theta[1] + (along * y) ** theta[2]))


def _strength(theta: Floats) -> float:
    reference = np.array([[_REFERENCE / np.sqrt(2)]])
    return float(np.exp(theta[0]) / _shape(theta, reference, reference)[0, 0])


def _density(theta: Floats, at: _Frequencies, floor: float) -> Floats:
    texture = _strength(theta) * _shape(theta, at.x, at.y[:, None]) * at.blur
    return np.asarray(texture + floor * np.exp(theta[5]))


def _log_variance(theta: Floats) -> float:
    """Log of the texture's variance over a field of TILE x TILE px, unblurred and without its mean."""
    x, y = np.abs(np.fft.fftfreq(TILE))[None], np.abs(np.fft.fftfreq(TILE))[:, None]
    shape = _shape(theta, x, y)
    shape[0, 0] = 0
    return float(np.log(_strength(theta) * shape.mean()))


def _slopes(theta: Floats, at: _Frequencies, floor: float) -> Floats:
    """(parameters, frequencies): d log S / d theta, times the root of how many each stands for."""
    steps = 1e-3 * np.eye(len(theta))
    ends = [[np.log(_density(theta + sign * step, at, floor)) for sign in (1, -1)] for step in steps]
    return np.stack([((up - down) / 2e-3 * np.sqrt(at.count)).ravel() for up, down in ends])


def _scored(start: Floats, bounds: Floats, power: Floats, at: _Frequencies, floor: float) -> tuple[Floats, float]:
    """Parameters within bounds (parameters, 2) at which log S + P / S is least, and that sum: Fisher scoring.

    A step solves (J J^T + damping) step = J (P / S - 1); it is damped more where it did not help
    (K. Levenberg, "A method for the solution of certain non-linear problems", 1944).
    """

    def of(theta: Floats) -> tuple[float, Floats]:
        density = _density(theta, at, floor)
        doubt = float(_PRIOR @ np.square(theta - start)) / 2
        excess = (power / density - 1) * np.sqrt(at.count)
        return float((at.count * (np.log(density) + power / density)).sum()) + doubt, excess.ravel()

    def pushed(theta: Floats, excess: Floats) -> tuple[Floats, Floats]:
        slopes = _slopes(theta, at, floor)
        return slopes @ slopes.T + np.diag(_PRIOR), slopes @ excess - _PRIOR * (theta - start)

    theta, damping = start, 1e-3
    loss, excess = of(theta)
    information, push = pushed(theta, excess)
    for _ in range(_STEPS):
        step = np.linalg.solve(information + damping * np.diag(np.diag(information) + 1e-9), push)
        moved = np.clip(theta + step, *bounds.T)
        new_loss, new_excess = of(moved)
        if new_loss > loss:
            damping *= 10
            continue
        gained, theta, loss, excess, damping = loss - new_loss, moved, new_loss, new_excess, damping / 5
        if gained < 1e-3:
            break
        information, push = pushed(theta, excess)
    return theta, loss


def _covariance(theta: Floats, bounds: Floats, at: _Frequencies, floor: float) -> Floats:
    """Of the parameters, 0 for those at a bound: inverse of the Fisher information sum dlogS dlogS^T."""
    free = np.flatnonzero((theta > bounds[:, 0] + _NEAR) & (theta < bounds[:, 1] - _NEAR))
    slopes = _slopes(theta, at, floor)[free]
    covariance = np.zeros((len(theta), len(theta)))
    covariance[np.ix_(free, free)] = np.linalg.pinv(slopes @ slopes.T + np.diag(_PRIOR[free])) * HANN_FREEDOM**2
    return covariance
