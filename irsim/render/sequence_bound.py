"""Posterior Cramér-Rao bound on a target's position from a sequence of frames.

    P- = F P F' + Q        P = (P-^-1 + E[H' J H])^-1

F and Q are the path's law of motion, J is the information of a frame on the place, with unknown amplitude, and H the
derivative of the place in the picture by that in the unmoved camera. E is the mean over drawn paths. P. Tichavsky, C.
Muravchik and A. Nehorai, IEEE Trans. Signal Processing 46, 1386 (1998), in covariance form, which needs no inverse of
Q.

The bound holds for paths in pixels that are linear in one mode, in noise that is independent from frame to frame.
Other scenes have single-frame bounds only: `no_sequence_bound` gives the reason.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from irsim.camera.ar1 import Ar1
from irsim.errors import InputError, is_number, whole_number
from irsim.motion import Dynamics, PixelPath
from irsim.render.fisher import position_covariance
from irsim.render.moments import Exact
from irsim.scenario.model import Scenario
from irsim.types import TargetBounds

if TYPE_CHECKING:
    from irsim.render.bounds import FrameInformation

DRAWS = 50
"""Number of drawn paths over which the information is averaged, unless given."""


def no_sequence_bound(scenario: Scenario, target: str) -> str | None:
    """Return the reason why a target has no sequence bound, in words; None where it has one."""
    path = next(each.path for each in scenario.targets if each.id == target)
    law = path.dynamics(scenario.context)
    if law is None:
        return "its path has no linear law"
    if len(law.transitions) > 1:
        return "its path switches between several laws"
    if not isinstance(path, PixelPath):
        return "the law of its path is in metres"
    if scenario.camera.response_time(scenario.is_on).has_memory:
        return "the detector's response time mixes frames"
    sensor = scenario.camera.signal_chain(scenario.seed, scenario.is_on)
    frame = sensor.frame_context(scenario.frames - 1, (1, 1))
    for noise in sensor.noises:
        if isinstance(noise, Ar1):
            return f"the noise {noise.name} depends on earlier frames"
        if noise.variance_terms(frame, True) != noise.variance_terms(frame, False):
            return f"the fixed pattern {noise.name} is unknown"
    return None


def with_sequence_bounds(
    information: FrameInformation,
    rows: Sequence[TargetBounds],
    frames: range,
    start_error_px: float,
    draws: int = DRAWS,
) -> list[TargetBounds]:
    """Return single-frame bounds with the sequence bound from the first of `frames` on; without it where there is none.

    InputError for an error of the start box that is not above 0.
    """
    if not (is_number(start_error_px) and 0 < start_error_px < math.inf):
        raise InputError(f"start_error_px {start_error_px!r}: allowed: a number above 0, px")
    draws, scenario = whole_number("draws", draws, 1), information.scenario
    arrivals = [scenario.arrivals[index] for index in frames]
    covariances: dict[tuple[str, int], Exact] = {}
    for name in dict.fromkeys(row.target for row in rows):
        if no_sequence_bound(scenario, name) is None:
            found = sequence_covariances(information, name, arrivals, start_error_px, draws)
            covariances |= {(name, index): each for index, each in zip(frames, found, strict=True)}
    return [_with_covariance(row, covariances.get((row.target, row.index))) for row in rows]


def _with_covariance(row: TargetBounds, covariance: Exact | None) -> TargetBounds:
    if covariance is None:
        return row
    sd_x, sd_y = np.sqrt(np.diag(covariance)).tolist()
    return replace(row, sd_x_sequence=sd_x, sd_y_sequence=sd_y)


def sequence_covariances(
    information: FrameInformation, target: str, frames: Sequence[int], start_error_px: float, draws: int
) -> Exact:
    """Return the bound on the covariance of a target's place, (n, 2, 2) px² of the unmoved camera, after each of the
    scenario's `frames`, for a target that has one."""
    context = information.scenario.context
    path = next(each.path for each in information.scenario.targets if each.id == target)
    law = path.dynamics(context)
    assert isinstance(path, PixelPath)
    assert law is not None
    mean = mean_information(information, target, frames, draws if law.noises.any() else 1)
    pixels = path.pixels(np.array([0.0, 1.0]), context, target)
    return filtered(law, frames, mean, start_error_px, float(np.linalg.norm(pixels[1] - pixels[0])))


def filtered(law: Dynamics, frames: Sequence[int], information: Exact, start_error_px: float, speed: float) -> Exact:
    """Return the bound on the covariance of the position, (n, 2, 2) px², after each frame.

    law          of one mode, its state with x and y, px and frames
    frames       (n,) numbers of the scenario's frames, rising or repeated
    information  (n, 2, 2) on the position, 1/px²
    speed        px per frame: the velocity at frame 0 has any direction

    The first covariance is that of the start box, with the velocity and further components of the law at that frame.
    """
    F, Q = law.transitions[0], law.noises[0]
    at = [law.state.index("x"), law.state.index("y")]
    P = _initial(law, speed)
    for _ in range(frames[0]):
        P = F @ P @ F.T + Q
    P[at], P[:, at] = 0.0, 0.0
    P[at, at] = start_error_px**2
    found = np.empty((len(frames), 2, 2))
    for k, J in enumerate(information):
        for _ in range(frames[k] - frames[k - 1] if k else 0):
            P = F @ P @ F.T + Q
        # (P^-1 + H' J H)^-1 = P - P H' (J^-1 + H P H')^-1 H P, written without inverses of P and J.
        gain = P[:, at] @ np.linalg.solve(np.eye(2) + J @ P[np.ix_(at, at)], J)
        P = P - gain @ P[at]
        P = (P + P.T) / 2
        found[k] = P[np.ix_(at, at)]
    return found


def _initial(law: Dynamics, speed: float) -> Exact:
    """Return the covariance of velocity and acceleration at frame 0: any heading, and the law's stationary rest."""
    F, Q = law.transitions[0], law.noises[0]
    P: Exact = np.zeros(Q.shape)
    for axis in ("x", "y"):
        velocity = law.state.index(f"v{axis}")
        P[velocity, velocity] = speed**2 / 2
        if f"a{axis}" in law.state:
            each = law.state.index(f"a{axis}")
            P[each, each] = Q[each, each] / (1 - F[each, each] ** 2)
    return P


def mean_information(information: FrameInformation, target: str, frames: Sequence[int], draws: int) -> Exact:
    """Return E[H' J H], (n, 2, 2) 1/px², over `draws` paths: those of the scenario's seed and of the seeds after it."""
    total = np.zeros((len(frames), 2, 2))
    scenario = information.scenario
    for draw in range(draws):
        one = information
        if draw:
            one = type(information)(scenario.model_copy(update={"seed": scenario.seed + draw}))
        total = total + _information(one, target, frames)
    return np.asarray(total / draws)


def _information(information: FrameInformation, target: str, frames: Sequence[int]) -> Exact:
    """Return H' J H of each frame; 0 in a frame that repeats the one before, or shows no target."""
    found = np.zeros((len(frames), 2, 2))
    turned = picture_derivatives(information, target, frames)
    shown = information.renderer.sensor.shown
    for k, frame in enumerate(frames):
        repeats = shown(frame) != frame or (k > 0 and frame == frames[k - 1])
        derivatives = None if repeats else information.derivatives(frame, target)
        covariance = None if derivatives is None else position_covariance(information.of(frame, derivatives))
        if covariance is not None:
            found[k] = turned[k].T @ np.linalg.solve(covariance, turned[k])
    return found


def picture_derivatives(information: FrameInformation, target: str, frames: Sequence[int]) -> Exact:
    """Return H (n, 2, 2): derivatives of a target's place in each frame by its place in the unmoved camera."""
    renderer, half = information.renderer, 0.05
    now = renderer.now(max(frames))
    trajectory = next(each for each in now.trajectories if each.target.id == target)
    positions, camera, geometry = trajectory.positions, now.camera, renderer.context.geometry
    ranges, pixels = np.linalg.norm(positions, axis=1), geometry.project(positions)

    def seen(x: float, y: float) -> Exact:
        return np.asarray(camera.project(geometry.place(np.add(pixels, (x, y)), ranges))[list(frames)], np.float64)

    along, down = seen(half, 0) - seen(-half, 0), seen(0, half) - seen(0, -half)
    return np.stack([along, down], axis=-1) / (2 * half)
