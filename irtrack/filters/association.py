"""Several Kalman filters at once, each plot given to one of them: global nearest neighbours.

Plots are places at which something was found. All filters and plots are paired so that the sum of the
costs is least (S. Blackman, R. Popoli, "Design and Analysis of Modern Tracking Systems", 1999, sections
6.4 and 7.2; the assignment by scipy). The first track is the target; the others are there so that what
is theirs is not taken for the target.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack.filters.kalman import covariance_after
from irtrack.filters.motion import constant_velocity

DETECTION = 0.9
"""Probability that a plot comes of what was seen in the last frame, and (`REAPPEARANCE`) of what was not."""
REAPPEARANCE = 0.5
NEW = 1e-6
"""Plots per px^2 and frame that are of nothing that is tracked: one in thirteen frames of 320 x 240 px."""
LEVEL_SD = 0.4
"""Deviation of a plot's logarithmic height from the track's level."""
START_SPEED = 1.0
"""px/frame. Deviation of an unknown track's first speed on each axis."""
CONFIRMED = 5
"""Sightings from which on a track counts as something that is there; before, the first miss ends it."""
MEMORY, EARNED = 40, 0.25
"""Frames that a track of the company outlives without sight, at most; and for each in which it was seen."""
BESIDE = 1.2
"""Sides of the target within which two tracks draw each other's plots together."""
WHOLE = 0.95
"""Share of its level from which on a plot shows all of the target."""
PARTIAL = 0.8
"""Share under which what is left to be seen does not say where the whole is: its way goes on unmeasured."""
LEVEL_FALL, LEVEL_RISE = 0.02, 0.2
"""Shares of a new height that enter the level: slow downwards, since hiding sets in slowly too."""
FORBIDDEN = 1e6


@dataclass(frozen=True, slots=True)
class Rules:
    """How things move and are measured.

    acceleration    deviation, px/frame^2
    measurement_sd  deviation of a whole target's place, px
    partial         px of deviation for each share of its level that a plot lacks or has too much
    beside          px within which tracks disturb each other;  gate: squared Mahalanobis distance
    seen            least share of its level for a plot to be the target
    """

    acceleration: float
    measurement_sd: float
    partial: float
    beside: float
    gate: float
    seen: float


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """(n,) tracks, the target first: mean (n, 4) x, y px, vx, vy px/frame; covariance (n, 4, 4); level (n,) of
    their plots' heights; sightings and frames missed in a row (n,); held (n,): unmeasured, being partly hidden."""

    mean: Floats
    covariance: Floats
    level: Floats
    sightings: Floats
    missed: Floats
    held: Floats

    @classmethod
    def of(cls, mean: Floats, covariance: Floats, level: Floats, sightings: int) -> Tracks:
        count = len(mean)
        return cls(mean, covariance, level, np.full(count, float(sightings)), np.zeros(count), np.zeros(count))

    def take(self, chosen: npt.NDArray[np.bool_]) -> Tracks:
        """Those of a mask (n,)."""
        return Tracks(*(getattr(self, name)[chosen] for name in Tracks.__slots__))

    def with_(self, others: Tracks) -> Tracks:
        """These, and then others."""
        return Tracks(*(np.concatenate([getattr(self, n), getattr(others, n)]) for n in Tracks.__slots__))


def advance(tracks: Tracks, centers: Floats, heights: Floats, moved: tuple[float, float], rules: Rules) -> Tracks:
    """The tracks a frame on, with the plots of that frame: centres (m, 2) px, heights (m,); moved: px, of the scene."""
    F, Q = constant_velocity(rules.acceleration)
    mean = tracks.mean @ F.T + np.array([*moved, 0.0, 0.0])
    covariance = F @ tracks.covariance @ F.T + Q
    relative = heights[None] / tracks.level[:, None]
    near = _nearness(mean, tracks, rules)
    lacking = np.maximum(np.abs(np.clip(relative, 0.2, 2.0) - 1) - (1 - WHOLE), 0)
    noise = rules.measurement_sd**2 + (rules.partial * lacking) ** 2 + ((rules.beside / 2 * near) ** 2)[:, None]
    S = covariance[:, None, :2, :2] + noise[..., None, None] * np.eye(2)
    nu = centers[None] - mean[:, None, :2]
    distance = (nu * np.linalg.solve(S, nu[..., None])[..., 0]).sum(axis=-1)
    pairs = _paired(tracks, relative, distance, np.linalg.slogdet(S)[1], rules)

    missed, held = tracks.missed + 1, np.zeros(len(mean))
    level, sightings = tracks.level.copy(), tracks.sightings.copy()
    unpaired = np.setdiff1d(np.arange(len(mean)), pairs[:, 0])
    unpaired = unpaired[tracks.sightings[unpaired] >= CONFIRMED]
    for track, plot in pairs.tolist():
        missed[track] = 0
        sightings[track] += 1
        if _partly_hidden(tracks, track, float(relative[track, plot])):
            held[track] = 1
            continue
        extra = 0.0
        if (np.hypot(*(mean[unpaired, :2] - centers[plot]).T) < rules.beside / BESIDE).any():
            extra = (rules.beside / BESIDE / 2) ** 2  # two things in one plot: it says little of either
        gain = covariance[track, :, :2] @ np.linalg.inv(S[track, plot] + extra * np.eye(2))
        mean[track] += gain @ nu[track, plot]
        R = (noise[track, plot] + extra) * np.eye(2)
        covariance[track] = covariance_after(covariance[track], gain, np.eye(2, 4), R)
        level[track] += _level_rate(tracks, track, float(relative[track, plot]), bool(near[track] > 0)) * (
            heights[plot] - level[track]
        )
    lasting = missed <= np.where(sightings < CONFIRMED, 0, np.minimum(MEMORY, EARNED * sightings))
    lasting[0] = True
    free = np.setdiff1d(np.arange(len(centers)), pairs[:, 1])
    if len(free):
        # What comes up where the target may be is not given away while it is looked for.
        by_target = (
            distance[0, free] <= rules.gate
            if missed[0] > 0
            else np.hypot(*(centers[free] - mean[0, :2]).T) < rules.beside / BESIDE / 2
        )
        free = free[~by_target]
    start = np.diag([rules.measurement_sd**2] * 2 + [START_SPEED**2] * 2)
    born = Tracks.of(
        np.concatenate([centers[free], np.zeros((len(free), 2))], axis=1),
        np.repeat(start[None], len(free), axis=0),
        heights[free],
        0,
    )
    return Tracks(mean, covariance, level, sightings, missed, held).take(lasting).with_(born)


def _nearness(mean: Floats, tracks: Tracks, rules: Rules) -> Floats:
    """(n,) from 0, where nothing confirmed is within `beside`, to 1, where it is at the same place."""
    apart = np.hypot(*(mean[:, None, :2] - mean[None, :, :2]).transpose(2, 0, 1))
    apart[:, tracks.sightings < CONFIRMED] = np.inf
    np.fill_diagonal(apart, np.inf)
    near: Floats = np.maximum(1 - apart.min(axis=1) / rules.beside, 0)
    return near


def _paired(tracks: Tracks, relative: Floats, distance: Floats, spread: Floats, rules: Rules) -> Floats:
    """(k, 2) tracks and the plots that are theirs: the least sum of -2 ln of the likelihoods."""
    count, plots = distance.shape
    found = np.where(tracks.missed > 0, REAPPEARANCE, DETECTION)
    height = np.log(np.maximum(relative, 1e-6))
    cost = distance + spread + (height / LEVEL_SD) ** 2 - 2 * np.log(found)[:, None] + 2 * np.log(2 * np.pi)
    unfound = -2 * np.log(1 - found) - 2 * np.log(NEW)
    allowed = (distance <= rules.gate) & (cost < unfound[:, None])
    wanting = tracks.missed > 0
    wanting[0] = True
    allowed &= (relative >= rules.seen) | ~wanting[:, None]
    table = np.full((count, plots + count), FORBIDDEN)
    table[:, :plots] = np.where(allowed, cost - unfound[:, None], FORBIDDEN)
    table[np.arange(count), plots + np.arange(count)] = 0
    from scipy.optimize import linear_sum_assignment  # 0.4 s to import, which only this tracker needs

    rows, columns = linear_sum_assignment(table)
    pairs: Floats = np.stack([rows, columns], axis=1)[columns < plots]
    return pairs


def _partly_hidden(tracks: Tracks, track: int, relative: float) -> bool:
    """Whether something that was whole, or held so far, shows too little of itself to be measured."""
    steady = tracks.missed[track] == 0 and tracks.sightings[track] >= CONFIRMED
    return relative < PARTIAL and bool(steady)


def _level_rate(tracks: Tracks, track: int, relative: float, disturbed: bool) -> float:
    if track > 0 and tracks.sightings[track] < CONFIRMED:
        return 1 / (float(tracks.sightings[track]) + 2)
    if relative < PARTIAL:
        return 0.0
    return LEVEL_RISE if relative > 1 and not disturbed else LEVEL_FALL
