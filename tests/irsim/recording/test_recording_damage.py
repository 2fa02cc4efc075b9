"""Files that are not recordings, damaged recordings, and recordings whose writing fails."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer
from recording_fakes import Noise, same_frames

from irsim.camera import AGCS
from irsim.errors import InputError
from irsim.recording import (
    damages,
    open_recording,
    record,
    recover,
)
from irsim.types import Frame, Input


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(Noise(), tmp_path_factory.mktemp("rec") / "noise.mcap")


def one_line(error: pytest.ExceptionInfo[InputError], path: Path) -> str:
    """Return the message, which is one line with the file's name."""
    text = str(error.value)
    assert "\n" not in text
    assert str(path) in text
    return text


@pytest.mark.parametrize(
    ("content", "says"),
    [(None, "no such file"), (b"", "is empty"), (b"PK\x03\x04 something else", "not an MCAP file")],
)
def test_files_that_are_not_recordings(tmp_path: Path, content: bytes | None, says: str) -> None:
    path = tmp_path / "x.mcap"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError) as error:
        open_recording(path)
    assert says in one_line(error, path)


@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_every_flipped_byte_is_detected(recorded: Path, data: st.DataObject) -> None:
    whole = recorded.read_bytes()
    assert not list(damages(open_recording(recorded)))
    at = data.draw(st.integers(0, len(whole) - 1))
    flipped = data.draw(st.integers(1, 255))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "flipped.mcap")
        path.write_bytes(whole[:at] + bytes([whole[at] ^ flipped]) + whole[at + 1 :])
        with suppress(InputError):  # what is opened first is checked first
            assert list(damages(open_recording(path)))


def test_mcap_of_another_program(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/x", "json", 0)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
    for read in (open_recording, lambda path: recover(path, tmp_path / "out.mcap")):
        with pytest.raises(InputError, match="is MCAP but not a recording of irsim") as error:
            read(path)
        one_line(error, path)
    assert not (tmp_path / "out.mcap").exists()
    with pytest.raises(InputError, match="is a folder"):
        open_recording(tmp_path)


def test_every_intact_frame_of_a_cut_file_is_recovered(tmp_path: Path, recorded: Path) -> None:
    data = recorded.read_bytes()
    path, out = tmp_path / "cut.mcap", tmp_path / "out.mcap"
    kept = set()
    for length in np.linspace(1, len(data) - 1, 60).astype(int):
        path.write_bytes(data[:length])
        with pytest.raises(InputError) as error:
            open_recording(path)
        text = one_line(error, path)
        assert text.endswith(f"; irsim import {path} -o NEW.mcap keeps what is whole")
        try:
            rescued = open_recording(recover(path, out))
        except InputError:
            assert not out.exists()
            continue
        left = len(rescued)
        kept.add(left)
        assert same_frames(rescued.frames(), Noise().frames(stop=left))
        assert list(rescued.truths()) == list(Noise().truths(stop=left))
        out.unlink()
    assert kept == {2, 4, 6, 7}  # intact chunks of two frames, and the last


def test_a_flipped_byte_is_an_error_or_changes_nothing(tmp_path: Path, recorded: Path) -> None:
    data = recorded.read_bytes()
    path = tmp_path / "flipped.mcap"
    rng = np.random.default_rng(1)
    errors: list[str] = []
    for position in np.sort(rng.choice(len(data), 300, replace=False)):
        damaged = bytearray(data)
        damaged[position] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            recording = open_recording(path)
            frames, truths = list(recording.frames()), list(recording.truths())
            facts = (recording.follow, recording.agc, recording.targets)
        except InputError as error:
            errors.append(str(error))
        else:
            assert same_frames(iter(frames), Noise().frames())
            assert truths == list(Noise().truths())
            assert facts == ("dot", AGCS.parse({"kind": "linear"}), ("jet", "dot"))
    assert len(errors) > 75
    assert not any("\n" in text for text in errors)


def test_frames_after_a_damaged_chunk_are_recovered(tmp_path: Path, recorded: Path) -> None:
    data = bytearray(recorded.read_bytes())
    needle = Noise().frame(2).image.tobytes()
    data[data.find(needle) + 10] ^= 1
    path = tmp_path / "broken.mcap"
    path.write_bytes(data)
    recording = open_recording(path)
    assert same_frames(recording.frames(stop=2), Noise().frames(stop=2))
    with pytest.raises(InputError, match="does not match its CRC") as error:
        recording.frame(2)
    one_line(error, path)
    rescued = open_recording(recover(path, tmp_path / "out.mcap"))
    assert [round(frame.time * 30) for frame in rescued.frames()] == [0, 1, 4, 5, 6]
    assert [frame.index for frame in rescued.frames()] == [0, 1, 2, 3, 4]
    assert rescued.contents.notes == ("5 of 7 frames recovered from broken.mcap",)


def test_bytes_after_the_end_are_reported(tmp_path: Path, recorded: Path) -> None:
    path = tmp_path / "longer.mcap"
    path.write_bytes(recorded.read_bytes() + b"junk")
    with pytest.raises(InputError, match=r"longer\.mcap: damaged: 4 bytes of something else after its end; ") as error:
        open_recording(path)
    one_line(error, path)
    assert len(open_recording(recover(path, tmp_path / "out.mcap"))) == len(Noise())


def test_inputs_are_not_overwritten(tmp_path: Path, recorded: Path) -> None:
    before = recorded.read_bytes()
    with pytest.raises(InputError, match="would replace"):
        record(open_recording(recorded), recorded)
    with pytest.raises(InputError, match="would replace"):
        recover(recorded, recorded)
    assert recorded.read_bytes() == before


def test_outputs_are_checked_before_any_work(tmp_path: Path) -> None:
    class Untouched(Noise):
        def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
            raise AssertionError("worked before the output was checked")

    with pytest.raises(InputError, match="does not exist"):
        record(Untouched(), tmp_path / "nowhere" / "r.mcap")
    with pytest.raises(InputError, match="is a folder"):
        record(Untouched(), tmp_path)
    for start, stop, allowed in (
        (0, 8, "within 0:7"),
        (3, 3, "within 0:7"),
        (-1, 2, "0 or more"),
        (7, None, "within 0:7"),
    ):
        with pytest.raises(InputError, match=f"allowed: {allowed}"):
            record(Untouched(), tmp_path / "r.mcap", start, stop)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_recording_keeps_the_old_file(tmp_path: Path) -> None:
    class Breaks(Noise):
        def frame(self, index: int, input: Input = "counts") -> Frame:
            if index == 4:
                raise RuntimeError("no frame")
            return super().frame(index)

    path = tmp_path / "r.mcap"
    path.write_bytes(b"old")
    with pytest.raises(RuntimeError, match="no frame"):
        record(Breaks(), path)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == b"old"


def test_frames_of_another_size_are_refused(tmp_path: Path) -> None:
    class Changes(Noise):
        def frame(self, index: int, input: Input = "counts") -> Frame:
            return replace(super().frame(index), image=np.zeros((24, 30 + 2 * (index < 3)), np.uint16))

    with pytest.raises(ValueError, match="expected a 32x24"):
        record(Changes(), tmp_path / "r.mcap")
    assert list(tmp_path.iterdir()) == []
