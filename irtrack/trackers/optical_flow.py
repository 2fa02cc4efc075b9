"""`optical_flow`: median motion of points in the target's box, by pyramidal Lucas-Kanade."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.features.correlation import Patch
from irtrack.features.optical_flow import Picture, forward_backward, scale_change
from irtrack.features.quantiser import Quantiser, fitted_range
from irtrack.trackers.base import Footage, MonitoredTracker, Ratio, VisibilityMonitor, footage, start_window
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class OpticalFlowState:
    """State: the first patch and the best distractor's score near it; the last frame in 256 levels; center (2,) px,
    scale of the start size, velocity (2,) px/frame."""

    footage: Footage
    size: tuple[float, float]
    patch: Patch
    levels: Quantiser
    picture: Picture
    center: Floats
    scale: float
    velocity: Floats
    monitor: VisibilityMonitor


class OpticalFlow(MonitoredTracker):
    """Median motion of those points of a grid in the target's box whose backward flow returns to their start.

    The optical flow of J. Cheng et al. 2006, section 3, a baseline that they only name. Chosen here: pyramidal
    Lucas-Kanade (Bouguet 2001), a grid of points, their forward-backward error and the medians of place and scale as in
    Z. Kalal, K. Mikolajczyk, J. Matas, "Forward-Backward Error: Automatic Detection of Tracking Failures", ICPR 2010
    ("median flow"). Points are set anew in each frame. The status is that of a visible target where enough
    points return and the patch at the estimate matches the first patch (normalised cross-correlation). The box moves by
    the flow of the points that return, or, with `check`, only where the patch matches too; else it keeps its last
    velocity, and flow starts from there. A target that deforms fails the check. Pictures are quantised to 256 levels of
    the first frame's range.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Bouguet 2001; Kalal, Mikolajczyk, Matas 2010"

    points: int = Field(default=10, ge=2, le=100)
    """Number of points on each side of the grid (Kalal et al. 2010, section 3: 10)."""
    error: Ratio = 1.0
    """Largest forward-backward error of a point that is used, px; its error must not exceed the median error either
    (section 3)."""
    lk_window: int = Field(default=9, ge=3, le=101)
    """Side of the window about a point, px."""
    lk_levels: int = Field(default=2, ge=0, le=10)
    """Pyramid levels above the picture."""
    agree: Fraction = 0.3
    """Share of the points that must return within `error`."""
    check: bool = False
    """True: the box moves by the flow only where the patch there matches the first patch."""
    scale: bool = False
    """True: the box is scaled by the ratio of the points' distances."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> OpticalFlowState:
        """Return the initial state at the box's centre, with velocity 0."""
        window, corner = start_window(frame, box)
        levels = fitted_range(frame.image, window.cut(frame.image, corner), 256)
        return OpticalFlowState(
            footage=footage(frame),
            size=(box.w, box.h),
            patch=Patch.of(frame.image, window, corner, (window.columns, window.rows)),
            levels=levels,
            picture=levels(frame.image).astype(np.uint8),
            center=np.array([box.cx, box.cy]),
            scale=1.0,
            velocity=np.zeros(2),
            monitor=VisibilityMonitor(),
        )

    def step(
        self, state: OpticalFlowState, frame: Frame, rng: np.random.Generator
    ) -> tuple[OpticalFlowState, Estimate]:
        """Follow the points forward and back, and move by the median."""
        state.footage.check(frame)
        picture = state.levels(frame.image).astype(np.uint8)
        center, velocity, scale = state.center + state.velocity, state.velocity, state.scale
        monitor, score, covariance = state.monitor.miss(), 0.0, None
        before = self._grid(state)
        after, errors = forward_backward(state.picture, picture, before, self.lk_window, self.lk_levels)
        good = errors <= min(self.error, float(np.median(errors)))
        if good.any() and np.mean(errors <= self.error) >= self.agree:
            moves = after[good] - before[good]
            step = np.median(moves, axis=0)
            x, y = (state.center + step).tolist()
            _, score = state.patch.search(frame.image, (x, y), 1)
            monitor = state.monitor.after(score, state.patch.distractor, self.seen)
            if monitor.misses == 0 or not self.check:
                center, velocity = state.center + step, step
                covariance = np.atleast_2d(np.cov(moves.T)) / len(moves) if len(moves) > 2 else None
                if self.scale:
                    scale = float(np.clip(scale * scale_change(before[good], after[good]), 0.25, 4.0))
        x, y = center.tolist()
        after_state = replace(state, picture=picture, center=center, scale=scale, velocity=velocity, monitor=monitor)
        return after_state, Estimate(
            center=(x, y),
            size=(scale * state.size[0], scale * state.size[1]),
            status=monitor.status(self.lost_after),
            score=score,
            velocity=(float(velocity[0]), float(velocity[1])),
            covariance=covariance,
        )

    def _grid(self, state: OpticalFlowState) -> Floats:
        """Return positions (points^2, 2) px on an even grid over the box."""
        along = (np.arange(self.points) + 0.5) / self.points - 0.5
        x, y = np.meshgrid(along * state.scale * state.size[0], along * state.scale * state.size[1])
        return state.center + np.stack([x.ravel(), y.ravel()], axis=1)
