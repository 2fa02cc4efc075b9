"""Reading a recording: frames by index or in order, truths apart."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn

from irsim.camera.agc import Agc, AgcSequence
from irsim.config.paths import path_of
from irsim.errors import InputError, counted, frame_number
from irsim.notebook import source_card, source_line
from irsim.recording.container import Container, Lane, Packet, open_container
from irsim.recording.header import Contents, Header
from irsim.recording.messages import IMAGE, SCENARIO, TRUTH, band_of, decode_image, decode_truth, from_ns
from irsim.types import CameraFacts, Frame, Input, Source, Truth, expect_input, frame_range

_HASH_BLOCK = 1 << 20


@dataclass(frozen=True, eq=False)
class Recording(Source):
    """A recording as a Source. A value: it holds no open file, and pickles.

    Frame k is the k-th in the file. Images are read-only.
    """

    path: Path
    header: Header
    contents: Contents
    container: Container

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
        return CameraFacts(header.ifov_rad, band_of(header.band or ""), header.range_k, header.curve)

    @property
    def name(self) -> str:
        """The file's stem."""
        return self.path.stem

    @cached_property
    def hash(self) -> str:
        """BLAKE2b of the file's bytes."""
        digest = hashlib.blake2b(digest_size=16)
        with self.container.open() as file:
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
        """Ids of all targets, in the order of their appearance."""
        return tuple(target.id for target in self.contents.targets)

    @property
    def follow(self) -> str | None:
        return self.header.follow or next(iter(self.targets), None)

    @cached_property
    def scenario_text(self) -> str | None:
        """The scenario that was rendered, as YAML; None for imported frames."""
        text = self.container.attachment(SCENARIO)
        with self.container.decoded("the scenario in it is no text"):
            return None if text is None else text.decode()

    def __len__(self) -> int:
        return self.contents.frames

    def frame(self, index: int, input: Input = "counts") -> Frame:
        """Frame `index`. IndexError where there is none, DamageError where its bytes are not what was written.

        InputError for another `input` than 'counts' and 'display', and for what is no whole number.
        """
        index = frame_number(index, len(self), str(self.path))
        return next(self.frames(input, index, index + 1))

    def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Frames start .. stop-1 in order, as detector counts or as the 8-bit picture.

        InputError for another `input`, and for a start or a stop below 0.
        """
        expect_input(input)
        screen = AgcSequence(self.agc, self.bits, lambda index: self.frame(index).image)
        for index, packet in self._packets(IMAGE, start, stop):
            with self.container.decoded(f"frame {index} cannot be read"):
                image = decode_image(packet.data, self.size)
            frame = Frame(image, index, from_ns(packet.log_time, self.rate_hz), self.bits)
            yield screen.display(frame) if input == "display" else frame

    def truths(self, start: int = 0, stop: int | None = None) -> Iterator[Truth]:
        """Truths of the same frames; nothing where there is no truth."""
        if not self.has_truth:
            return
        for index, packet in self._packets(TRUTH, start, stop):
            with self.container.decoded(f"the truth of frame {index} cannot be read"):
                truth = decode_truth(packet.data, index, from_ns(packet.log_time, self.rate_hz))
            yield truth

    def truth(self, index: int) -> Truth | None:
        """The truth of frame `index`; None where there is no truth. Wrong numbers as of `frame`."""
        index = frame_number(index, len(self), str(self.path))
        return next(self.truths(index, index + 1), None)

    def info(self) -> dict[str, Any]:
        """Facts about the recording, ready for JSON; `topics` counts the messages of each."""
        stated = self.header.model_dump(mode="json", exclude_none=True)
        kept = self.contents.model_dump(mode="json", exclude_none=True)
        return {
            "path": str(self.path),
            "bytes": self.path.stat().st_size,
            "hash": self.hash,
            "duration_s": self._duration_s(),
            **stated,
            **kept,
            "topics": {topic: len(lane) for topic, lane in self.container.lanes.items()},
        }

    def indexed_times(self) -> Iterator[tuple[int, float]]:
        """(frame, its time in s) of the first and the last frame of each chunk, as the index has them: nothing else is
        read. Frames between are left out, and chunks in which another program put other topics, too, whose times are
        those of all."""
        lane, begin = self._lane(IMAGE), 0
        for chunk, end in zip(lane.chunks, lane.ends.tolist(), strict=True):
            if len(chunk.message_index_offsets) == 1:
                yield begin, from_ns(chunk.message_start_time, self.rate_hz)
                yield end - 1, from_ns(chunk.message_end_time, self.rate_hz)
            begin = end

    def _duration_s(self) -> float:
        """From the first frame to the last, both counted; longer than frames / rate where frames were dropped."""
        chunks = self._lane(IMAGE).chunks
        between = max(chunk.message_end_time for chunk in chunks) - min(chunk.message_start_time for chunk in chunks)
        return between / 1e9 + 1 / self.rate_hz

    def _packets(self, topic: str, start: int, stop: int | None) -> Iterator[tuple[int, Packet]]:
        wanted = frame_range(start, stop, len(self))
        if not wanted:
            return
        lane = self._lane(topic)
        with self.container.open() as file:
            index = start
            for chunk in range(lane.chunk_of(start), len(lane.chunks)):
                for packet in self.container.packets(file, lane, chunk):
                    if packet.sequence < index:
                        continue
                    if packet.sequence > index:
                        self._damaged(index)
                    yield index, packet
                    index += 1
                    if index == wanted.stop:
                        return
        self._damaged(index)

    def _lane(self, topic: str) -> Lane:
        lane = self.container.lanes.get(topic)
        if lane is None or len(lane) != len(self):
            raise self.container.damage(
                f"{topic} has {counted(len(lane or ()), 'message')} for {counted(len(self), 'frame')}"
            )
        return lane

    def _damaged(self, index: int) -> NoReturn:
        raise self.container.damage(f"frame {index} is not where it should be")


def open_recording(path: str | Path) -> Recording:
    """Open a recording and check its index and metadata; a frame is checked when it is read.

    InputError, one line with the file's name, where there is no such file, or it is empty, cut short,
    damaged, not MCAP, or not a recording of irsim.
    """
    path = path_of(path)
    container = open_container(path, remedy=f"irsim import {shlex.quote(str(path))} -o NEW.mcap keeps what is whole")
    metadata = container.metadata
    if "irsim" not in metadata:
        what = (
            "holds a track, not frames (a viewer shows it beside its recording)"
            if "irsim_track" in metadata
            else "has no metadata record 'irsim'"
        )
        raise InputError(f"{path}: is MCAP but not a recording of irsim: it {what}")
    try:
        return Recording(
            path,
            Header.unseal(metadata["irsim"]),
            Contents.unseal(metadata.get("irsim_contents", {})),
            container,
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
