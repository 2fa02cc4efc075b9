"""Stochastic paths: Singer's model of manoeuvres, and stop-and-go motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.config.quantities import LARGEST, TOP_SPEED, Degrees, NotNegative, PixelSpeed, Positive, Triple, Velocity
from irsim.geometry.context import SceneContext
from irsim.motion.base import Dynamics, HeadedPath, HeadedPixelPath, MetrePath, frames_of, unit
from irsim.rng import stream
from irsim.types import Floats

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def _response(times: Floats, correlation: float) -> Floats:
    """Return (n, 3) position, speed, acceleration at `times` (n,) of a body whose acceleration begins at 1 and
    decays."""
    x = times / correlation
    # (x - 1 + e^-x) / x^2 cancels near 0; its series there is exact to 1e-16 at 1e-3.
    small = x < 1e-3
    safe = np.where(small, 1.0, x)
    bend = np.where(small, 0.5 - x / 6 + x**2 / 24 - x**3 / 120, (safe + np.expm1(-safe)) / safe**2)
    return np.stack([times**2 * bend, -correlation * np.expm1(-x), np.exp(-x)], axis=-1)


def singer(step: float, sigma: float, correlation: float) -> tuple[Floats, Floats]:
    """Return the transition matrix F and the noise covariance Q, (3, 3) each, of (position, speed, acceleration) over a
    time `step`.

    The acceleration is an Ornstein-Uhlenbeck process of standard deviation `sigma` and correlation
    time `correlation`. R. A. Singer, IEEE Trans. AES-6(4), 1970, eqs. 8 and 12. Q is integrated by Gauss's rule, as its
    closed form cancels for long correlation times.
    """
    place, speed, left = _response(np.array([step]), correlation)[0]
    transition = np.array([[1.0, step, place], [0.0, 1.0, speed], [0.0, 0.0, left]])
    responses = _response((_NODES + 1) * step / 2, correlation)
    density = 2 * sigma**2 / correlation
    return transition, density * step / 2 * np.einsum("n,ni,nj->ij", _WEIGHTS, responses, responses)


def _displacement(
    frames: Floats, context: SceneContext, name: str, step: float, sigma: float, correlation: float, axes: int
) -> Floats:
    """Return the displacement (n, axes) from motion at constant velocity; the acceleration is stationary from frame 0
    on."""
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
    """Return positions (n, axes) at fractions `part`, 0..1, of a step, on the quintic through the states at both
    ends."""
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


class Singer(HeadedPixelPath):
    """Constant velocity in the picture plus correlated random acceleration (Singer); `sigma: 0` is straight."""

    speed: PixelSpeed = 2.0
    """Speed at frame 0, px per frame."""
    sigma: NotNegative = 0.05
    """Standard deviation of the acceleration on each axis, px per frame^2."""
    correlation_frames: Positive = 30.0
    """Correlation time of the acceleration, frames."""

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        steady = self.speed * np.asarray(frames)[:, None] * unit(self.heading_deg)
        random = _displacement(frames, context, name, 1.0, self.sigma, self.correlation_frames, 2)
        return np.asarray(np.asarray(self.start) + steady + random)

    def dynamics(self, context: SceneContext) -> Dynamics:
        return _dynamics(("x", "y"), 1.0, self.sigma, self.correlation_frames)


class SingerM(MetrePath):
    """Constant velocity in space plus correlated random acceleration (Singer); `sigma_m_s2: 0` is straight."""

    start_m: Triple
    """Position at frame 0, m."""
    velocity_m_s: Velocity = (0.0, 0.0, 0.0)
    """Velocity at frame 0, m/s."""
    sigma_m_s2: NotNegative = 5.0
    """Standard deviation of the acceleration on each axis, m/s2."""
    correlation_s: Positive = 2.0
    """Correlation time of the acceleration, s (Singer: evasive turn 10 to 20 s, turbulence 1 s)."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        step = 1 / context.rate_hz
        steady = step * np.asarray(frames)[:, None] * np.asarray(self.velocity_m_s)
        random = _displacement(frames, context, name, step, self.sigma_m_s2, self.correlation_s, 3)
        return self.to_first(np.asarray(self.start_m) + steady + random, context)

    def dynamics(self, context: SceneContext) -> Dynamics:
        return _dynamics(self.axis_names, 1 / context.rate_hz, self.sigma_m_s2, self.correlation_s)


Share = Annotated[float, Field(ge=0, le=0.9)]


@dataclass(frozen=True)
class StopAndGoProfile:
    """Speed profile of stop-and-go motion, in any unit of length.

    speed  while moving, distance per frame
    go     duration of a movement, frames, with acceleration and braking; the first begins at full speed
    stop   duration of a stop, frames
    ease   duration of acceleration and of braking, frames; at most half a movement
    vary   each duration is uniform from (1 - vary) to (1 + vary) times its mean
    """

    speed: float
    go: float
    stop: float
    ease: float
    vary: float

    def distance(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        """Return the distance since frame 0, (n,), at frame numbers (n,)."""
        frames = np.asarray(frames, dtype=np.float64)
        times, speeds = self.speed_nodes(float(frames.max(initial=0.0)), context, name)
        ways = np.append(0.0, np.cumsum((speeds[1:] + speeds[:-1]) / 2 * np.diff(times)))
        leg = np.clip(np.searchsorted(times, frames, side="right") - 1, 0, len(times) - 2)
        part, span = frames - times[leg], times[leg + 1] - times[leg]
        gain = np.where(frames < 0, 0.0, (speeds[leg + 1] - speeds[leg]) / span)
        return np.asarray(ways[leg] + speeds[leg] * part + gain * part**2 / 2)

    def speed_nodes(self, last: float, context: SceneContext, name: str) -> tuple[Floats, Floats]:
        """Return frames and speeds between which the speed is linear, to beyond frame `last`."""
        shortest = (1 - self.vary) * (self.go + self.stop)
        count = int(last / shortest) + 2
        drawn = 1 + self.vary * (2 * stream(context.seed, name, "path").random((count, 2)) - 1)
        goes, stops = drawn.T * np.array([[self.go], [self.stop]])
        begins = np.append(0.0, np.cumsum(goes + stops))[:-1]
        ease = np.maximum(np.minimum(self.ease, goes / 2), 1e-6)
        times = np.stack([begins, begins + ease, begins + goes - ease, begins + goes], axis=1)
        speeds = np.tile([0.0, self.speed, self.speed, 0.0], (count, 1))
        speeds[0, 0] = self.speed
        # A stop of zero duration: keep its two ends apart, so that times rise.
        return np.maximum.accumulate(times.ravel() + 1e-9 * np.arange(times.size)), speeds.ravel()


class StopAndGo(HeadedPixelPath):
    """Straight line in the picture with alternating movement and stops."""

    speed: PixelSpeed = 2.0
    """Speed while moving, px per frame."""
    heading_deg: Degrees = 0.0
    """Direction, degrees: 0 right, 90 down."""
    go_frames: Annotated[float, Field(ge=1, le=LARGEST)] = 40.0
    """Duration of a movement, frames, with acceleration and braking; the first begins at full speed."""
    stop_frames: NotNegative = 20.0
    """Duration of a stop, frames."""
    vary: Share = 0.0
    """Each duration is uniform from (1 - vary) to (1 + vary) times the given one."""
    ease_frames: NotNegative = 6.0
    """Duration of acceleration and of braking, frames; at most half a movement."""

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        stops = StopAndGoProfile(self.speed, self.go_frames, self.stop_frames, self.ease_frames, self.vary)
        way = stops.distance(frames, context, name)
        return np.asarray(np.asarray(self.start) + way[:, None] * unit(self.heading_deg))


class StopAndGoM(HeadedPath):
    """Straight line in space with alternating movement and stops; speed and climb rate hold while the target moves."""

    speed_m_s: Annotated[NotNegative, TOP_SPEED] = 10.0
    """Ground speed while moving, m/s."""
    go_s: Positive = 5.0
    """Duration of a movement, s, with acceleration and braking; the first begins at full speed. At least one frame."""
    stop_s: NotNegative = 2.0
    """Duration of a stop, s."""
    vary: Share = 0.0
    """Each duration is uniform from (1 - vary) to (1 + vary) times the given one."""
    ease_s: NotNegative = 2.0
    """Duration of acceleration and of braking, s; at most half a movement. 2 s from 10 m/s are 0.5 g, hard braking."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        rate_hz = context.rate_hz
        stops = StopAndGoProfile(
            1.0, frames_of(self.go_s, context), self.stop_s * rate_hz, self.ease_s * rate_hz, self.vary
        )
        seconds = stops.distance(frames, context, name) / rate_hz
        return self.displaced(self.speed_m_s * seconds, np.zeros_like(seconds), self.climb_m_s * seconds, context)
