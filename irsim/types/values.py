"""The values that pass between rooms: Band, Box, Frame, TargetTruth, Truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np
import numpy.typing as npt

Counts = npt.NDArray[np.uint16]
Image = npt.NDArray[np.uint8] | Counts
Floats = npt.NDArray[np.floating]
Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]
Slices = tuple[slice, slice]
"""A patch of a picture: its rows and columns."""
Held = TypeVar("Held")

Input = Literal["display", "counts"]
"""What a tracker looks at: the 8-bit picture after AGC, or the detector's counts."""

BandName = Literal["mwir", "lwir"]

Band = BandName | tuple[float, float]
"""A spectral band by its name, or its own limits, um."""

Curve = tuple[float, float, float]
"""(linear, root, zero): the noiseless count of in-band radiance L, W/m2/sr, is linear L + root sqrt(L) + zero."""

BackgroundClass = Literal["cloud", "horizon", "trees", "treeline", "ground", "city"]
"""Classes of real backgrounds whose figures are known (`irsim realism`)."""

SHOWN = 0.5
"""A target is shown, and not hidden, where at least this fraction of it is visible."""

MEDIAN_TO_SIGMA = 1.4826
"""Sigma of what is normally distributed over its median distance from the median, a spread that few outliers hardly
move: 1 / Phi^-1(3/4). F. R. Hampel, "The influence curve and its role in robust estimation", J. Am. Stat. Assoc. 69,
383 (1974)."""


def arrays_frozen(held: Held) -> Held:
    """A value whose fields that are arrays cannot be changed any more: what is kept is given to many."""
    for value in held if isinstance(held, tuple) else vars(held).values():
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
    return held


@dataclass(frozen=True, slots=True)
class Box:
    """An axis-aligned box: centre (cx, cy) and full size (w, h), px."""

    cx: float
    cy: float
    w: float
    h: float

    @classmethod
    def from_pixels(cls, x: float, y: float, w: float, h: float) -> Box:
        """The box of the whole pixels x .. x+w-1, y .. y+h-1 (as label files write them)."""
        return cls(x + (w - 1) / 2, y + (h - 1) / 2, w, h)

    @classmethod
    def from_edges(cls, left: float, top: float, right: float, bottom: float) -> Box:
        """The box between continuous edges; pixel i has its edges at i - 1/2 and i + 1/2."""
        return cls((left + right) / 2, (top + bottom) / 2, right - left, bottom - top)

    @property
    def left(self) -> float:
        return self.cx - self.w / 2

    @property
    def right(self) -> float:
        return self.cx + self.w / 2

    @property
    def top(self) -> float:
        return self.cy - self.h / 2

    @property
    def bottom(self) -> float:
        return self.cy + self.h / 2

    @property
    def pixels(self) -> tuple[float, float, float, float]:
        """(x, y, w, h) as label files write it: the inverse of `from_pixels`."""
        return (self.cx - (self.w - 1) / 2, self.cy - (self.h - 1) / 2, self.w, self.h)

    @property
    def diagonal(self) -> float:
        return float(np.hypot(self.w, self.h))

    def at_least(self, size: float) -> Box:
        """The same centre, no side under `size` px."""
        return Box(self.cx, self.cy, max(self.w, size), max(self.h, size))

    @property
    def edges(self) -> tuple[float, float, float, float]:
        """(left, top, right, bottom): the inverse of `from_edges`."""
        wide, high = self.w / 2, self.h / 2
        return self.cx - wide, self.cy - high, self.cx + wide, self.cy + high

    def iou(self, other: Box) -> float:
        """Intersection over union, 0..1."""
        w = min(self.cx + self.w / 2, other.cx + other.w / 2) - max(self.cx - self.w / 2, other.cx - other.w / 2)
        h = min(self.cy + self.h / 2, other.cy + other.h / 2) - max(self.cy - self.h / 2, other.cy - other.h / 2)
        if w <= 0 or h <= 0:
            return 0.0
        return w * h / (self.w * self.h + other.w * other.h - w * h)


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture. image (rows, cols) uint8 or uint16; bits its true depth; time in s, mid-exposure.

    index counts what arrives, without gaps. Only time tells of a frame that was dropped (it leaves a gap) or
    doubled (both have the same).
    """

    image: Image
    index: int
    time: float
    bits: int

    def __repr__(self) -> str:
        rows, cols = self.image.shape
        return f"Frame({self.index} at {self.time:.6g} s: {cols} x {rows} px, {self.bits} bits, {self.image.dtype})"


@dataclass(frozen=True, slots=True)
class TargetTruth:
    """What is true of one target in one frame; None where it is not known.

    id, cls       its name, and what it is: the kind of a rendered body, a label's class
    center        (x, y) px: area centroid of the whole, unhidden target
    box           tight box of the whole, unhidden target; of a point, its PSF's full width at
                  half maximum, or its own where that is larger
    signal_center (x, y) px: centroid of the whole, unhidden target's own light as it arrives (hot parts weigh
                  more), whatever is behind it; for an isothermal target the same as center. The centroid of
                  what it adds to the picture is another: that of `irsim.Moments.contribution`
    velocity      (vx, vy) px per frame period, apparent (the camera's own motion included): the step since the
                  scenario's frame before, dropped or not; in frame 0 that to frame 1. That of the place that its path
                  gives: the centre goes round it as it turns or moves its limbs
    attitude      (yaw, pitch, roll) degrees in the camera's first frame
    range_m       metres from the camera
    visible       fraction 0..1 of the target's area that is in the frame and not hidden, over the whole exposure
                  where the camera smears
    occluders     names of what hides some of it, by itself a hundredth of its area at least, what lies behind them too
    crossing      another target's box meets this one's
    in_view       its centre is inside the frame
    contrast_k    apparent temperature of the target's mean less that of what is behind it, K
    scr           signal-to-clutter ratio, positive where it is brighter than the ring around it: of the
                  noiseless light of the target and what is behind it, the camera's noise counted
                  as clutter (formula: docs/moments.md); None where no part of the target is in the frame,
                  and where nothing varies around it
    accuracy_px   how far the centre may be off; 0 for rendered truth, nothing scores tighter
    """

    id: str
    center: tuple[float, float]
    box: Box
    cls: str | None = None
    signal_center: tuple[float, float] | None = None
    velocity: tuple[float, float] | None = None
    attitude: tuple[float, float, float] | None = None
    range_m: float | None = None
    visible: float | None = None
    occluders: tuple[str, ...] = ()
    crossing: bool | None = None
    in_view: bool | None = None
    contrast_k: float | None = None
    accuracy_px: float = 0.0
    scr: float | None = None

    @property
    def hidden(self) -> bool:
        """Less than `SHOWN` of it is visible; not where that is not known."""
        return self.visible is not None and self.visible < SHOWN


@dataclass(frozen=True, slots=True)
class Truth:
    """What is true of one frame: the targets that exist in it (absent ones have no entry)."""

    index: int
    time: float
    targets: tuple[TargetTruth, ...] = ()

    def __repr__(self) -> str:
        return f"Truth({self.index} at {self.time:.6g} s: {', '.join(map(_line, self.targets)) or 'no target'})"

    def target(self, id: str) -> TargetTruth | None:
        """The target of that id, or None where it is absent."""
        return next((target for target in self.targets if target.id == id), None)


def _line(target: TargetTruth) -> str:
    """A target's id and box, and how much of it is seen where that is not all."""
    box, (x, y) = target.box, target.center
    seen = "" if target.visible in (None, 1.0) else f", visible {target.visible:.2g}"
    return f"{target.id} at ({x:.1f}, {y:.1f}), {box.w:.1f} x {box.h:.1f} px{seen}"
