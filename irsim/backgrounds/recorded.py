"""Recorded frames as the background: synthetic targets are inserted, and the frames' own noise is kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import cv2
import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.backgrounds.base import FARTHEST, Background, Layer, ViewDirection
from irsim.config.paths import Stamp, check_unchanged, with_digest
from irsim.config.quantities import FileName, Index, ScaleKelvin
from irsim.errors import InputError
from irsim.geometry.context import SceneContext
from irsim.physics.radiometry import Scale, limits
from irsim.types import Band, CameraFacts, Curve, Floats, Image, TargetTruth

if TYPE_CHECKING:
    from irsim.recording import Recording

UNKNOWN_RANGE_K = (220.0, 400.0)
"""Default scene temperatures of count 0 and full scale, K, if neither scenario nor recording states them."""

MEDIAN_OF_NOISE = 0.583
"""Median magnitude of the difference between white noise of sigma 1 and the median of the 3 x 3 pixels about it: 0.582
to 0.584 for a million drawn pixels. It is below the 0.674 of the noise itself, as one pixel in nine is itself the
median."""
MOST_SIGMAS = 3.5
"""Largest deviation that counts as noise, in sigmas; 1 in 2000 deviations of normal noise is larger. It is about 2
sqrt(3), so that values folded into +- half of it (`folded`), if uniformly distributed, have the sigma of the noise."""
ENOUGH = 0.1
"""Least share of unclipped pixels for which the sigma of a frame's noise is estimated from these pixels only. Clipped
pixels and black bars have no noise and are left out; if nearly all are clipped, the others show objects, so all are
used."""


class Recorded(Background):
    """Frames of a recording with targets inserted; no other noise is added.

    Counts are converted to radiance by the camera curve stored in the recording, if it is for the scenario's band; else
    linearly between the radiances L0 and L1 of black bodies of `range_k`: L = L0 + (L1 - L0) count / full. An object
    changes the radiance of a pixel, and its count accordingly. The recorded noise is kept: the deviation of a pixel
    from its eight neighbours, up to the magnitude of noise. Recorded small objects and edges deviate more, so inserted
    objects cover them; texture as weak as noise stays. All other pixels keep their counts bit for bit. The scenario's
    camera needs the size and bit depth of the recording; its detector, noise and motion have no effect on the recorded
    frames.
    """

    has_noise: ClassVar[bool] = True
    mapped: ClassVar[bool] = False

    file: FileName
    """File of the recording; a relative path is searched beside the scenario, then in the working directory."""
    start: Index = 0
    """Number, from 0, of the recorded frame that becomes frame 0 of the scenario."""
    past_end: Literal["loop", "hold"] = "loop"
    """Frames after the last recorded one: loop to the first, or hold the last."""
    range_k: Annotated[tuple[ScaleKelvin, ScaleKelvin], Field(strict=False)] | None = None
    """[low, high] temperatures of black bodies at count 0 and full scale, K. Default: the recording's own scale, or 220
    to 400 without one."""
    digest: str = ""
    """Digest of the recording, filled in automatically; a given digest must match the file."""

    @model_validator(mode="before")
    @classmethod
    def _add_digest(cls, data: Any) -> Any:
        return with_digest(data, lambda file: _digest(_opened(file)))

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the given keys and `range_k` of the recording. The digest is not filled in here but by `_add_digest`,
        so that shortened scenarios keep it."""
        if "range_k" in given or not isinstance(given.get("file"), str):
            return given
        try:
            return {**given, "range_k": _opened(given["file"]).header.range_k}
        except (InputError, OSError):  # reported by `_add_digest`
            return given

    @model_validator(mode="after")
    def _start_exists(self) -> Recorded:
        frames = len(self.recording)
        if self.start >= frames:
            raise _wrong("start", f"{self.file} has no frame {self.start}; allowed: 0 to {frames - 1}")
        return self

    @model_validator(mode="after")
    def _range_rises(self) -> Recorded:
        if self.range_k is not None and self.range_k[0] >= self.range_k[1]:
            low, high = self.range_k
            raise _wrong("range_k", f"{low} K is not below {high} K; allowed: the lower temperature first")
        return self

    def camera_fault(self, size: tuple[int, int], bits: int) -> str | None:
        recording = self.recording
        if (recording.size, recording.bits) == (size, bits):
            return None
        return (
            f"{self.file} has {recording.size[0]}x{recording.size[1]} px of {recording.bits} bits, the camera "
            f"{size[0]}x{size[1]} of {bits}; allowed: camera size: {list(recording.size)}, bits: {recording.bits}"
        )

    @property
    def recording(self) -> Recording:
        """Opened recording. Raises InputError if the file changed since the scenario was read."""
        found = _opened(self.file)
        check_unchanged(self.file, self.digest, _digest(found))
        return found

    def scale(self, band: Band) -> Scale:
        """Return the conversion between the recording's counts and radiance in a band."""
        curve = self.known(band)
        return Scale.known(curve, band, self.range_k or UNKNOWN_RANGE_K, self.recording.bits)

    def known(self, band: Band) -> Curve | None:
        """Return the camera curve stored in the recording, from radiance to counts; None if `range_k` is given, or if
        there is no curve for `band`."""
        facts = self.recording.camera
        return facts.curve if self.range_k is None and _same(facts.band, band) else None

    def recorded_camera(self, camera: CameraFacts) -> CameraFacts:
        known = None if camera.band is None else self.known(camera.band)
        return replace(camera, range_k=self.range_k, curve=known)

    @property
    def recorded_targets(self) -> Mapping[str, str | None]:
        return {target.id: target.cls for target in self.recording.contents.targets}

    def number(self, index: int, length: int) -> int:
        """Return the number, of `length` recorded frames, of the one that is the background of frame `index`."""
        wanted = self.start + index
        return wanted % length if self.past_end == "loop" else min(wanted, length - 1)

    def recorded_truth(self, index: int) -> tuple[TargetTruth, ...]:
        recording = _kept(self)
        truth = recording.truth(self.number(index, len(recording)))
        if truth is None:
            return ()
        if self.start + index < len(recording) or self.past_end == "loop":
            return truth.targets
        return tuple(
            replace(each, velocity=each.velocity and (0.0, 0.0)) for each in truth.targets
        )  # targets of the held frame are at rest

    def ambient(self, context: SceneContext) -> float:
        """Return the mean radiance of the first recorded frame."""
        return _mean_light(self, context.band)

    @property
    def files(self) -> tuple[Path, ...]:
        return (Path(self.file),)

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        return [Footage(self, context)]


@lru_cache(maxsize=16)
def _mean_light(recorded: Recorded, band: Band) -> float:
    """Return the mean radiance of the first frame, W/m2/sr."""
    counts = recorded.recording.frame(recorded.start).image
    return float(np.mean(recorded.scale(band).light(counts.astype(np.float32)), dtype=np.float64))


@lru_cache(maxsize=16)
def _kept(recorded: Recorded) -> Recording:
    """Return the opened recording, which checks at each reading that the file is unchanged."""
    return recorded.recording


class Footage:
    """Opaque layer of recorded frames, read in sequence or by seeking."""

    name = "recording"
    range_m = FARTHEST

    def __init__(self, recorded: Recorded, context: SceneContext) -> None:
        self._recorded = recorded
        self._rate_hz = context.rate_hz
        self._scale = recorded.scale(context.band)
        self._last: tuple[int, Image] | None = None

    @cached_property
    def _recording(self) -> Recording:
        return self._recorded.recording

    def counts(self, index: int) -> Image:
        """Return the counts of the recorded frame that is the background of frame `index`."""
        wanted = self._recorded.number(index, len(self._recording))
        last = self._last  # read once: another thread may replace it
        if last is None or last[0] != wanted:
            last = self._last = wanted, self._recording.frame(wanted).image
        return last[1]

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        return None, self._light(self.counts(round(view_direction.time * self._rate_hz)))

    def _light(self, counts: Image) -> Floats:
        return self._scale.light(counts.astype(np.float32))

    def insert_into(self, light: Floats, index: int, uncovered: Floats) -> Floats:
        """Return the counts of frame `index` with objects, before rounding and clipping (`RecordedLayer.insert_into`).

        The noise arises in the camera, so the recorded noise of the covered share of each pixel is added to the object.
        """
        counts = self.counts(index)
        added = self._scale.rise(self._light(counts), light)
        kept = (1 - uncovered) * recorded_noise(counts, 2**self._recording.bits - 1)
        return np.asarray(counts + added + kept)


def recorded_noise(counts: Image, full: int) -> Floats:
    """Return the noise of a recorded frame, (rows, cols) float32 counts; full: the greatest count.

    It is the deviation of a pixel from the median of the 3 x 3 pixels about it, which contains 97 % of white noise and
    little of structure blurred by optics. Small objects and edges deviate more than noise does; their deviations are
    folded (`folded`).
    """
    deviation = counts.astype(np.float32) - cv2.medianBlur(counts, 3)
    unclipped = (counts > 0) & (counts < full)
    most = MOST_SIGMAS * _robust_sigma(deviation[unclipped] if unclipped.mean() > ENOUGH else deviation.reshape(-1))
    farther = np.abs(deviation) > most
    deviation[farther] = folded(deviation[farther], most)
    return deviation


def folded(deviation: Floats, most: float) -> Floats:
    """Return values up to +-`most` unchanged, and larger ones folded to and fro between +-`most` / 2.

    The function is continuous and nowhere flat. A bright pixel thus keeps its noise about another value, possibly with
    the opposite sign. Clipping at `most` would remove the noise; if larger values were replaced, pixels near `most`
    would blink.
    """
    off = np.abs(deviation)
    back = most - np.abs(off - most)
    to_and_fro = np.abs(np.mod(off - 1.5 * most, 2 * most) - most) - 0.5 * most
    return np.copysign(1, deviation) * np.where(off < 1.5 * most, back, to_and_fro)


def _robust_sigma(deviation: Floats) -> float:
    """Return the sigma of the noise, counts, from the median magnitude of (n,) deviations, which is robust to small
    objects."""
    # Rounding: deviations of n counts lie uniformly from n - 1/2 to n + 1/2, so sigma is above 0.
    below = np.cumsum(np.bincount(np.abs(deviation).astype(np.intp))) / deviation.size
    median = np.interp(0.5, np.append(0.0, below), np.append(0.0, np.arange(below.size) + 0.5))
    return float(median) / MEDIAN_OF_NOISE


def _same(one: Band | None, other: Band) -> bool:
    return one is not None and limits(one) == limits(other)


def _opened(file: str) -> Recording:
    from irsim.recording import open_recording  # imports mcap and protobuf: only needed for recordings

    return open_recording(file)


def _digest(recording: Recording) -> str:
    return _digest_of(recording.path, recording.mcap.stamp)


@lru_cache(maxsize=64)
def _digest_of(path: Path, stamp: Stamp) -> str:
    """Return the digest of a file whose stamp is `stamp`, computed once for all scenes."""
    return _opened(str(path)).hash


def _wrong(key: str, what: str) -> PydanticCustomError:
    return PydanticCustomError("recording", "{what}", {"what": what, "at": (key,)})
