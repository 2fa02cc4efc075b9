"""Somebody's own footage as the background: synthetic targets are put into recorded frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.backgrounds.base import FARTHEST, Background, Layer, ViewDirection
from irsim.backgrounds.own_noise import own_noise
from irsim.config.field_annotations import FileName
from irsim.config.file_digests import Stamp, unchanged, with_digest
from irsim.config.quantities import Index, ScaleKelvin
from irsim.errors import InputError
from irsim.geometry.context import SceneContext
from irsim.physics.radiometry import Scale, limits
from irsim.types import Band, CameraFacts, Curve, Floats, Image

if TYPE_CHECKING:
    from irsim.recording import Recording

UNKNOWN_RANGE_K = (220.0, 400.0)
"""Scene temperatures of count 0 and full scale where neither the scenario nor the recording says them."""


class Recorded(Background):
    """Frames of a recording, as they are, with targets put into them; its own noise stays the only one.

    Counts stand for the light that gave them by the recording's own camera, where it says so and sees the same band;
    else for radiance evenly between black bodies of `range_k`: L = L0 + (L1 - L0) count / full.
    What is drawn changes a pixel's light, and its count by that change, but the camera's noise stays: what
    sets the pixel off from the eight about it, as far as noise does. Small objects and edges set it off farther and
    are hidden; texture no stronger than noise is not. Every other pixel keeps its count bit for bit. The camera needs
    the recording's size and depth; its detector, noise and motion do not touch the recorded frames.
    """

    noisy: ClassVar[bool] = True
    mapped: ClassVar[bool] = False

    file: FileName
    """The recording; a relative name is looked for beside the scenario, then in the working directory."""
    start: Index = 0
    """Its frame that is frame 0 here."""
    past_end: Literal["loop", "hold"] = "loop"
    """After its last frame: from the first again, or the last one on and on."""
    range_k: Annotated[tuple[ScaleKelvin, ScaleKelvin], Field(strict=False)] | None = None
    """Black bodies that count 0 and full scale stand for, K; where not given, the recording's own scale, or 220 to 400
    where it has none."""
    digest: str = ""
    """Of the recording's bytes; filled in, and compared where given: a changed recording is another scene."""

    @model_validator(mode="before")
    @classmethod
    def _look_inside(cls, data: Any) -> Any:
        return with_digest(data, lambda file: _digest(_opened(file)))

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """The scale of the recording, once there is one. Its digest is no default: short texts say it too."""
        if "range_k" in given or not isinstance(given.get("file"), str):
            return given
        try:
            return {**given, "range_k": _opened(given["file"]).header.range_k}
        except (InputError, OSError):  # told by `_look_inside`
            return given

    @model_validator(mode="after")
    def _start_is_there(self) -> Recorded:
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

    def refuses(self, size: tuple[int, int], bits: int) -> str | None:
        recording = self.recording
        if (recording.size, recording.bits) == (size, bits):
            return None
        return (
            f"{self.file} has {recording.size[0]}x{recording.size[1]} px of {recording.bits} bits, the camera "
            f"{size[0]}x{size[1]} of {bits}; allowed: camera size: {list(recording.size)}, bits: {recording.bits}"
        )

    @property
    def recording(self) -> Recording:
        """The recording, opened. InputError where it has changed since the scene was read."""
        found = _opened(self.file)
        unchanged(self.file, self.digest, _digest(found))
        return found

    def scale(self, band: Band) -> Scale:
        """What its counts stand for in the light of a camera of that band."""
        curve = self.known(band)
        return Scale.known(curve, band, self.range_k or UNKNOWN_RANGE_K, self.recording.bits)

    def known(self, band: Band) -> Curve | None:
        """The recording's own curve of counts by light in that band; None where it says none, or `range_k` holds."""
        facts = self.recording.camera
        return facts.curve if self.range_k is None and _same(facts.band, band) else None

    def taken_by(self, camera: CameraFacts) -> CameraFacts:
        known = None if camera.band is None else self.known(camera.band)
        return replace(camera, range_k=self.range_k, curve=known)

    def ambient(self, context: SceneContext) -> float:
        """All around is as bright as its first frame in the mean."""
        return _mean_light(self, context.band)

    @property
    def files(self) -> tuple[Path, ...]:
        return (Path(self.file),)

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        return [Footage(self, context)]


@lru_cache(maxsize=16)
def _mean_light(recorded: Recorded, band: Band) -> float:
    """Of its first frame, W/m2/sr."""
    counts = recorded.recording.frame(recorded.start).image
    return float(np.mean(recorded.scale(band).light(counts.astype(np.float32)), dtype=np.float64))


class Footage:
    """The opaque layer of recorded frames. It reads on where it stands; any other frame is sought."""

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
        """The recorded frame behind frame `index`."""
        wanted, length = self._recorded.start + index, len(self._recording)
        wanted = wanted % length if self._recorded.past_end == "loop" else min(wanted, length - 1)
        last = self._last  # once: another thread may put its own there
        if last is None or last[0] != wanted:
            last = self._last = wanted, self._recording.frame(wanted).image
        return last[1]

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        return None, self._light(self.counts(round(view_direction.time * self._rate_hz)))

    def _light(self, counts: Image) -> Floats:
        return self._scale.light(counts.astype(np.float32))

    def put_into(self, light: Floats, index: int, uncovered: Floats) -> Floats:
        """Counts of frame `index` with what was drawn on its light, which must have come from `light`, before they are
        rounded and clipped: (rows, cols), float64 where the light is, else float32.

        uncovered: the share 0..1 of each pixel's light that is still the recording's. With the rest a body takes the
        camera's noise away, which arises behind it: it is put back, or the body would be a hole in the noise.
        """
        counts = self.counts(index)
        added = self._scale.rise(self._light(counts), light)
        kept = (1 - uncovered) * own_noise(counts, 2**self._recording.bits - 1)
        return np.asarray(counts + added + kept)


def _same(one: Band | None, other: Band) -> bool:
    return one is not None and limits(one) == limits(other)


def _opened(file: str) -> Recording:
    from irsim.recording import open_recording  # imports mcap and protobuf: only where a recording is asked for

    return open_recording(file)


def _digest(recording: Recording) -> str:
    return _digest_of(recording.path, recording.container.stamp)


@lru_cache(maxsize=64)
def _digest_of(path: Path, stamp: Stamp) -> str:
    """Of a file with that stamp: read once, however many scenes are made of it."""
    return _opened(str(path)).hash


def _wrong(key: str, what: str) -> PydanticCustomError:
    return PydanticCustomError("recording", "{what}", {"what": what, "at": (key,)})
