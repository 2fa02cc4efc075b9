"""`optical_flow`: the median of what points in the target's box do, by pyramidal Lucas-Kanade."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.correlation import ncc, rival
from irtrack.features.optical_flow import Picture, forward_backward, spread_ratio
from irtrack.features.quantise import Quantiser, quantiser
from irtrack.features.window import Window, region
from irtrack.trackers.base import Footage, Ratio, Sight, TrackerPart, footage, start_window
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class OpticalFlowState:
    """picture: the last frame in 256 levels; center (2,) px; scale of the start size; velocity (2,) px/frame.

    template, floor: the first patch, and the best false match's score near it.
    """

    footage: Footage
    size: tuple[float, float]
    window: Window
    levels: Quantiser
    template: Floats
    floor: float
    picture: Picture
    center: Floats
    scale: float
    velocity: Floats
    sight: Sight


class OpticalFlow(TrackerPart):
    """Median motion of a grid of points in the target's box, of those that find their way back.

    The optical flow of J. Cheng et al. 2006, section 3, a baseline of which they give only the name.
    Here: pyramidal Lucas-Kanade (Bouguet 2001), a grid of points, their forward-backward error and the
    medians of place and scale as in Z. Kalal, K. Mikolajczyk, J. Matas, "Forward-Backward Error:
    Automatic Detection of Tracking Failures", ICPR 2010 ("median flow"). Points are set anew in each
    frame, so that none is kept that has slid off. The flow of noise has a median too: the target
    counts as seen where enough points return and the place matches the first patch (normalised
    cross-correlation). Unseen, the box goes on with its last velocity, and flow is sought from there.
    Pictures are brought to 256 levels by the first frame's range, which is kept.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Bouguet 2001; Kalal, Mikolajczyk, Matas 2010"

    points: int = Field(default=10, ge=2, le=100)
    """Points on each side of the grid (Kalal et al. 2010, section 3: 10)."""
    error: Ratio = 1.0
    """Largest forward-backward error of a point that counts, px; and no more than the median one (section 3)."""
    lk_window: int = Field(default=9, ge=3, le=101)
    """Side of the window about a point whose motion is found, px."""
    lk_levels: int = Field(default=2, ge=0, le=10)
    """Pyramid levels above the picture."""
    agree: Fraction = 0.3
    """Share of the points that must return within `error`."""
    scale: bool = False
    """Whether the box grows and shrinks with the points' distances."""
    seen: Annotated[float, Field(ge=0, le=1)] = 0.5
    """Share of the way from the best false match's score to the target's usual one that counts as seen."""
    lost_after: int = Field(default=10, ge=1, le=1_000_000)
    """Frames in a row without sight after which the status is lost."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> OpticalFlowState:
        """At the box's centre, at rest."""
        window, corner = start_window(frame, box)
        patch = window.cut(frame.image, corner)
        template = patch.astype(np.float64)
        left, top, around = region(frame.image, window, corner, (window.columns, window.rows))
        levels = quantiser(frame, patch, 256, "first_frame")
        return OpticalFlowState(
            footage=footage(frame),
            size=(box.w, box.h),
            window=window,
            levels=levels,
            template=template,
            floor=rival(ncc(around, template), (corner[0] - left, corner[1] - top), window),
            picture=levels(frame.image).astype(np.uint8),
            center=np.array([box.cx, box.cy]),
            scale=1.0,
            velocity=np.zeros(2),
            sight=Sight(),
        )

    def step(
        self, state: OpticalFlowState, frame: Frame, rng: np.random.Generator
    ) -> tuple[OpticalFlowState, Estimate]:
        """Follow the points forth and back, move by the median."""
        state.footage.check(frame)
        picture = state.levels(frame.image).astype(np.uint8)
        center, velocity, scale = state.center + state.velocity, state.velocity, state.scale
        sight, score, covariance = state.sight.unseen(), 0.0, None
        before = self._grid(state)
        after, errors = forward_backward(state.picture, picture, before, self.lk_window, self.lk_levels)
        good = errors <= min(self.error, float(np.median(errors)))
        if good.any() and np.mean(errors <= self.error) >= self.agree:
            moves = after[good] - before[good]
            step = np.median(moves, axis=0)
            score = self._match(state, frame.image, state.center + step)
            sight = state.sight.after(score, state.floor, self.seen)
            if sight.missed == 0:
                center, velocity = state.center + step, step
                covariance = np.atleast_2d(np.cov(moves.T)) / len(moves) if len(moves) > 2 else None
                if self.scale:
                    scale = float(np.clip(scale * spread_ratio(before[good], after[good]), 0.25, 4.0))
        x, y = center.tolist()
        after_state = replace(state, picture=picture, center=center, scale=scale, velocity=velocity, sight=sight)
        return after_state, Estimate(
            center=(x, y),
            size=(scale * state.size[0], scale * state.size[1]),
            status=sight.status(self.lost_after),
            score=score,
            velocity=(float(velocity[0]), float(velocity[1])),
            covariance=covariance,
        )

    def _grid(self, state: OpticalFlowState) -> Floats:
        """(points^2, 2) places spread evenly over the box."""
        along = (np.arange(self.points) + 0.5) / self.points - 0.5
        x, y = np.meshgrid(along * state.scale * state.size[0], along * state.scale * state.size[1])
        return state.center + np.stack([x.ravel(), y.ravel()], axis=1)

    def _match(self, state: OpticalFlowState, image: Image, center: Floats) -> float:
        """Best correlation with the first patch within a pixel of a place, as far as it lies in the frame."""
        corner = state.window.corner((float(center[0]), float(center[1])))
        _, _, pixels = region(image, state.window, corner, 1)
        return float(ncc(pixels, state.template).max())
