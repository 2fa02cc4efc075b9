"""Random manoeuvres by Singer's model: acceleration that forgets itself."""

from __future__ import annotations

import numpy as np

from irsim.config.quantities import Degrees, NotNegative, Pair, PixelSpeed, Positive, Triple, Velocity
from irsim.geometry.context import SceneContext
from irsim.motion.base import MetrePath, PixelPath
from irsim.motion.dynamics import Dynamics
from irsim.motion.straight import unit
from irsim.rng import stream
from irsim.types import Floats

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def _response(times: Floats, correlation: float) -> Floats:
    """(n, 3): place, speed and acceleration at `times` (n,) after a unit jump of the acceleration that then decays."""
    x = times / correlation
    # (x - 1 + e^-x) / x^2 loses its digits near 0: there its series, exact to 1e-16 at 1e-3.
    small = x < 1e-3
    safe = np.where(small, 1.0, x)
    bend = np.where(small, 0.5 - x / 6 + x**2 / 24 - x**3 / 120, (safe + np.expm1(-safe)) / safe**2)
    return np.stack([times**2 * bend, -correlation * np.expm1(-x), np.exp(-x)], axis=-1)


def singer(step: float, sigma: float, correlation: float) -> tuple[Floats, Floats]:
    """F and Q, (3, 3) each, of (place, speed, acceleration) over `step`.

    The acceleration is an Ornstein-Uhlenbeck process of standard deviation `sigma` and correlation
    time `correlation`. R. A. Singer, IEEE Trans. AES-6(4), 1970, eqs. 8 and 12; Q is the integral of
    the response to white noise, by Gauss's rule (its closed form loses all digits for long
    correlation times).
    """
    place, speed, left = _response(np.array([step]), correlation)[0]
    transition = np.array([[1.0, step, place], [0.0, 1.0, speed], [0.0, 0.0, left]])
    responses = _response((_NODES + 1) * step / 2, correlation)
    density = 2 * sigma**2 / correlation
    return transition, density * step / 2 * np.einsum("n,ni,nj->ij", _WEIGHTS, responses, responses)


def _flown(
    frames: Floats, context: SceneContext, name: str, step: float, sigma: float, correlation: float, axes: int
) -> Floats:
    """(n, axes) displacement from a steady way, at rest and with stationary acceleration at frame 0."""
    frames = np.asarray(frames, dtype=np.float64)
    whole = np.maximum(np.floor(frames), 0).astype(np.int64)
    count = int(whole.max(initial=0)) + 2
    transition, noise = singer(step, sigma, correlation)
    scale = np.sqrt(np.maximum(np.diag(noise), np.finfo(float).tiny))
    root = scale[:, None] * np.linalg.cholesky(noise / np.outer(scale, scale) + 1e-12 * np.eye(3)) if sigma else noise
    draws = stream(context.seed, name, "path").standard_normal((count, axes, 3))
    states = np.zeros((count, axes, 3))
    states[0, :, 2] = sigma * draws[0, :, 2]
    for frame in range(1, count):
        states[frame] = states[frame - 1] @ transition.T + draws[frame] @ root.T
    return np.where(frames[:, None] < 0, 0.0, _between(states[whole], states[whole + 1], frames - whole, step))


def _between(before: Floats, after: Floats, part: Floats, step: float) -> Floats:
    """(n, axes) places at part 0..1 of a step between states: the quintic that meets both, accelerations too."""
    s = part[:, None]
    p0, v0, a0 = np.moveaxis(before, -1, 0) * np.array([1.0, step, step**2])[:, None, None]
    p1, v1, a1 = np.moveaxis(after, -1, 0) * np.array([1.0, step, step**2])[:, None, None]
    way, turn, pull = p1 - p0 - v0 - a0 / 2, v1 - v0 - a0, a1 - a0
    cubic, quartic, quintic = 10 * way - 4 * turn + pull / 2, -15 * way + 7 * turn - pull, 6 * way - 3 * turn + pull / 2
    return np.asarray(p0 + s * (v0 + s * (a0 / 2 + s * (cubic + s * (quartic + s * quintic)))))


def _dynamics(axes: tuple[str, ...], step: float, sigma: float, correlation: float) -> Dynamics:
    state = tuple(name for axis in axes for name in (axis, f"v{axis}", f"a{axis}"))
    transition, noise = singer(step, sigma, correlation)
    return Dynamics.single(state, np.kron(np.eye(len(axes)), transition), np.kron(np.eye(len(axes)), noise))


class Singer(PixelPath):
    """A steady way in the picture with random accelerations that last a while; `sigma: 0` is the way itself."""

    start: Pair
    """[x, y] at frame 0, px."""
    speed: PixelSpeed = 2.0
    """At frame 0, px per frame."""
    heading_deg: Degrees = 0.0
    """Direction at frame 0, degrees: 0 right, 90 down."""
    sigma: NotNegative = 0.05
    """Standard deviation of the acceleration on each axis, px per frame^2."""
    correlation_frames: Positive = 30.0
    """How long an acceleration lasts, frames."""

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        steady = self.speed * np.asarray(frames)[:, None] * unit(self.heading_deg)
        flown = _flown(frames, context, name, 1.0, self.sigma, self.correlation_frames, 2)
        return np.asarray(np.asarray(self.start) + steady + flown)

    def dynamics(self, context: SceneContext) -> Dynamics:
        return _dynamics(("x", "y"), 1.0, self.sigma, self.correlation_frames)


class SingerM(MetrePath):
    """A steady way in space with random accelerations that last a while; `sigma_m_s2: 0` is the way itself."""

    start_m: Triple
    """Where it is at frame 0, m."""
    velocity_m_s: Velocity = (0.0, 0.0, 0.0)
    """At frame 0, metres a second."""
    sigma_m_s2: NotNegative = 5.0
    """Standard deviation of the acceleration on each axis, m/s2."""
    correlation_s: Positive = 2.0
    """How long an acceleration lasts, s (Singer: an evasive turn 10 to 20 s, turbulence 1 s)."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        step = 1 / context.rate_hz
        steady = step * np.asarray(frames)[:, None] * np.asarray(self.velocity_m_s)
        flown = _flown(frames, context, name, step, self.sigma_m_s2, self.correlation_s, 3)
        return self.to_first(np.asarray(self.start_m) + steady + flown, context)

    def dynamics(self, context: SceneContext) -> Dynamics:
        return _dynamics(self.axis_names, 1 / context.rate_hz, self.sigma_m_s2, self.correlation_s)
