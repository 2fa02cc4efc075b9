"""Several Kalman filters at once, each detection assigned to one of them: global nearest neighbours.

All filters and detections are paired so that the sum of the costs is least (S. Blackman, R. Popoli, "Design and
Analysis of Modern Tracking Systems", 1999, sections 6.4 and 7.2; the assignment by scipy). The first track is the
target; the others take the detections of other objects.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack.filters.kalman import updated_covariance
from irtrack.filters.motion import constant_velocity

DETECTION = 0.9
"""Detection probability of an object detected in the last frame; `REAPPEARANCE`: that of an object missed in it."""
REAPPEARANCE = 0.5
CLUTTER = 1e-6
"""Density of false or new detections per px^2 and frame: one in thirteen frames of 320 x 240 px."""
LEVEL_SD = 0.4
"""Standard deviation of ln(height of a detection / level of its track), the level being a running mean of heights."""
START_SPEED = 1.0
"""Standard deviation of a new track's first speed on each axis, px/frame."""
CONFIRMED = 5
"""Least number of detections of a confirmed track; a track with fewer ends at its first miss."""
MEMORY, EARNED = 40, 0.25
"""Number of frames without a detection after which a track of another object ends: the upper limit, and the number for
each of its detections."""
NEIGHBOUR = 1.2
"""Distance within which the detections of two tracks merge, in sides of the target."""
WHOLE = 0.95
"""Least share of the track's level at which a detection shows the whole target."""
PARTIAL = 0.8
"""Share of the track's level below which a detection does not give the target's position: the track coasts."""
LEVEL_FALL, LEVEL_RISE = 0.02, 0.2
"""Shares of a new height that enter the level, one for a lower and one for a higher height; the first is small, as
occlusion begins slowly."""
FORBIDDEN = 1e6


@dataclass(frozen=True, slots=True)
class Rules:
    """Parameters of motion and measurement of tracks.

    acceleration    standard deviation, px/frame^2
    measurement_sd  standard deviation of the measured position of a whole target, px
    partial         standard deviation, px, times the share of the level by which a detection is too low or too high
    neighbour       distance within which tracks disturb each other, px;  gate  largest squared Mahalanobis distance
    seen            least share of the level for a detection to be the target
    """

    acceleration: float
    measurement_sd: float
    partial: float
    neighbour: float
    gate: float
    seen: float


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """n tracks, the target first: mean (n, 4) x, y px, vx, vy px/frame; covariance (n, 4, 4); level (n,) of their
    detections' heights; detections so far and misses in a row (n,); coasting (n,): predicted
    without measurement, since the target is partly hidden."""

    mean: Floats
    covariance: Floats
    level: Floats
    detections: Floats
    misses: Floats
    coasting: Floats

    @classmethod
    def of(cls, mean: Floats, covariance: Floats, level: Floats, detections: int) -> Tracks:
        count = len(mean)
        return cls(mean, covariance, level, np.full(count, float(detections)), np.zeros(count), np.zeros(count))

    def take(self, chosen: npt.NDArray[np.bool_]) -> Tracks:
        """Return the tracks selected by a mask (n,)."""
        return Tracks(*(getattr(self, name)[chosen] for name in Tracks.__slots__))

    def joined(self, others: Tracks) -> Tracks:
        """Return these tracks followed by others."""
        return Tracks(*(np.concatenate([getattr(self, n), getattr(others, n)]) for n in Tracks.__slots__))


def advance(tracks: Tracks, centers: Floats, heights: Floats, moved: tuple[float, float], rules: Rules) -> Tracks:
    """Return the tracks after a frame with detections at centres (m, 2) px of heights (m,).

    `moved`: displacement (x, y) px of the scene since the last frame.
    """
    F, Q = constant_velocity(rules.acceleration)
    mean = tracks.mean @ F.T + np.array([*moved, 0.0, 0.0])
    covariance = F @ tracks.covariance @ F.T + Q
    relative = heights[None] / tracks.level[:, None]
    near = _nearness(mean, tracks, rules)
    lacking = np.maximum(np.abs(np.clip(relative, 0.2, 2.0) - 1) - (1 - WHOLE), 0)
    noise = rules.measurement_sd**2 + (rules.partial * lacking) ** 2 + ((rules.neighbour / 2 * near) ** 2)[:, None]
    S = covariance[:, None, :2, :2] + noise[..., None, None] * np.eye(2)
    nu = centers[None] - mean[:, None, :2]
    distance = (nu * np.linalg.solve(S, nu[..., None])[..., 0]).sum(axis=-1)
    pairs = _assigned(tracks, relative, distance, np.linalg.slogdet(S)[1], rules)

    misses, coasting = tracks.misses + 1, np.zeros(len(mean))
    level, detections = tracks.level.copy(), tracks.detections.copy()
    unpaired = np.setdiff1d(np.arange(len(mean)), pairs[:, 0])
    unpaired = unpaired[tracks.detections[unpaired] >= CONFIRMED]
    for track, detection in pairs.tolist():
        misses[track] = 0
        detections[track] += 1
        if _partly_hidden(tracks, track, float(relative[track, detection])):
            coasting[track] = 1
            continue
        extra = 0.0
        if (np.hypot(*(mean[unpaired, :2] - centers[detection]).T) < rules.neighbour / NEIGHBOUR).any():
            extra = (rules.neighbour / NEIGHBOUR / 2) ** 2  # a detection merged from two objects
        gain = covariance[track, :, :2] @ np.linalg.inv(S[track, detection] + extra * np.eye(2))
        mean[track] += gain @ nu[track, detection]
        R = (noise[track, detection] + extra) * np.eye(2)
        covariance[track] = updated_covariance(covariance[track], gain, np.eye(2, 4), R)
        level[track] += _level_rate(tracks, track, float(relative[track, detection]), bool(near[track] > 0)) * (
            heights[detection] - level[track]
        )
    alive = misses <= np.where(detections < CONFIRMED, 0, np.minimum(MEMORY, EARNED * detections))
    alive[0] = True
    free = np.setdiff1d(np.arange(len(centers)), pairs[:, 1])
    if len(free):
        # No other track starts from a detection that may be of the target.
        by_target = (
            distance[0, free] <= rules.gate
            if misses[0] > 0
            else np.hypot(*(centers[free] - mean[0, :2]).T) < rules.neighbour / NEIGHBOUR / 2
        )
        free = free[~by_target]
    start = np.diag([rules.measurement_sd**2] * 2 + [START_SPEED**2] * 2)
    born = Tracks.of(
        np.concatenate([centers[free], np.zeros((len(free), 2))], axis=1),
        np.repeat(start[None], len(free), axis=0),
        heights[free],
        0,
    )
    return Tracks(mean, covariance, level, detections, misses, coasting).take(alive).joined(born)


def _nearness(mean: Floats, tracks: Tracks, rules: Rules) -> Floats:
    """Return the nearness (n,) of the nearest confirmed track: 0 beyond `neighbour`, 1 at the same position."""
    apart = np.hypot(*(mean[:, None, :2] - mean[None, :, :2]).transpose(2, 0, 1))
    apart[:, tracks.detections < CONFIRMED] = np.inf
    np.fill_diagonal(apart, np.inf)
    near: Floats = np.maximum(1 - apart.min(axis=1) / rules.neighbour, 0)
    return near


def _assigned(tracks: Tracks, relative: Floats, distance: Floats, log_det: Floats, rules: Rules) -> Floats:
    """Return the pairs (k, 2) of track and detection with the least sum of -2 ln likelihood."""
    count, detections = distance.shape
    found = np.where(tracks.misses > 0, REAPPEARANCE, DETECTION)
    height = np.log(np.maximum(relative, 1e-6))
    cost = distance + log_det + (height / LEVEL_SD) ** 2 - 2 * np.log(found)[:, None] + 2 * np.log(2 * np.pi)
    missed = -2 * np.log(1 - found) - 2 * np.log(CLUTTER)
    allowed = (distance <= rules.gate) & (cost < missed[:, None])
    strict = tracks.misses > 0
    strict[0] = True
    allowed &= (relative >= rules.seen) | ~strict[:, None]
    table = np.full((count, detections + count), FORBIDDEN)
    table[:, :detections] = np.where(allowed, cost - missed[:, None], FORBIDDEN)
    table[np.arange(count), detections + np.arange(count)] = 0
    from scipy.optimize import linear_sum_assignment  # 0.4 s to import, which only this tracker needs

    rows, columns = linear_sum_assignment(table)
    pairs: Floats = np.stack([rows, columns], axis=1)[columns < detections]
    return pairs


def _partly_hidden(tracks: Tracks, track: int, relative: float) -> bool:
    """Return whether a confirmed track without misses shows too little of its target to be measured."""
    steady = tracks.misses[track] == 0 and tracks.detections[track] >= CONFIRMED
    return relative < PARTIAL and bool(steady)


def _level_rate(tracks: Tracks, track: int, relative: float, disturbed: bool) -> float:
    if track > 0 and tracks.detections[track] < CONFIRMED:
        return 1 / (float(tracks.detections[track]) + 2)
    if relative < PARTIAL:
        return 0.0
    return LEVEL_RISE if relative > 1 and not disturbed else LEVEL_FALL
