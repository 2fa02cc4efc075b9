"""Texture of the background: a power-law spectrum, blurred by the lens, plus a floor that is white from pixel to pixel.

The spectrum is S(f) = A G(f) / (1 + |s c fx|^bx + |c fy|^by) + w^2, as for backgrounds of kind ground (`betas`,
`correlation_mrad`, `stretch`), with the power transfer function G of a Gaussian blur. It is fitted to the periodogram P
by P. Whittle's likelihood ("Estimation and information in stationary time series", Arkiv for Matematik 2, 1953): the
sum over frequencies of log S + P / S is minimised. Intervals follow from the Fisher information of a Gaussian field. A
real scene varies more from place to place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from irsim.calibration.statistics import Estimate, hull
from irsim.types import Floats

TILE = 1024
"""Side, px, of the field over which the standard deviation of texture is defined, as for rendered backgrounds."""
HANN_FREEDOM = 35 / 128 / (3 / 8) ** 2
"""N sum w^4 / (sum w^2)^2 = 1.94 of a Hann window w: it divides the degrees of freedom along each axis."""
USUAL_BLUR = Estimate(0.6, 0.4, 0.8)
"""Sigma, px, of the blur assumed where no point is found: 0.42 F lambda / pitch, with F lambda / pitch from 1 to 2 (G.
C. Holst, Opt. Eng. 46, 2007)."""
_REFERENCE = 0.04
"""Frequency, cycles a px, at which the strength of the texture is fitted."""
_AXIS_CYCLES = 2
"""Half width, cycles a side, of the bands along the axes that are left out, as they contain noise of lines."""
_COARSE = 512
"""Side of a picture, px, up to which no frequencies are averaged before the fit; at twice this side 2 x 2 are."""
_PRESENT = 30.0
"""Least gain of log likelihood by which texture is accepted. Four parameters gain 2 by chance; bad pixels can give a
gain of 10."""
_STEEPEST = 5.9
"""Slope along both axes from which the spectrum is that of a single smooth object, not of texture."""
_NEAR = 0.01
_PRIOR = np.array([0, 0, 0, 1 / 0.7, 1 / 0.7, 0]) ** 2 * HANN_FREEDOM**2
"""Prior weights that draw log c to the log of half the longer side, and log s to 0: a picture hardly constrains sizes
larger than itself."""
_Z = 1.96


@dataclass(frozen=True)
class PowerLaw:
    """Texture of a background, in counts and px.

    spread          standard deviation before the blur, over 1024 x 1024 px
    beta_x, beta_y  slopes of the 2-D power spectrum along the axes
    correlation_px  size of the largest features
    stretch         ratio of the width of features to their height
    """

    spread: Estimate
    beta_x: Estimate
    beta_y: Estimate
    correlation_px: Estimate
    stretch: Estimate


@dataclass(frozen=True)
class Spectrum:
    """Fitted spectrum of a picture.

    texture     power law of the texture, or None
    floor       variance that is white from pixel to pixel
    density     spectrum of the model, (rows, columns // 2 + 1), in the order of numpy's rfft2
    loss        negative log likelihood, up to a constant of the periodogram
    """

    texture: PowerLaw | None
    floor: Estimate
    density: Floats
    loss: float


def periodogram(picture: Floats) -> Floats:
    """Return the power spectrum of a picture (rows, columns), less a fitted plane, under a Hann window. It is 1 for
    white noise of unit variance."""
    rows, columns = picture.shape
    y, x = np.mgrid[:rows, :columns]
    plane = np.stack([np.ones(picture.size), x.ravel(), y.ravel()], axis=1)
    rest = picture - (plane @ np.linalg.lstsq(plane, picture.ravel(), rcond=None)[0]).reshape(picture.shape)
    window = np.outer(np.hanning(rows + 1)[:-1], np.hanning(columns + 1)[:-1])
    found: Floats = np.square(np.abs(np.fft.rfft2(rest * window))) / np.square(window).sum()
    return found


def fit_texture(powers: Floats, shape: tuple[int, int], blur: Estimate | None) -> tuple[Spectrum, Estimate]:
    """Return the spectrum fitted to the periodogram of a picture (rows, columns), and the blur that it assumes.

    blur    sigma of the sharpest point, px; None without a point

    The spectrum is fitted at the ends and the middle of the possible blurs, and each interval covers those of all three
    fits. Without a point, the likeliest blur is chosen.
    """
    low = USUAL_BLUR.low if blur is None else min(USUAL_BLUR.low, blur.low)
    high = USUAL_BLUR.high if blur is None else blur.high
    middle = USUAL_BLUR.value if blur is None else blur.value
    tried = [_fit(powers, shape, psf_px) for psf_px in (middle, low, high)]
    taken = 0 if blur is not None else int(np.argmin([each.loss for each in tried] + np.array([0.0, 2.0, 2.0])))
    best = tried[taken]
    floor = hull(best.floor, [each.floor for each in tried])
    texture = best.texture
    if texture is not None:
        others = [each.texture for each in tried if each.texture is not None]
        names = [field.name for field in fields(PowerLaw)]
        texture = PowerLaw(**{n: hull(getattr(texture, n), [getattr(other, n) for other in others]) for n in names})
        if min(texture.beta_x.value, texture.beta_y.value) > _STEEPEST:
            texture = None
    return Spectrum(texture, floor, best.density, best.loss), Estimate((middle, low, high)[taken], low, high)


@dataclass(frozen=True, eq=False)
class _Frequencies:
    """Frequencies x and |y|, cycles a px, (Y, X), each the mean of `count` ones, and the power transfer of a blur."""

    x: Floats
    y: Floats
    blur: Floats
    count: float

    @classmethod
    def of(cls, shape: tuple[int, int], psf_px: float) -> _Frequencies:
        x, y = np.meshgrid(np.fft.rfftfreq(shape[1]), np.abs(np.fft.fftfreq(shape[0])))
        return cls(x, y, np.exp(-4 * np.pi**2 * psf_px**2 * (x**2 + y**2)), 1.0)

    def fitted(self, powers: Floats, shape: tuple[int, int]) -> tuple[_Frequencies, Floats]:
        """Return the frequencies used in the fit, and their powers.

        Bands along the axes are left out. Powers at fy and -fy are averaged, in a large picture also those nearby.
        """
        down = np.flatnonzero((self.y[:, 0] * shape[0] > _AXIS_CYCLES + 0.5) & (self.y[:, 0] < 0.5))
        across = np.flatnonzero((self.x[0] * shape[1] > _AXIS_CYCLES + 0.5) & (self.x[0] < 0.5))
        step = max(max(shape) // _COARSE, 1)
        rows = [down[k : k + step] for k in range(0, len(down) // 2 - step + 1, step)]
        mirrored = [len(self.y) - row for row in rows]
        columns = [across[k : k + step] for k in range(0, len(across) - step + 1, step)]

        def mean(values: Floats) -> Floats:
            pairs = zip(rows, mirrored, strict=True)
            folded = np.stack([values[row].mean(axis=0) + values[other].mean(axis=0) for row, other in pairs])
            return np.stack([folded[:, column].mean(axis=1) for column in columns], axis=1) / 2

        at = _Frequencies(mean(self.x), mean(self.y), mean(self.blur), 2.0 * step**2)
        return at, mean(powers)


def _fit(powers: Floats, shape: tuple[int, int], psf_px: float) -> Spectrum:
    everywhere = _Frequencies.of(shape, psf_px)
    at, power = everywhere.fitted(powers, shape)
    if not power.any():
        return Spectrum(None, Estimate(0.0, 0.0, 1e-24), np.full(powers.shape, 1e-24), 0.0)
    radius = np.hypot(at.x, at.y)
    floor = float(power[radius > 0.45].mean()) + 1e-12
    middle = power[radius < max(_REFERENCE * 2, float(radius.min()) * 2)]
    start = np.array([np.log(max(middle.mean() - floor, floor * 1e-3)), 2.5, 2.5, np.log(max(shape) / 2), 0.0, 0.0])
    bounds = np.array([(-60, 60), (0.5, 6), (0.5, 6), (np.log(4), np.log(4 * max(shape))), (-2, 2), (-20, 5)])
    theta, loss = _score(start, bounds, power, at, floor)
    loss /= HANN_FREEDOM**2
    count = power.size * at.count
    flat = float(power.mean())
    flat_loss = count * (np.log(flat) + 1) / HANN_FREEDOM**2
    if flat_loss - loss < _PRESENT:
        error = _Z * flat * HANN_FREEDOM / np.sqrt(count)
        return Spectrum(None, Estimate(flat, flat - error, flat + error), np.full(powers.shape, flat), flat_loss)
    covariance = _covariance(theta, bounds, at, floor)

    def parameter(number: int, back: Callable[[float], float] = float) -> Estimate:
        low, high = bounds[number]
        if low + _NEAR < theta[number] < high - _NEAR:
            return function_of(lambda t: t[number], back)
        return Estimate(*(float(back(x)) for x in (theta[number], low, high)))

    def function_of(value: Callable[[Floats], float], back: Callable[[float], float]) -> Estimate:
        steps = np.array([(value(theta + step) - value(theta - step)) / 2e-3 for step in 1e-3 * np.eye(len(theta))])
        reach = _Z * math.sqrt(max(float(steps @ covariance @ steps), 0.0))
        middle = float(value(theta))
        return Estimate(*(float(back(x)) for x in (middle, middle - reach, middle + reach)))

    texture = PowerLaw(
        spread=function_of(lambda t: _log_variance(t) / 2, _exp),
        beta_x=parameter(1),
        beta_y=parameter(2),
        correlation_px=parameter(3, _exp),
        stretch=parameter(4, _exp),
    )
    white = function_of(lambda t: t[5] + np.log(floor), _exp)
    return Spectrum(texture, white, _density(theta, everywhere, floor), loss)


def _exp(value: float) -> float:
    return math.exp(value) if value < 700 else math.inf


def _shape(theta: Floats, x: Floats, y: Floats) -> Floats:
    """Return the power of texture with unit strength at frequencies x and |y|."""
    along = np.exp(theta[3])
    return np.asarray(1 / (1 + (np.exp(theta[4]) * along * x) ** theta[1] + (along * y) ** theta[2]))


def _strength(theta: Floats) -> float:
    reference = np.array([_REFERENCE / np.sqrt(2)])
    return float(np.exp(theta[0]) / _shape(theta, reference, reference)[0])


def _density(theta: Floats, at: _Frequencies, floor: float) -> Floats:
    return np.asarray(_strength(theta) * _shape(theta, at.x, at.y) * at.blur + floor * np.exp(theta[5]))


def _log_variance(theta: Floats) -> float:
    """Return the log variance of the texture in a field of TILE x TILE px, unblurred and without its mean."""
    half = np.arange(TILE // 2 + 1) / TILE
    shape = _shape(theta, half[None], half[:, None])
    shape[0, 0] = 0
    count = np.where((half == 0) | (half == 0.5), 1, 2)  # negative frequencies have the same power
    return float(np.log(_strength(theta) * (count @ shape @ count) / TILE**2))


def _slopes(theta: Floats, at: _Frequencies, floor: float) -> Floats:
    """Return the derivatives d log S / d theta, (parameters, frequencies), times the square root of `at.count`."""
    ends = [
        [np.log(_density(theta + sign * step, at, floor)) for sign in (1, -1)] for step in 1e-3 * np.eye(len(theta))
    ]
    return np.stack([((up - down) / 2e-3 * math.sqrt(at.count)).ravel() for up, down in ends])


def _score(start: Floats, bounds: Floats, power: Floats, at: _Frequencies, floor: float) -> tuple[Floats, float]:
    """Return the parameters that minimise the sum of log S + P / S, and the sum, by Fisher scoring with the damping of
    K. Levenberg (1944)."""

    def loss_of(theta: Floats) -> float:
        density = _density(theta, at, floor)
        doubt = float(_PRIOR @ np.square(theta - start)) / 2
        return float(at.count * (np.log(density) + power / density).sum()) + doubt

    theta, damping = start, 1e-3
    loss = loss_of(theta)
    for _ in range(60):
        slopes = _slopes(theta, at, floor)
        excess = ((power / _density(theta, at, floor) - 1) * math.sqrt(at.count)).ravel()
        information = slopes @ slopes.T + np.diag(_PRIOR)
        push = slopes @ excess - _PRIOR * (theta - start)
        while damping < 1e9:
            step = np.linalg.solve(information + damping * np.diag(np.diag(information) + 1e-9), push)
            moved = np.clip(theta + step, *bounds.T)
            new_loss = loss_of(moved)
            if new_loss <= loss:
                break
            damping *= 10
        else:
            break
        gained, theta, loss, damping = loss - new_loss, moved, new_loss, damping / 5
        if gained < 1e-3:
            break
    return theta, loss


def _covariance(theta: Floats, bounds: Floats, at: _Frequencies, floor: float) -> Floats:
    """Return the inverse Fisher information of the parameters, with 0 for parameters at a bound."""
    free = np.flatnonzero((theta > bounds[:, 0] + _NEAR) & (theta < bounds[:, 1] - _NEAR))
    slopes = _slopes(theta, at, floor)[free]
    covariance = np.zeros((len(theta), len(theta)))
    covariance[np.ix_(free, free)] = np.linalg.pinv(slopes @ slopes.T + np.diag(_PRIOR[free])) * HANN_FREEDOM**2
    return covariance


def grey_levels(seen: Floats, spectrum: Spectrum) -> tuple[float, ...]:
    """Return 17 quantiles of the pixels (N,) of a texture whose skewness or kurtosis is not Gaussian, else ().

    The variances of skewness and kurtosis are 6 / n and 24 / n for n = (sum S)^2 / sum S^2 independent values.
    """
    if spectrum.texture is None:
        return ()
    density = spectrum.density.copy()
    density[0, 0] = 0
    independent = density.sum() ** 2 / np.square(density).sum()
    unit = (seen - seen.mean()) / seen.std()
    skewness = abs(float((unit**3).mean())) / math.sqrt(6 / independent)
    kurtosis = abs(float((unit**4).mean()) - 3) / math.sqrt(24 / independent)
    if max(skewness, kurtosis) < 4:
        return ()
    return tuple(float(value) for value in np.quantile(seen, np.linspace(0.002, 0.998, 17)))
