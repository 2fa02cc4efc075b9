"""Values that pass between packages: Box, Pose, Frame, TargetTruth, Truth, and the Source protocol.

Conventions, everywhere in irsim and irtrack
    x points right, y down; the centre of the top-left pixel is (0, 0), so pixel i covers
    [i - 1/2, i + 1/2]. Lengths are in px, times in seconds, velocities in px per frame.
    A target is a centre (cx, cy) and a full size (w, h). Images are indexed [row, column].
    None means not known (imported truth has little more than boxes).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, TypeVar, runtime_checkable

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError, whole_number

Counts = npt.NDArray[np.uint16]
Image = npt.NDArray[np.uint8] | Counts
Floats = npt.NDArray[np.floating]
Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]
Slices = tuple[slice, slice]
"""Rows and columns of a patch of a picture."""
Held = TypeVar("Held")
Values = TypeVar("Values", bound=npt.NDArray[Any])

Input = Literal["display", "counts"]
"""Image of a frame: 'display', the 8-bit picture after AGC, or 'counts', those of the detector."""

BandName = Literal["mwir", "lwir"]

Band = BandName | tuple[float, float]
"""Spectral band by its name, or its limits, um."""

Curve = tuple[float, float, float]
"""(linear, root, zero): the noiseless count of in-band radiance L, W/m2/sr, is linear L + root sqrt(L) + zero."""

BackgroundClass = Literal["cloud", "horizon", "trees", "treeline", "ground", "city"]
"""Classes of real backgrounds with measured statistics (`irsim realism`)."""

SHOWN = 0.5
"""Visible fraction of a target below which it counts as hidden."""

MEDIAN_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation: 1 / Phi^-1(3/4). F. R. Hampel, "The
influence curve and its role in robust estimation", J. Am. Stat. Assoc. 69, 383 (1974)."""


def read_only(values: Values) -> Values:
    """Return the same array with its write flag cleared."""
    values.flags.writeable = False
    return values


def arrays_frozen(held: Held) -> Held:
    """Make the arrays in a value's fields read-only, for sharing by caches, and return the value."""
    for value in held if isinstance(held, tuple) else vars(held).values():
        if isinstance(value, np.ndarray):
            read_only(value)
    return held


def frame_range(start: int, stop: int | None, length: int) -> range:
    """Return the numbers of frames start .. stop-1 of `length` frames, cut at the last one.

    Raises InputError for a number below 0 and for anything but integers.
    """
    return range(whole_number("start", start), length if stop is None else min(whole_number("stop", stop), length))


def expect_input(input: object) -> None:
    """Raise InputError unless `input` names a picture of a frame, see `Input`."""
    if input not in ("display", "counts"):
        raise InputError(f"input {input!r}: allowed: 'display' (the 8-bit picture) or 'counts' (the detector's)")


@dataclass(frozen=True, slots=True)
class Box:
    """Axis-aligned box: centre (cx, cy) and full size (w, h), px."""

    cx: float
    cy: float
    w: float
    h: float

    @classmethod
    def from_pixels(cls, x: float, y: float, w: float, h: float) -> Box:
        """Return the box of the whole pixels x .. x+w-1, y .. y+h-1 (as label files write them)."""
        return cls(x + (w - 1) / 2, y + (h - 1) / 2, w, h)

    @classmethod
    def from_edges(cls, left: float, top: float, right: float, bottom: float) -> Box:
        """Return the box between continuous edges; pixel i has its edges at i - 1/2 and i + 1/2."""
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
        """(x, y, w, h) as in label files: the inverse of `from_pixels`."""
        return (self.cx - (self.w - 1) / 2, self.cy - (self.h - 1) / 2, self.w, self.h)

    @property
    def diagonal(self) -> float:
        return float(np.hypot(self.w, self.h))

    def at_least(self, size: float) -> Box:
        """Return a box of the same centre with no side under `size` px."""
        return Box(self.cx, self.cy, max(self.w, size), max(self.h, size))

    @property
    def edges(self) -> tuple[float, float, float, float]:
        """(left, top, right, bottom): the inverse of `from_edges`."""
        return self.left, self.top, self.right, self.bottom

    def iou(self, other: Box) -> float:
        """Return the intersection over union, 0..1."""
        w = min(self.right, other.right) - max(self.left, other.left)
        h = min(self.bottom, other.bottom) - max(self.top, other.top)
        if w <= 0 or h <= 0:
            return 0.0
        return w * h / (self.w * self.h + other.w * other.h - w * h)


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose and focal length of the camera in one frame, in the middle of its exposure.

    azimuth_deg    degrees to the right of the first pointing, not reduced to one turn
    elevation_deg  degrees above the horizontal; azimuth turns about the vertical, elevation about the level axis
    roll_deg       degrees clockwise about the optical axis
    ifov_rad       angle of a pixel on the optical axis, rad: 1 / (focal length in px), zoom included
    place_m        (east, north, up) m from the camera's first position; north is level ahead at the first pointing

    The angles are those of the line of sight, tilt by turbulence included. `irsim.homography` maps pixels of distant
    points from one frame to another.
    """

    azimuth_deg: float
    elevation_deg: float
    roll_deg: float
    ifov_rad: float
    place_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture: `image`, (rows, cols) uint8 or uint16, its true depth `bits`, and its `time`, s, mid-exposure.

    `index` counts frames that arrive, without gaps. A dropped frame leaves a gap in time; a doubled one has the time of
    the frame before it. `pose` is the camera's; None except for trackers that need it (`irtrack.replay.replay`).
    """

    image: Image
    index: int
    time: float
    bits: int
    pose: Pose | None = None

    def __repr__(self) -> str:
        rows, cols = self.image.shape
        return f"Frame({self.index} at {self.time:.6g} s: {cols} x {rows} px, {self.bits} bits, {self.image.dtype})"

    def _repr_html_(self) -> str:
        from irsim.notebook import framed  # that module imports this one

        low, high = int(self.image.min()), int(self.image.max())
        picture = np.rint((self.image.astype(np.float32) - low) * (255 / max(high - low, 1))).astype(np.uint8)
        return framed(picture, [], f"{self!r}: {low} black to {high} white")


@dataclass(frozen=True, slots=True)
class TargetTruth:
    """Ground truth of one target in one frame; a value is None where it is not known.

    id, cls       its name, and its class: the kind of a rendered body, a label's class
    center        (x, y) px: area centroid of the whole target, occluded or not
    box           tight box of the whole target, occluded or not; for a point, the full width at half maximum of its
                  PSF, or the point's own size where that is larger
    signal_center (x, y) px: centroid of the whole target's own light at the camera (hot parts weigh
                  more), independent of the background; for an isothermal target the same as center. The
                  centroid of its contribution to the picture differs: see `irsim.Moments.contribution`
    velocity      (vx, vy) px per frame period, apparent (the camera's own motion included): the step since the
                  scenario's previous frame, dropped or not; in frame 0 the step to frame 1. It is the velocity of
                  the trajectory's point; the centroid moves around it as the target turns or moves its limbs
    attitude      (yaw, pitch, roll) degrees in the camera's first frame
    range_m       metres from the camera
    visible       fraction 0..1 of the target's area that is in the frame and not occluded, over the whole exposure
                  where the camera has motion blur
    occluders     names of occluders that each cover at least a hundredth of its area, occluded themselves or not
    crossing      True where another target's box intersects this one's
    in_view       True where its centre is inside the frame
    contrast_k    apparent temperature of the target's mean radiance less that of its background, K
    scr           signal-to-clutter ratio, positive where the target is brighter than the ring around it. Signal and
                  clutter are noiseless, and the camera's noise is added to the clutter (formula: docs/moments.md). None
                  where no part of the target is in the frame, and where its surroundings are uniform
    accuracy_px   bound on the error of the centre; 0 for rendered truth, which is exact
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
        """True where less than `SHOWN` of the target is visible; False where the visible fraction is not known."""
        return self.visible is not None and self.visible < SHOWN


@dataclass(frozen=True, slots=True)
class Truth:
    """Ground truth of one frame: its time, the targets that exist in it, and the camera's pose.

    The pose is None where it is not known: in imported footage, behind a recorded background, and in recordings made
    before they held it.
    """

    index: int
    time: float
    targets: tuple[TargetTruth, ...] = ()
    pose: Pose | None = None

    def __repr__(self) -> str:
        return f"Truth({self.index} at {self.time:.6g} s: {', '.join(map(_summary, self.targets)) or 'no target'})"

    def target(self, id: str) -> TargetTruth | None:
        """Return the target with this id; None where it does not exist."""
        return next((target for target in self.targets if target.id == id), None)


def _summary(target: TargetTruth) -> str:
    """Return a target's id and box, and its visible fraction where that is below 1."""
    box, (x, y) = target.box, target.center
    visible = "" if target.visible in (None, 1.0) else f", visible {target.visible:.2g}"
    return f"{target.id} at ({x:.1f}, {y:.1f}), {box.w:.1f} x {box.h:.1f} px{visible}"


@dataclass(frozen=True, slots=True)
class TargetBounds:
    """Cramér-Rao bounds of one target's position in one frame, by `irsim.bounds`; None where not computed.

    index, target                     frame and id
    sd_x, sd_y                        Cramér-Rao bound on the standard deviation of the centre, px, amplitude unknown
    sd_xy                             covariance that belongs to it, px²
    d                                 deflection of the ideal matched filter
    sd_x_background, sd_y_background  bound where one level of the background in `region` is unknown too
    region                            (first column, first row, columns, rows) of that level
    sd_x_clutter, sd_y_clutter, d_clutter   bound and deflection where the clutter is coloured Gaussian noise
    predicted_x, predicted_y          below d = 10: root mean square error of the best match within the search gate
    sd_x_sequence, sd_y_sequence      bound of an estimate from this frame and all before it
    """

    index: int
    target: str
    sd_x: float
    sd_y: float
    sd_xy: float
    d: float
    sd_x_background: float | None
    sd_y_background: float | None
    region: tuple[int, int, int, int]
    sd_x_clutter: float | None = None
    sd_y_clutter: float | None = None
    d_clutter: float | None = None
    predicted_x: float | None = None
    predicted_y: float | None = None
    sd_x_sequence: float | None = None
    sd_y_sequence: float | None = None


class Display(Protocol):
    """Mapping of counts to the 8-bit picture."""

    def display(self, counts: Image, bits: int) -> npt.NDArray[np.uint8]:
        """Return the picture of counts (rows, cols), `bits` deep."""
        ...


@dataclass(frozen=True, slots=True)
class CameraFacts:
    """Known facts of the camera behind a source; None: not known.

    ifov_rad   angle of a pixel, rad
    band       its name, or its limits, um
    range_k    blackbody temperatures of count 0 and of full scale, K; counts between are linear in radiance
    curve      (linear, root, zero) of counts that are not linear in radiance, as in a camera that counts photons
    """

    ifov_rad: float | None = None
    band: Band | None = None
    range_k: tuple[float, float] | None = None
    curve: Curve | None = None


@runtime_checkable
class Source(Protocol):
    """Sequence of frames with truth (or none) and a hash: a rendered scenario or a recording.

    name           a short name for tables: a file's stem or the scenario's name
    hash           hex digest; two sources with one hash give the same counts and truth
    size           (columns, rows)
    follow         id of the default target to follow
    seed           of the rendered scene; None where no seed changes the frames
    scenario_text  the scenario that was rendered, as YAML; None where there was none
    file           the file that holds the frames; None without one
    agc            mapping of its counts to 8-bit pictures; None where it has none
    camera         known facts of the camera

    A class that derives from Source must define only the members without a default here.
    """

    @property
    def name(self) -> str: ...
    @property
    def hash(self) -> str: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def bits(self) -> int: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def follow(self) -> str | None: ...
    @property
    def has_truth(self) -> bool: ...

    @property
    def seed(self) -> int | None:
        return None

    @property
    def scenario_text(self) -> str | None:
        return None

    @property
    def file(self) -> Path | None:
        return None

    @property
    def needs(self) -> tuple[Path, ...]:
        """Input files of the frames, which no output may replace."""
        return () if self.file is None else (self.file,)

    @property
    def agc(self) -> Display | None:
        return None

    @property
    def camera(self) -> CameraFacts:
        return CameraFacts()

    def __len__(self) -> int: ...

    def frame(self, index: int, input: Input = "counts") -> Frame:
        """Return frame `index`, bit for bit as in the sequence. IndexError past the end, InputError for another
        `input`."""
        ...

    def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Yield frames start .. stop-1 in order; an image stays valid while later ones are made."""
        ...

    def truths(self, start: int = 0, stop: int | None = None) -> Iterator[Truth]:
        """Yield the truths of frames start .. stop-1 in order; nothing where has_truth is False."""
        ...

    def truth(self, index: int) -> Truth | None:
        """Return the truth of frame `index` without its counts; None where has_truth is False. IndexError where there
        is no such frame."""
        if not 0 <= index < len(self):
            raise IndexError(f"frame {index}: {self.name} has frames 0 to {len(self) - 1}")
        return next(iter(self.truths(index, index + 1)), None)

    def pairs(
        self, start: int = 0, stop: int | None = None, jobs: int = 1, input: Input = "counts"
    ) -> Iterator[tuple[Frame, Truth | None]]:
        """Yield frames start .. stop-1, each with its truth, in one pass; by `jobs` processes if the source can."""
        frames = self.frames(input, start, stop)
        if self.has_truth:
            yield from zip(frames, self.truths(start, stop), strict=True)
        else:
            for frame in frames:
                yield frame, None

    def with_seed(self, seed: int) -> Source:
        """Return the same scene with another seed; itself where no seed changes the frames."""
        return self
