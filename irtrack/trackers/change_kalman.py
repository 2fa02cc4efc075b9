"""`change_kalman`: a Kalman filter on what differs from the scene's own picture, which knows the target's company."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor
from typing import ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Frame
from irtrack.features.background import Backdrop, Hole
from irtrack.features.foreground import Greys, gathered, peaks
from irtrack.filters.association import Rules, Tracks, advance
from irtrack.trackers.base import Deviation, Footage, Sight, Spread, footage, start_window
from irtrack.trackers.gated import GatedPart
from irtrack.types import Estimate

MARGIN = 1.0
"""px around the box within which the target's light falls, too."""
KERNEL = 0.25
"""Deviations of the kernel that gathers the foreground, in sides of the box: it holds most of the target."""
LEAST_KERNEL = 0.8
"""px. No kernel is narrower: single pixels are noise."""
PARTIAL = 3.0
"""Mean sides of the box that a plot may be off for each share of the target that is hidden: what is left of
it lies half a side off for one, and stays there for many frames."""
BESIDE = 1.2
"""Mean sides of the box within which another thing disturbs the measurement."""
GREY_RATE = 0.05
"""Share of a new grey histogram, where the target is seen whole."""
FAINT = 0.3
"""Share of the target's level under which a plot is not looked at."""
LEAST = 0.05
"""Foreground under which nothing is a plot."""
MOST_PLOTS = 60
"""The highest count."""


@dataclass(frozen=True, slots=True, eq=False)
class ChangeState:
    """size (w, h) px of the box; the backdrop, the greys, and the tracks, of which the target's is the first."""

    footage: Footage
    size: tuple[float, float]
    backdrop: Backdrop
    greys: Greys
    tracks: Tracks
    sight: Sight


class ChangeKalman(GatedPart):
    """Constant-velocity Kalman filters on what differs from the learned background, one for each thing that moves.

    A variant of `kalman`, the baseline of J. Cheng et al. 2006, of no paper's making, for targets among
    clutter and their like, hidden for a while. It adds three things to it. The measurement: the scene's own
    picture is learned behind the target and registered under each frame (`irtrack.features.background`), so
    that clutter that keeps its place drops out, however bright; a pixel is the target's as far as it differs
    from that picture and has the target's greys, whose histogram is Cheng's. The company: other things
    that move have filters of their own, and plots are shared out among all of them
    (`irtrack.filters.association`). Hiding: what is seen of a target that is hidden in part lies off its centre,
    so its way goes on unmeasured until it is back.

    It needs a background that keeps its form, under a camera that may pan and shake but not roll or zoom, and
    a target that moves against it: one that never leaves its first place is told from its surroundings by its
    greys alone.
    """

    source: ClassVar[str] = "after Cheng, Zhou, Cai, Yang 2006 (baseline); Wren et al. 1997; Blackman, Popoli 1999"

    acceleration: Deviation = 0.15
    """Standard deviation of the acceleration on each axis, px/frame^2."""
    measurement_sd: Deviation = 0.7
    """Standard deviation of the measured place on each axis, px."""
    start_speed_sd: Spread = 2.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    learn: Fraction = 0.1
    """Share of a new frame that enters the background, where it is seen."""
    register_frames: bool = True
    """Whether frames are laid on the background by shift, gain and offset; else they are taken as they lie."""
    company: bool = True
    """Whether what else moves is tracked, too; else every plot may be the target."""
    seen: Fraction = 0.5
    """Share of the target's usual foreground that counts as seen."""
    lost_after: int = Field(default=10, ge=1, le=1_000_000)
    """Frames in a row without sight after which the status is lost."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> ChangeState:
        """The first frame is the background, but for the box; the box's greys are the target's."""
        start_window(frame, box)
        image = frame.image
        hole = _hole((box.cx, box.cy), (box.w, box.h), image.shape)
        backdrop = Backdrop.begin(image, hole)
        y, x = np.ogrid[: image.shape[0], : image.shape[1]]
        ellipse = 1 - ((x - box.cx) / (box.w / 2 + 0.5)) ** 2 - ((y - box.cy) / (box.h / 2 + 0.5)) ** 2
        greys = Greys.of(image, hole, np.maximum(ellipse, 0))
        _, laid = backdrop.lay(image, False)
        heights = gathered(greys.foreground(laid), _kernel((box.w, box.h)))
        column, row = (round(min(max(c, 0), n - 1)) for c, n in zip((box.cx, box.cy), image.shape[::-1], strict=True))
        around = heights[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        mean, covariance = self.start(box)
        tracks = Tracks.of(mean[None], covariance[None], np.array([max(float(around.max()), LEAST)]), 10)
        return ChangeState(footage(frame), (box.w, box.h), backdrop, greys, tracks, Sight())

    def step(self, state: ChangeState, frame: Frame, rng: np.random.Generator) -> tuple[ChangeState, Estimate]:
        """Lay the background, find plots, share them out, learn what is behind."""
        state.footage.check(frame)
        backdrop, laid = state.backdrop.lay(frame.image, self.register_frames)
        foreground = state.greys.foreground(laid)
        deviations = _kernel(state.size)
        reach = tuple(max(1, int(1.2 * d)) for d in deviations)
        least = max(FAINT * float(state.tracks.level[0]), LEAST)
        centers, heights = peaks(gathered(foreground, deviations), (reach[0], reach[1]), least, MOST_PLOTS)
        tracks = advance(state.tracks, centers, heights, laid.moved, self._rules(state.size))
        if not self.company:
            tracks = tracks.take(np.arange(len(tracks.mean)) == 0)
        x, y, vx, vy = tracks.mean[0].tolist()
        sight = state.sight.unseen() if tracks.missed[0] > 0 else state.sight.seen()
        hole = _hole((x, y), state.size, frame.image.shape)
        whole = tracks.missed[0] == 0 and tracks.held[0] == 0
        greys = state.greys.learned(laid, foreground, hole, GREY_RATE) if whole else state.greys
        waiting = sight.missed < self.lost_after
        after = ChangeState(
            footage=state.footage,
            size=state.size,
            backdrop=backdrop.learn(laid, foreground, self.learn, hole if waiting else None),
            greys=greys,
            tracks=tracks,
            sight=sight,
        )
        return after, Estimate(
            center=(x, y),
            size=state.size,
            status=sight.status(self.lost_after),
            velocity=(vx, vy),
            covariance=tracks.covariance[0, :2, :2],
        )

    def _rules(self, size: tuple[float, float]) -> Rules:
        side = (size[0] * size[1]) ** 0.5
        return Rules(self.acceleration, self.measurement_sd, PARTIAL * side, BESIDE * side, self.gate, self.seen)


def _kernel(size: tuple[float, float]) -> tuple[float, float]:
    return max(KERNEL * size[0], LEAST_KERNEL), max(KERNEL * size[1], LEAST_KERNEL)


def _hole(center: tuple[float, float], size: tuple[float, float], shape: tuple[int, ...]) -> Hole:
    """Rows and columns that the target takes, and a margin; none where it is outside."""

    def span(at: float, side: float, length: int) -> slice:
        low, high = floor(at - side / 2 - MARGIN), ceil(at + side / 2 + MARGIN) + 1
        return slice(min(max(low, 0), length), min(max(high, 0), length))

    return span(center[1], size[1], shape[0]), span(center[0], size[0], shape[1])
