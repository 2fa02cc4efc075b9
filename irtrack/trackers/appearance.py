"""Appearance of a target by its grey histogram, and the mixins of trackers that use it.

The first frame determines the image of which histograms are taken (the frame or its high-pass), the window, its kernel,
and the grey range of the bins.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, hypot
from typing import Annotated, Literal

from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.frequency import FrequencyHighPass
from irtrack.features.highpass import HighPass, full_kernel, ring_kernel
from irtrack.features.histogram import (
    LocalBackground,
    MatchScore,
    Picture,
    epanechnikov_kernel,
    gaussian_kernel,
    histogram,
    similarity,
)
from irtrack.features.lbp import TexturePicture
from irtrack.features.mean_shift import Bandwidth, Modes, bandwidth, mean_shift
from irtrack.features.quantiser import BinsRange, Quantiser, first_quantiser, full_range
from irtrack.features.window import Window
from irtrack.filters.motion import Propagation
from irtrack.filters.particle import Likelihood
from irtrack.filters.resampling import Resampling
from irtrack.trackers.base import Deviation, Footage, MonitoredTracker, Ratio, VisibilityMonitor, footage, start_window
from irtrack.types import Status

PictureFilter = HighPass | FrequencyHighPass
LEAST_L = 5
"""Least radius L of the high-pass ring, px: for targets of up to 6 px it is well beyond the target, at little cost."""


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """Settings taken from the first frame: frame size and type; size, window, kernel (rows, columns), grey range of the
    target."""

    footage: Footage
    size: tuple[float, float]
    window: Window
    kernel: Floats
    background: LocalBackground
    quantiser: Quantiser
    high_pass: PictureFilter | TexturePicture | None

    def picture(self, frame: Frame) -> Image:
        """Return the image of which histograms are taken; InputError where the frame is of another size or type."""
        self.footage.check(frame)
        return frame.image if self.high_pass is None else self.high_pass(frame.image)

    def view(self, frame: Frame) -> Picture:
        """Return the same image as `picture`, but computed part by part on demand."""
        self.footage.check(frame)
        return frame.image if self.high_pass is None else self.high_pass.view(frame.image)

    def bandwidth(self, scale: float) -> Bandwidth:
        """Return the bandwidth of a mean-shift window, px: half the sides of the target times a scale."""
        return bandwidth(Box(0, 0, *self.size), scale)

    def likelihood(self, picture: Picture, centers: Floats, reference: Floats, scale: float) -> Likelihood:
        """Return the likelihood exp(-scale D^2), D^2 = 1 - rho, of the windows at centres (N, 2) px.

        The scale is lambda / 2 in Cheng et al. 2006, eq. 10, and 1 / (2 sigma^2) in Xue et al. 2011, eq. 5.
        """
        rho, visible = similarity(picture, centers, self.window, self.kernel, self.quantiser, reference)
        return Likelihood(rho, scale, visible)

    def match(self, picture: Picture, center: Floats, reference: Floats) -> MatchScore:
        """Return the match of the window at `center` (2,) px; parts beyond the frame lower it, as in `likelihood`."""
        x, y = center.tolist()
        return self.background.score(picture, (x, y), reference)


class GreyTracker(MonitoredTracker):
    """Tracker that knows its target by a grey histogram."""

    bins: int = Field(default=32, ge=2, le=256)
    """Grey levels of the histogram (Cheng et al. 2006: 32 or 16; Xue et al. 2011, Wei et al. 2008: 32)."""
    bins_range: BinsRange = "first_frame"
    """Grey range of the bins: that of the first frame for all frames, or the full range of the bit depth."""
    kernel: Literal["gaussian", "epanechnikov"] = "gaussian"
    """k of the histogram: exp(-r^2 / 2), h = sqrt(hx^2 + hy^2) (Cheng et al. 2006, eq. 6), or max(0, 1 - r^2)
    with half the sizes on each axis (Xue et al. 2011, eq. 2)."""
    kernel_scale: Annotated[float, Field(ge=0.01, le=100)] = 0.1
    """gaussian: factor of h; 1: hx, hy are the full sides of the target, 0.5: half the sides. At 0.5 the box's corners
    count .61 of its middle, and the likelihood is flat. Found by search on development seeds."""
    high_pass: Literal["none", "ring", "full", "butterworth"] = "none"
    """Image of the histograms: the frame, or, with bins over the full range, its difference from a background predicted
    from a ring neighbourhood (Xue et al. 2011, eq. 1) or from a full one (Peng, Zhou 1999), or its high frequencies
    (their reference 13)."""
    ring_l: int | None = Field(default=None, ge=1, le=100)
    """L of eq. 1, the largest radius, px; by default three quarters of the box's longer side, at least 5."""
    ring_m: int = Field(default=8, ge=3, le=64)
    """m of eq. 1, number of samples on each radius."""
    ring_inner: int = Field(default=0, ge=0, le=100)
    """Least radius, px, at most L; 0 as in eq. 1. A radius above half the target's size keeps the target out of its own
    background."""
    grid: int = Field(default=1, ge=1, le=16)
    """Step of the grid on which the background is predicted (section 1.1, Fig. 2); here it saves no time."""
    ring: Annotated[float, Field(ge=0.1, le=10)] = 0.5
    """Width of the local background around the target, in sides of the window; at 0.5 it has three times the
    window's area."""

    def appearance(self, frame: Frame, box: Box) -> tuple[Appearance, Floats]:
        """Return the target's appearance in its first frame, and its histogram (bins,) there.

        InputError where the box does not meet the frame, or is no valid box.
        """
        part, corner = start_window(frame, box)
        window = Window.of(box)
        high_pass = self._high_pass(frame.image, box)
        if high_pass is None:
            levels = first_quantiser(frame, part.cut(frame.image, corner), self.bins, self.bins_range)
        else:
            levels = full_range(8, self.bins)
        if self.kernel == "gaussian":
            kernel = gaussian_kernel(window, self.kernel_scale * hypot(box.w, box.h))
        else:
            kernel = epanechnikov_kernel(window)
        margin = (ceil(self.ring * window.columns), ceil(self.ring * window.rows))
        appearance = Appearance(
            footage=footage(frame),
            size=(box.w, box.h),
            window=window,
            kernel=kernel,
            background=LocalBackground.of(window, kernel, margin, levels),
            quantiser=levels,
            high_pass=high_pass,
        )
        return appearance, histogram(appearance.picture(frame), (box.cx, box.cy), window, kernel, levels)[0]

    def monitor_after(self, monitor: VisibilityMonitor, match: MatchScore, in_view: bool = True) -> VisibilityMonitor:
        """Return the monitor after a match, or after a miss where no window is inside the frame."""
        return monitor.after(match.score, match.background_score, self.seen) if in_view else monitor.miss()

    def status(self, monitor: VisibilityMonitor, in_view: bool) -> Status:
        """Return the status of the monitor; `lost` where no window is inside the frame."""
        return monitor.status(self.lost_after) if in_view else "lost"

    def _high_pass(self, image: Image, box: Box) -> PictureFilter | None:
        if self.high_pass == "none":
            return None
        if self.high_pass == "butterworth":
            return FrequencyHighPass.fitted(image)
        L = max(LEAST_L, ceil(0.75 * max(box.w, box.h))) if self.ring_l is None else self.ring_l
        L = min(L, max(image.shape))
        kernel = full_kernel(L) if self.high_pass == "full" else ring_kernel(L, self.ring_m, min(self.ring_inner, L))
        return HighPass.fitted(image, kernel, self.grid)


class MeanShiftSearch(GreyTracker):
    """Mixin of trackers whose windows move to the mode of their similarity to the reference."""

    kernel: Literal["gaussian", "epanechnikov"] = "epanechnikov"
    """k of the histogram that scores the window; mean shift always uses Epanechnikov's."""
    bandwidth: Annotated[float, Field(ge=0.1, le=5)] = 1.0
    """Bandwidth of the mean-shift window, in half sizes of the start box."""
    iterations: int = Field(default=20, ge=1, le=1000)
    """Largest number of steps of a mean shift (Comaniciu, Meer 2002, section 6: 20)."""
    eps: Ratio = 0.1
    """Length of a step below which a mean shift ends, px."""

    def mean_shift_modes(self, appearance: Appearance, picture: Image, centers: Floats, reference: Floats) -> Modes:
        """Return the modes reached from centres (N, 2) px."""
        h = appearance.bandwidth(self.bandwidth)
        return mean_shift(picture, centers, h, appearance.quantiser, reference, self.iterations, self.eps)


class RandomWalkParticles(GreyTracker):
    """Mixin of particle filters with random-walk motion and the likelihood exp(-(1 - rho) / (2 sigma^2))."""

    kernel: Literal["gaussian", "epanechnikov"] = "epanechnikov"
    """k of the histogram: exp(-r^2 / 2), h = sqrt(hx^2 + hy^2) (Cheng et al. 2006, eq. 6), or max(0, 1 - r^2) with half
    the sizes on each axis (Xue et al. 2011, eq. 2)."""
    sigma_grey: Ratio = 0.15
    """sigma of Xue et al. 2011, eq. 5; no value is printed."""
    radius: Deviation = 10.0
    """Radius of the particles' random walk, px (section 4: 10)."""
    propagation: Propagation = "gaussian"
    """Distribution over the disc of this radius: normal, with the radius three standard deviations, or uniform."""
    resampling: Resampling = "multinomial"
    """Resampling scheme (the papers give none)."""
    update: Literal["always", "seen", "never"] = "always"
    """Frames in which the reference is updated: all, those with a visible target, or none (Xue et al. 2011, Algorithm
    2, step 6: always)."""
    lam: Fraction = 0.9
    """lambda of Algorithm 2, step 6, the share of the reference that is kept at an update (0.9)."""

    def updated(self, reference: Floats, match: MatchScore, monitor: VisibilityMonitor) -> Floats:
        """Return q <- lambda q + (1 - lambda) q(estimate), (bins,)."""
        follows = self.update == "always" or (self.update == "seen" and monitor.misses == 0)
        return blend(reference, match, 1 - self.lam) if follows else reference


def blend(reference: Floats, match: MatchScore, share: float) -> Floats:
    """Return the reference (bins,) blended with `share` of the estimate's histogram; unchanged where out of view.

    Cheng et al. 2006, eq. 13 (share alpha); Xue et al. 2011, Algorithm 2, step 6 (share 1 - lambda).
    """
    return (1 - share) * reference + share * match.histogram if match.score > 0 else reference
