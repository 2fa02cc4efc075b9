"""Recording as a source of frames and truths, in order or by index."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from irsim.camera.agc import Agc, AgcSequence
from irsim.config.paths import path_of
from irsim.errors import InputError, counted, frame_number
from irsim.notebook import source_card, source_line
from irsim.recording.bounds_messages import decode_bounds
from irsim.recording.header import Contents, DigestError, Header
from irsim.recording.mcap_reader import McapFile, TopicIndex, open_mcap
from irsim.recording.mcap_records import Packet
from irsim.recording.messages import BOUNDS, IMAGE, SCENARIO, TRUTH, decode_image, decode_truth, from_ns, parse_band
from irsim.types import CameraFacts, Frame, Input, Source, TargetBounds, Truth, expect_input, frame_range

_HASH_BLOCK = 1 << 20


@dataclass(frozen=True, eq=False)
class Recording(Source):
    """Recording as a Source with read-only images. It keeps no file open and can be pickled."""

    path: Path
    header: Header
    contents: Contents
    mcap: McapFile

    def __repr__(self) -> str:
        return source_line(self, f"truth of {', '.join(self.targets) or 'no target'}" if self.has_truth else "no truth")

    def _repr_html_(self) -> str:
        return source_card(self)

    @property
    def file(self) -> Path:
        return self.path

    @property
    def camera(self) -> CameraFacts:
        header = self.header
        return CameraFacts(header.ifov_rad, parse_band(header.band or ""), header.range_k, header.curve)

    @property
    def name(self) -> str:
        """Stem of the file's name."""
        return self.path.stem

    @cached_property
    def hash(self) -> str:
        """BLAKE2b digest of the file's bytes."""
        digest = hashlib.blake2b(digest_size=16)
        with self.mcap.open() as file:
            while block := file.read(_HASH_BLOCK):
                digest.update(block)
        return digest.hexdigest()

    @property
    def size(self) -> tuple[int, int]:
        return self.header.size

    @property
    def bits(self) -> int:
        return self.header.bits

    @property
    def rate_hz(self) -> float:
        return self.header.rate_hz

    @property
    def agc(self) -> Agc:
        return self.header.agc

    @property
    def has_truth(self) -> bool:
        return self.header.has_truth

    @property
    def targets(self) -> tuple[str, ...]:
        """Ids of all targets, in the order of their first frames."""
        return tuple(target.id for target in self.contents.targets)

    @property
    def follow(self) -> str | None:
        return self.header.follow or next(iter(self.targets), None)

    @cached_property
    def scenario_text(self) -> str | None:
        """Rendered scenario as YAML; None for imported frames."""
        text = self.mcap.attachment(SCENARIO)
        with self.mcap.decoding("the scenario in it is no text"):
            return None if text is None else text.decode()

    def __len__(self) -> int:
        return self.contents.frames

    def frame(self, index: int, input: Input = "counts") -> Frame:
        """Return frame `index`. Raises IndexError where it does not exist, DamageError where it is damaged.

        Raises InputError for an `input` other than 'counts' and 'display', and for an index that is not a whole number.
        """
        index = frame_number(index, len(self), str(self.path))
        return next(self.frames(input, index, index + 1))

    def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Yield frames start .. stop-1 in order, as counts or as the 8-bit display.

        Raises InputError for another `input`, and for a start or a stop below 0.
        """
        expect_input(input)
        agc = AgcSequence(self.agc, self.bits, lambda index: self.frame(index).image)
        for index, packet in self._packets(IMAGE, start, stop):
            with self.mcap.decoding(f"frame {index} cannot be read"):
                image = decode_image(packet.data, self.size)
            frame = Frame(image, index, from_ns(packet.log_time, self.rate_hz), self.bits)
            yield agc.display(frame) if input == "display" else frame

    def truths(self, start: int = 0, stop: int | None = None) -> Iterator[Truth]:
        """Yield the truths of frames start .. stop-1; none if the recording has no truth."""
        if not self.has_truth:
            return
        for index, packet in self._packets(TRUTH, start, stop):
            with self.mcap.decoding(f"the truth of frame {index} cannot be read"):
                truth = decode_truth(packet.data, index, from_ns(packet.log_time, self.rate_hz))
            yield truth

    def truth(self, index: int) -> Truth | None:
        """Return the truth of frame `index`; None if the recording has no truth. Raises errors as in `frame`."""
        index = frame_number(index, len(self), str(self.path))
        return next(self.truths(index, index + 1), None)

    @property
    def has_bounds(self) -> bool:
        """True where the recording holds bounds of its targets."""
        return BOUNDS in self.mcap.topics

    def bounds(self, start: int = 0, stop: int | None = None) -> Iterator[tuple[TargetBounds, ...]]:
        """Yield the bounds of frames start .. stop-1, as `irsim.bounds` of each; none if the recording has none."""
        if not self.has_bounds:
            return
        for index, packet in self._packets(BOUNDS, start, stop):
            with self.mcap.decoding(f"the bounds of frame {index} cannot be read"):
                found = decode_bounds(packet.data, index)
            yield found

    def info(self) -> dict[str, Any]:
        """Return facts about the recording as JSON values, with the number of messages of each topic."""
        return {
            "path": str(self.path),
            "bytes": self.path.stat().st_size,
            "hash": self.hash,
            "duration_s": self._duration_s(),
            **self.header.model_dump(mode="json", exclude_none=True),
            **self.contents.model_dump(mode="json", exclude_none=True),
            "topics": {topic: len(index) for topic, index in self.mcap.topics.items()},
        }

    def indexed_times(self) -> Iterator[tuple[int, float]]:
        """Yield (frame index, time in s) of the first and last frame of each chunk of images, from the file's index.

        Chunks with several topics, which other programs write, are left out, as their times are not those of images.
        """
        topic_index, begin = self._topic_index(IMAGE), 0
        for chunk, end in zip(topic_index.chunks, topic_index.ends.tolist(), strict=True):
            if len(chunk.message_index_offsets) == 1:
                yield begin, from_ns(chunk.message_start_time, self.rate_hz)
                yield end - 1, from_ns(chunk.message_end_time, self.rate_hz)
            begin = end

    def _duration_s(self) -> float:
        """Return the duration, s, from the first frame to the end of the last one."""
        chunks = self._topic_index(IMAGE).chunks
        between = max(chunk.message_end_time for chunk in chunks) - min(chunk.message_start_time for chunk in chunks)
        return between / 1e9 + 1 / self.rate_hz

    def _packets(self, topic: str, start: int, stop: int | None) -> Iterator[tuple[int, Packet]]:
        wanted = frame_range(start, stop, len(self))
        if not wanted:
            return
        topic_index = self._topic_index(topic)
        with self.mcap.open() as file:
            index = start
            for chunk in range(topic_index.chunk_of(start), len(topic_index.chunks)):
                for packet in self.mcap.packets(file, topic_index, chunk):
                    if packet.sequence < index:
                        continue
                    if packet.sequence > index:
                        raise self._missing(index)
                    yield index, packet
                    index += 1
                    if index == wanted.stop:
                        return
        raise self._missing(index)

    def _topic_index(self, topic: str) -> TopicIndex:
        topic_index = self.mcap.topics.get(topic)
        if topic_index is None or len(topic_index) != len(self):
            raise self.mcap.damage_error(
                f"{topic} has {counted(len(topic_index or ()), 'message')} for {counted(len(self), 'frame')}"
            )
        return topic_index

    def _missing(self, index: int) -> InputError:
        return self.mcap.damage_error(f"frame {index} is missing")


def open_recording(path: str | Path) -> Recording:
    """Open a recording and check its index and metadata. Frames are checked when they are read.

    Raises InputError where the file is missing, cut short, damaged, not MCAP, or not a recording of irsim.
    """
    path = path_of(path)
    mcap = open_mcap(path, remedy=f"irsim import {shlex.quote(str(path))} -o NEW.mcap keeps what is whole")
    metadata = mcap.metadata
    if "irsim" not in metadata:
        if any(entry.name == "irsim" for entry in mcap.metadata_index):
            raise mcap.damage_error("its metadata cannot be read")
        problem = (
            "holds a track, not frames (a viewer shows it beside its recording)"
            if "irsim_track" in metadata
            else "has no metadata record 'irsim'; irsim import makes one of its images"
        )
        raise InputError(f"{path}: is MCAP but not a recording of irsim: it {problem}")
    try:
        header, contents = Header.from_record(metadata["irsim"]), metadata.get("irsim_contents", {})
        return Recording(path, header, Contents.from_record(contents), mcap)
    except DigestError:
        raise mcap.damage_error("its metadata does not match its digest") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
