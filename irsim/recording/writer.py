"""Writer of recordings, in the file layout of docs/recordings.md."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, get_args

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from irsim.camera import AGCS
from irsim.camera.agc import Agc, AgcSequence
from irsim.config.paths import path_of
from irsim.errors import InputError, expect_source, whole_number
from irsim.recording.archive import codec
from irsim.recording.bounds_messages import BOUNDS_DESCRIPTOR, encode_bounds
from irsim.recording.header import Contents, Header, TargetEntry
from irsim.recording.mcap_writer import Compression, McapWriter, Message
from irsim.recording.messages import (
    BOUNDS,
    CAMERA,
    IMAGE,
    LAYOUT,
    OPTICAL_FRAME,
    PREVIEW,
    SCENARIO,
    TRUTH,
    TRUTH_BOXES,
    TRUTH_DESCRIPTOR,
    band_text,
    encode_archived_image,
    encode_image,
    encode_truth,
    timestamp,
    to_ns,
)
from irsim.recording.output import atomic_file, check_output
from irsim.recording.reader import Recording, open_recording
from irsim.recording.viewer import annotate_truth, display_range, viewer_layout
from irsim.types import Frame, Image, Source, TargetBounds, Truth


def check_default_output(path: Path) -> None:
    """Raise InputError where a file at the default output path exists and could not be rendered again."""
    if not path.exists():
        return
    try:
        rendered = open_recording(path).scenario_text is not None
    except InputError:
        rendered = False
    if not rendered:
        raise InputError(
            f"{path}: exists, was not rendered from a scenario, and would be replaced; allowed: -o with this name or "
            "another"
        )


FRAMES_PER_CHUNK = 2
"""Number of images in a chunk; a small one makes access to a single frame fast."""

PREVIEWS_PER_CHUNK = 16

CURVE_FACTS = ("counts_per_light", "counts_per_root_light", "count_of_no_light")
"""Metadata keys of the image channel for the numbers of `Header.curve`, in which light is in W/m2/sr."""

_JPEG_QUALITY = 85


class RecordingWriter:
    """Writer of frames with their truths, in order. It numbers frames from 0."""

    def __init__(self, file: BinaryIO, header: Header, scenario: str | None, compression: Compression) -> None:
        self._header = header
        self._scenario = scenario
        self._chunks = McapWriter(file, compression)
        self._archived = compression == "archive"
        self._channels: dict[str, int] = {}
        self._images: list[Message] = []
        self._previews: list[Message] = []
        self._small: list[Message] = []
        self._targets: dict[str, TargetEntry] = {}
        self._frames_of: Counter[str] = Counter()
        self._count = 0
        self._agc = AgcSequence(header.agc, header.bits, _no_earlier_frame)

    def add(self, frame: Frame, truth: Truth | None, bounds: Sequence[TargetBounds] | None = None) -> None:
        """Append a frame, its truth, and its bounds if all frames have them. Their index is the number of frames
        written before."""
        image = frame.image
        columns, rows = self._header.size
        if image.shape != (rows, columns) or image.dtype not in (np.uint8, np.uint16):
            raise ValueError(f"expected a {columns}x{rows} uint8 or uint16 frame, got {image.dtype} {image.shape}")
        if (truth is not None) != self._header.has_truth:
            raise ValueError("every frame of a recording has a truth, or none has")
        log_time = to_ns(frame.time)
        if not self._channels:
            self._begin(frame, log_time, bounds is not None)
        if bounds is not None:
            self._put(self._small, BOUNDS, log_time, encode_bounds(bounds, self._count, frame.time))
        if truth is not None:
            truth = dataclasses.replace(truth, index=self._count, time=frame.time)
            for target in truth.targets:
                first = TargetEntry(id=target.id, cls=target.cls, first=truth.index, frames=0)
                self._targets.setdefault(target.id, first)
                self._frames_of[target.id] += 1
            self._put(self._small, TRUTH, log_time, encode_truth(truth))
            self._put(self._small, TRUTH_BOXES, log_time, annotate_truth(truth, log_time))
        encode = encode_archived_image if self._archived else encode_image
        self._put(self._images, IMAGE, log_time, encode(image, log_time))
        picture = self._agc.picture(image, self._count)
        self._put(self._previews, PREVIEW, log_time, encode_preview(picture, log_time))
        self._count += 1
        if len(self._images) == FRAMES_PER_CHUNK:
            self._flush(self._small, self._images)
        if len(self._previews) == PREVIEWS_PER_CHUNK:
            self._flush(self._previews)

    def finish(self, notes: tuple[str, ...] = ()) -> None:
        """Write the remaining messages, the table of contents and the index."""
        self._flush(self._small, self._images, self._previews)
        targets = (each.model_copy(update={"frames": self._frames_of[id]}) for id, each in self._targets.items())
        contents = Contents(frames=self._count, targets=tuple(targets), notes=notes)
        self._chunks.metadata("irsim_contents", contents.to_record())
        self._chunks.finish()

    def _begin(self, frame: Frame, log_time: int, has_bounds: bool) -> None:
        header = self._header
        black, white = display_range(frame.image, header.bits)
        # The header comes first, so that a file that is cut short can be recovered.
        self._chunks.metadata("irsim", header.to_record())
        if self._scenario is not None:
            self._chunks.attachment(SCENARIO, "application/yaml", self._scenario.encode())
        self._chunks.attachment(LAYOUT, "application/json", viewer_layout(black, white, header.has_truth))

        facts: dict[str, Any] = {"bits": header.bits, "display_low": black, "display_high": white, "band": header.band}
        if header.range_k is not None:
            facts |= {"count_0_k": header.range_k[0], "full_scale_k": header.range_k[1]}
        if header.curve is not None:
            facts |= dict(zip(CURVE_FACTS, header.curve, strict=True))
        known = {key: str(value) for key, value in facts.items() if value is not None}
        kind = CompressedImage if self._archived else RawImage
        self._channels[IMAGE] = self._chunks.topic(IMAGE, kind.DESCRIPTOR, known)
        self._channels[PREVIEW] = self._chunks.topic(PREVIEW, CompressedImage.DESCRIPTOR)
        if header.has_truth:
            self._channels[TRUTH] = self._chunks.topic(TRUTH, TRUTH_DESCRIPTOR)
            self._channels[TRUTH_BOXES] = self._chunks.topic(TRUTH_BOXES, ImageAnnotations.DESCRIPTOR)
        if has_bounds:
            self._channels[BOUNDS] = self._chunks.topic(BOUNDS, BOUNDS_DESCRIPTOR)
        if header.ifov_rad is not None:
            self._channels[CAMERA] = self._chunks.topic(CAMERA, CameraCalibration.DESCRIPTOR)
            self._put(self._small, CAMERA, log_time, encode_calibration(header.size, header.ifov_rad, log_time))

    def _put(self, pending: list[Message], topic: str, log_time: int, data: bytes) -> None:
        pending.append(Message(self._channels[topic], self._count, log_time, data))

    def _flush(self, *groups: list[Message]) -> None:
        """Write each group as a chunk. Truths precede images, so that each image in a file cut short has its truth."""
        for pending in groups:
            if pending:
                self._chunks.chunk(pending)
                pending.clear()


def _no_earlier_frame(index: int) -> Image:
    raise AssertionError(f"frame {index} is written after a later one")


def encode_preview(picture: np.ndarray, log_time: int) -> bytes:
    """Return the bytes of a foxglove.CompressedImage with a picture as JPEG."""
    _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return CompressedImage(
        timestamp=timestamp(log_time), frame_id=OPTICAL_FRAME, format="jpeg", data=jpeg.tobytes()
    ).SerializeToString()


def encode_calibration(size: tuple[int, int], ifov_rad: float, log_time: int) -> bytes:
    """Return a CameraCalibration of a pinhole camera without distortion, with focal length 1 / IFOV px."""
    focal, x, y = 1 / ifov_rad, (size[0] - 1) / 2, (size[1] - 1) / 2
    return CameraCalibration(
        timestamp=timestamp(log_time),
        frame_id=OPTICAL_FRAME,
        width=size[0],
        height=size[1],
        K=[focal, 0, x, 0, focal, y, 0, 0, 1],
        R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
        P=[focal, 0, x, 0, 0, focal, y, 0, 0, 0, 1, 0],
    ).SerializeToString()


@contextmanager
def writing(
    path: Path, header: Header, scenario: str | None = None, compression: Compression = "none"
) -> Iterator[RecordingWriter]:
    """Open a writer for a block that must end with `finish`. The file appears at `path` after the block.

    Raises InputError for an unknown compression.
    """
    allowed = get_args(Compression)
    if not isinstance(compression, str) or compression not in allowed:
        raise InputError(f"compression {compression!r}: allowed: {', '.join(allowed)}")
    if compression == "archive":
        codec()
    with atomic_file(path, tidy=True) as file:
        yield RecordingWriter(file, header, scenario, compression)


def record(
    source: Source,
    path: str | Path,
    start: int = 0,
    stop: int | None = None,
    jobs: int = 1,
    progress: Callable[[int], None] | None = None,
    compression: Compression = "none",
    bounds: Callable[[int], Sequence[TargetBounds]] | None = None,
) -> Path:
    """Write frames start .. stop-1 of a source as a recording and return its path.

    jobs      number of processes that render, where the source supports it
    progress  called with the number of frames done
    bounds    returns the bounds of the source's frame of an index, such as `irsim.FrameBounds(scenario).of`; by
              default those of a recording that holds them

    The recording numbers frames from 0 and keeps their times. Raises InputError where the source lacks some of the
    frames, for an unknown compression, and where the file cannot be written.
    """
    path = path_of(path)
    expect_source("a record", source)
    check_output(path, *source.needs)
    start, stop = whole_number("start", start), whole_number("stop", len(source) if stop is None else stop)
    whole_number("jobs", jobs, 1)
    if not 0 <= start < stop <= len(source):
        raise InputError(f"{source.name}: there are no frames {start}:{stop}; allowed: within 0:{len(source)}")
    if bounds is None and isinstance(source, Recording) and source.has_bounds:
        kept = source

        def bounds(index: int) -> Sequence[TargetBounds]:
            return next(kept.bounds(index, index + 1))

    with writing(path, header_of(source, start), source.scenario_text, compression) as writer:
        for done, (frame, truth) in enumerate(source.pairs(start, stop, jobs), 1):
            writer.add(frame, truth, None if bounds is None else bounds(start + done - 1))
            if progress is not None:
                progress(done)
        writer.finish()
    return path


def header_of(source: Source, start: int = 0) -> Header:
    """Return the header of a recording of `source` that begins with its frame `start`."""
    if isinstance(source, Recording):
        return source.header.model_copy(update={"first_frame": source.header.first_frame + start})
    from irsim import __version__

    camera = source.camera
    return Header(
        version=__version__,
        name=source.name,
        source_hash=source.hash,
        input="rendered",
        size=source.size,
        bits=source.bits,
        rate_hz=source.rate_hz,
        follow=source.follow,
        has_truth=source.has_truth,
        agc=source.agc if isinstance(source.agc, Agc) else default_agc(source.bits),
        first_frame=start,
        ifov_rad=camera.ifov_rad,
        band=None if camera.band is None else band_text(camera.band),
        range_k=camera.range_k,
        curve=camera.curve,
    )


def default_agc(bits: int) -> Agc:
    """Return the AGC of counts for which none is given: none for 8 bits, linear for more."""
    agc = AGCS.parse({"kind": "none" if bits <= 8 else "linear"})
    assert isinstance(agc, Agc)
    return agc
