"""`change_kalman`: Kalman filters on the foreground before a learned background, one for each moving thing."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor
from typing import ClassVar

import numpy as np

from irsim.config.quantities import Fraction
from irsim.types import Box, Frame
from irtrack.features.background import BackgroundModel, Region
from irtrack.features.foreground import GreyDensities, local_foreground, peaks
from irtrack.filters.association import Rules, Tracks, advance
from irtrack.trackers.base import Deviation, Footage, MonitoredTracker, Spread, VisibilityMonitor, footage, start_window
from irtrack.trackers.kalman import GatedKalman
from irtrack.types import Estimate

MARGIN = 1.0
"""Margin around the box for the blurred edge of the target, px."""
KERNEL = 0.25
"""Standard deviation of the kernel that averages the foreground, in sides of the box."""
LEAST_KERNEL = 0.8
"""Least standard deviation of this kernel, px, since individual pixels are noise."""
PARTIAL = 3.0
"""Standard deviation of a detection's position per hidden share of the target, in mean sides of the box: the visible
part lies up to half a side off the target's centre, for many frames."""
NEIGHBOUR = 1.2
"""Distance, in mean sides of the box, within which another object disturbs the measurement."""
GREY_RATE = 0.05
"""Share of a new grey histogram that enters the target's histogram, where the whole target is visible."""
FAINT = 0.3
"""Share of the target's level below which a peak is no detection."""
LEAST = 0.05
"""Local foreground below which a peak is no detection."""
MOST_DETECTIONS = 60
"""Largest number of detections in a frame; the highest are taken."""


@dataclass(frozen=True, slots=True, eq=False)
class ChangeState:
    """State: size (w, h) px of the box; background model; grey densities; tracks, that of the target first."""

    footage: Footage
    size: tuple[float, float]
    background: BackgroundModel
    greys: GreyDensities
    tracks: Tracks
    monitor: VisibilityMonitor


class ChangeKalman(GatedKalman, MonitoredTracker):
    """Constant-velocity Kalman filters on the foreground before a learned background, one for each moving thing.

    A variant of `kalman`, the baseline of J. Cheng et al. 2006, for occluded targets among clutter and similar targets;
    made here, in no paper. Measurement: a background model is learned and registered to each frame
    (`irtrack.features.background`), which removes clutter at rest; a pixel is foreground if it differs from the model
    and has the target's grey levels, by Cheng's histogram. Association: other moving objects have filters of their own,
    and each detection is assigned to one filter (`irtrack.filters.association`). Occlusion: the visible part of a
    partly hidden target lies off its centre, so its track coasts until the target is whole again.

    It needs a background of constant form, a camera that does not roll or zoom, and a target that moves against the
    background: grey levels alone distinguish a target at rest.
    """

    source: ClassVar[str] = "after Cheng, Zhou, Cai, Yang 2006 (baseline); Wren et al. 1997; Blackman, Popoli 1999"

    acceleration: Deviation = 0.15
    """Standard deviation of the acceleration on each axis, px/frame^2."""
    measurement_sd: Deviation = 0.7
    """Standard deviation of the measured place on each axis, px."""
    start_speed_sd: Spread = 2.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    learn: Fraction = 0.1
    """Share of a new frame that enters the background model, where the background is visible."""
    register_frames: bool = True
    """True: frames are registered to the background by shift, gain and offset."""
    company: bool = True
    """True: other moving objects are tracked, too. False: every detection may be the target."""
    seen: Fraction = 0.5
    """Least foreground of a visible target, as a share of its usual foreground."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> ChangeState:
        """Return the initial state: a background model of the frame without the box, and grey densities in the box."""
        start_window(frame, box)
        image = frame.image
        region = _region((box.cx, box.cy), (box.w, box.h), image.shape)
        background = BackgroundModel.initial(image, region)
        y, x = np.ogrid[: image.shape[0], : image.shape[1]]
        ellipse = 1 - ((x - box.cx) / (box.w / 2 + 0.5)) ** 2 - ((y - box.cy) / (box.h / 2 + 0.5)) ** 2
        greys = GreyDensities.of(image, region, np.maximum(ellipse, 0))
        _, registered = background.register(image, False)
        heights = local_foreground(greys.foreground(registered), _kernel((box.w, box.h)))
        column, row = (round(min(max(c, 0), n - 1)) for c, n in zip((box.cx, box.cy), image.shape[::-1], strict=True))
        around = heights[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        mean, covariance = self.start(box)
        tracks = Tracks.of(mean[None], covariance[None], np.array([max(float(around.max()), LEAST)]), 10)
        return ChangeState(footage(frame), (box.w, box.h), background, greys, tracks, VisibilityMonitor())

    def step(self, state: ChangeState, frame: Frame, rng: np.random.Generator) -> tuple[ChangeState, Estimate]:
        """Register the background, find detections, assign them, learn the background."""
        state.footage.check(frame)
        background, registered = state.background.register(frame.image, self.register_frames)
        foreground = state.greys.foreground(registered)
        deviations = _kernel(state.size)
        reach = tuple(max(1, int(1.2 * d)) for d in deviations)
        least = max(FAINT * float(state.tracks.level[0]), LEAST)
        centers, heights = peaks(local_foreground(foreground, deviations), (reach[0], reach[1]), least, MOST_DETECTIONS)
        tracks = advance(state.tracks, centers, heights, registered.moved, self._rules(state.size))
        if not self.company:
            tracks = tracks.take(np.arange(len(tracks.mean)) == 0)
        x, y, vx, vy = tracks.mean[0].tolist()
        monitor = state.monitor.miss() if tracks.misses[0] > 0 else state.monitor.hit()
        region = _region((x, y), state.size, frame.image.shape)
        whole = tracks.misses[0] == 0 and tracks.coasting[0] == 0
        greys = state.greys.updated(registered, foreground, region, GREY_RATE) if whole else state.greys
        waiting = monitor.misses < self.lost_after
        after = ChangeState(
            footage=state.footage,
            size=state.size,
            background=background.updated(registered, foreground, self.learn, region if waiting else None),
            greys=greys,
            tracks=tracks,
            monitor=monitor,
        )
        return after, Estimate(
            center=(x, y),
            size=state.size,
            status=monitor.status(self.lost_after),
            velocity=(vx, vy),
            covariance=tracks.covariance[0, :2, :2],
        )

    def _rules(self, size: tuple[float, float]) -> Rules:
        side = (size[0] * size[1]) ** 0.5
        return Rules(self.acceleration, self.measurement_sd, PARTIAL * side, NEIGHBOUR * side, self.gate, self.seen)


def _kernel(size: tuple[float, float]) -> tuple[float, float]:
    return max(KERNEL * size[0], LEAST_KERNEL), max(KERNEL * size[1], LEAST_KERNEL)


def _region(center: tuple[float, float], size: tuple[float, float], shape: tuple[int, ...]) -> Region:
    """Return rows and columns of the target and its margin; empty where it is outside the frame."""

    def span(at: float, side: float, length: int) -> slice:
        low, high = floor(at - side / 2 - MARGIN), ceil(at + side / 2 + MARGIN) + 1
        return slice(min(max(low, 0), length), min(max(high, 0), length))

    return span(center[1], size[1], shape[0]), span(center[0], size[0], shape[1])
