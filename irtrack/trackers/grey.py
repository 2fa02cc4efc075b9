"""What the trackers on grey histograms share: how they look at a target, and how they judge a place.

The first frame sets for good which picture histograms are taken of (the frame or its high-pass), the
window, its kernel, and the grey range of the bins.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, hypot
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.highpass import HighPass, full_kernel, ring_kernel
from irtrack.features.histogram import (
    Judged,
    Picture,
    Surround,
    epanechnikov_kernel,
    gaussian_kernel,
    histogram,
    likeness,
    repeated,
)
from irtrack.features.mean_shift import Bandwidth, bandwidth
from irtrack.features.quantise import BinsRange, Quantiser, full_range, quantiser
from irtrack.features.window import Window
from irtrack.filters import particle as cloud
from irtrack.trackers.base import Footage, Sight, TrackerPart, footage, start_window
from irtrack.types import Estimate

LEAST_L = 5
"""px. The ring's radius for targets of up to 6 px: well beyond them, and the filter is still quick."""


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """What the first frame sets for good: the frame's kind, the target's size, window, kernel, grey range.

    kernels  the kernel, `irtrack.features.histogram.repeated`
    """

    footage: Footage
    size: tuple[float, float]
    window: Window
    kernel: Floats
    kernels: Floats
    surround: Surround
    quantiser: Quantiser
    high_pass: HighPass | None

    def picture(self, frame: Frame) -> Image:
        """What histograms are taken of; InputError where the frame is of another size or type."""
        self.footage.check(frame)
        return frame.image if self.high_pass is None else self.high_pass(frame.image)

    def view(self, frame: Frame) -> Picture:
        """The same for who looks at a part of it only."""
        self.footage.check(frame)
        return frame.image if self.high_pass is None else self.high_pass.view(frame.image)

    def half_sizes(self, scale: float) -> Bandwidth:
        """The bandwidth of a climbing window, px: the half sizes times a scale."""
        return bandwidth(Box(0, 0, *self.size), scale)

    def histogram(self, picture: Image, center: tuple[float, float]) -> Floats:
        """(bins,) of the window at a centre; zeros where it lies wholly outside."""
        return histogram(picture, center, self.window, self.kernel, self.quantiser)[0]

    def likeness(self, picture: Picture, centers: Floats, reference: Floats) -> tuple[Floats, Floats]:
        """rho (N,) of the windows at centres (N, 2) px, and their visible shares (N,)."""
        return likeness(picture, centers, self.window, self.kernels, self.quantiser, reference)

    def judge(self, picture: Picture, center: tuple[float, float], reference: Floats) -> Judged:
        """What is at a centre; what the frame's edge cuts off counts against it, as in `likeness`."""
        return self.surround.judge(picture, center, reference)


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What a step saw at its estimate, and whether anything of the target's windows was in the frame."""

    appearance: Appearance
    judged: Judged
    sight: Sight
    in_view: bool


class GreyPart(TrackerPart):
    """A tracker that knows its target by a grey histogram."""

    bins: int = Field(default=32, ge=2, le=256)
    """Grey levels of the histogram (Cheng et al. 2006: 32 or 16; Xue et al. 2011, Wei et al. 2008: 32)."""
    bins_range: BinsRange = "first_frame"
    """Grey range of the bins: that of the first frame, kept; or the full range of the bits. A high-passed
    picture always has its full range."""
    kernel: Literal["gaussian", "epanechnikov"] = "gaussian"
    """k of the histogram: exp(-r^2 / 2), h = sqrt(hx^2 + hy^2) (Cheng et al. 2006, eq. 6), or max(0, 1 - r^2)
    with half the sizes on each axis (Xue et al. 2011, eq. 2)."""
    kernel_scale: Annotated[float, Field(ge=0.01, le=100)] = 0.5
    """gaussian: multiplies h; 1: hx, hy are full sizes, 0.5: half ones."""
    high_pass: Literal["none", "ring", "full"] = "none"
    """What histograms are taken of: the frame, or what it stands above a background predicted from a ring
    neighbourhood (Xue et al. 2011, eq. 1) or from a full one (Peng, Zhou 1999)."""
    ring_l: int | None = Field(default=None, ge=1, le=100)
    """L of eq. 1, the largest radius, px; without a value three quarters of the box's longer side, at least 5."""
    ring_m: int = Field(default=8, ge=3, le=64)
    """m of eq. 1, samples on each radius."""
    ring_inner: int = Field(default=0, ge=0, le=100)
    """Least radius, at most L; 0 as in eq. 1. Beyond the target's half size, the target is left out of its own
    background."""
    grid: int = Field(default=1, ge=1, le=16)
    """Step of the grid on which the background is predicted (section 1.1, Fig. 2). The grid was to save time,
    and here saves none."""
    ring: Annotated[float, Field(ge=0.1, le=10)] = 0.5
    """Width of the ring around the target that its likeness is judged against, in sides of the window;
    at 0.5 the ring has three times the window's area, enough pixels for a steady histogram."""
    seen: Fraction = 0.5
    """Share of the way from the surrounding ring's rho to the target's usual one that counts as seen."""
    lost_after: int = Field(default=10, ge=1, le=1_000_000)
    """Frames in a row without sight after which the status is lost."""

    def look(self, frame: Frame, box: Box) -> tuple[Appearance, Floats]:
        """How the target is looked at from its first frame on, and its histogram (bins,) there.

        InputError where the box does not meet the frame, or is none.
        """
        part, corner = start_window(frame, box)
        window = Window.of(box)
        high_pass = self._high_pass(frame.image, box)
        picture = frame.image if high_pass is None else high_pass(frame.image)
        levels = (
            quantiser(frame, part.cut(frame.image, corner), self.bins, self.bins_range)
            if high_pass is None
            else full_range(8, self.bins)
        )
        kernel = (
            gaussian_kernel(window, self.kernel_scale * hypot(box.w, box.h))
            if self.kernel == "gaussian"
            else epanechnikov_kernel(window)
        )
        margin = (ceil(self.ring * window.columns), ceil(self.ring * window.rows))
        appearance = Appearance(
            footage=footage(frame),
            size=(box.w, box.h),
            window=window,
            kernel=kernel,
            kernels=repeated(kernel),
            surround=Surround.of(window, kernel, margin, levels),
            quantiser=levels,
            high_pass=high_pass,
        )
        return appearance, appearance.histogram(picture, (box.cx, box.cy))

    def sight_after(self, sight: Sight, judged: Judged, in_view: bool = True) -> Sight:
        """Whether the target is seen where it was judged."""
        return sight.after(judged.score, judged.floor, self.seen) if in_view else sight.unseen()

    def of_cloud(self, seen: Seen, positions: Floats, weights: Floats, center: Floats, velocity: Floats) -> Estimate:
        """The estimate of a particle filter: places (N, 2) px with weights (N,), centre and velocity (2,)."""
        x, y = center.tolist()
        vx, vy = velocity.tolist()
        return Estimate(
            center=(x, y),
            size=seen.appearance.size,
            status=seen.sight.status(self.lost_after) if seen.in_view else "lost",
            score=seen.judged.score,
            velocity=(vx, vy),
            covariance=cloud.covariance(weights, positions, center),
            neff=float(cloud.neff(weights)),
            particles=positions,
            weights=weights,
        )

    def _high_pass(self, image: Image, box: Box) -> HighPass | None:
        if self.high_pass == "none":
            return None
        L = max(LEAST_L, ceil(0.75 * max(box.w, box.h))) if self.ring_l is None else self.ring_l
        L = min(L, max(image.shape))
        kernel = full_kernel(L) if self.high_pass == "full" else ring_kernel(L, self.ring_m, min(self.ring_inner, L))
        return HighPass.fitted(image, kernel, self.grid)


def blend(reference: Floats, judged: Judged, share: float) -> Floats:
    """(bins,) the reference with a share of the estimate's histogram; as it was where that is out of view.

    Cheng et al. 2006, eq. 13 (share alpha); Xue et al. 2011, Algorithm 2, step 6 (share 1 - lambda).
    """
    return (1 - share) * reference + share * judged.histogram if judged.score > 0 else reference


def weigh(rho: Floats, visible: Floats, sharpness: float) -> tuple[Floats, bool]:
    """Weights (N,) proportional to exp(-sharpness D^2), summing to one, and whether any window is in view.

    D^2 = 1 - rho. The sharpness is lambda / 2 in Cheng et al. 2006, eq. 10, and 1 / (2 sigma^2) in
    Xue et al. 2011, eq. 5. A window wholly outside the frame weighs nothing; all outside: equal weights.
    """
    weights = cloud.reweigh(np.sign(visible), rho, sharpness)
    return (np.full(len(rho), 1 / len(rho)), False) if weights is None else (weights, True)
