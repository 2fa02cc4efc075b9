"""Damaged recordings: damage is named, intact frames are recovered and rendered again by their scenario."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer
from recording_fakes import Noise, same_frames
from typer.testing import CliRunner

import irsim
from irsim.camera import AGCS
from irsim.cli.app import app
from irsim.errors import InputError
from irsim.recording import Recording, damages, open_recording, record, recover
from irsim.recording.writer import header_of, writing
from irsim.render.sources import open_rendering
from irsim.render.stream import Rendering

SCENE = """
frames: 12
seed: 5
camera: {size: [48, 40], ifov_mrad: 1}
background: {kind: sky}
targets: [{id: jet, shape: {kind: point, area_m2: 9}, path: {kind: straight, start: [8, 20], speed: 2, range_m: 900}}]
"""
DROPS = "camera.faults=[{kind: drop, frames: [1, 6]}, {kind: duplicate, frames: [4]}]"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(Noise(), tmp_path_factory.mktemp("rec") / "noise.mcap")


def refused(path: Path) -> str:
    """Return the one line of the error of opening a file."""
    with pytest.raises(InputError) as error:
        open_recording(path)
    text = str(error.value)
    assert "\n" not in text
    assert str(path) in text
    return text


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "no such file"), (b"", "is empty"), (b"PK\x03\x04 something else", "not an MCAP file")],
)
def test_files_that_are_not_recordings(tmp_path: Path, content: bytes | None, message: str) -> None:
    path = tmp_path / "x.mcap"
    if content is not None:
        path.write_bytes(content)
    assert message in refused(path)
    assert "is a folder" in refused(tmp_path)


def test_mcap_of_another_program(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_message(writer.register_channel("/x", "json", 0), 0, b"{}", 0)
        writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
    assert "is MCAP but not a recording of irsim" in refused(path)
    with pytest.raises(InputError, match="is MCAP but not a recording of irsim"):
        recover(path, tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()


@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_every_flipped_byte_is_detected(recorded: Path, data: st.DataObject) -> None:
    """Frames, truth and facts are those written, or an InputError is raised; `damages` names the damage."""
    whole = recorded.read_bytes()
    at, flipped = data.draw(st.integers(0, len(whole) - 1)), data.draw(st.integers(1, 255))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "flipped.mcap")
        path.write_bytes(whole[:at] + bytes([whole[at] ^ flipped]) + whole[at + 1 :])
        with suppress(InputError):
            recording = open_recording(path)
            assert list(damages(recording))
            assert (recording.follow, recording.agc) == ("dot", AGCS.parse({"kind": "linear"}))
            truths, frames = list(recording.truths()), list(recording.frames())
            assert truths == list(Noise().truths())
            assert same_frames(iter(frames), Noise().frames())


def test_an_intact_recording_has_no_damage(recorded: Path) -> None:
    assert not list(damages(open_recording(recorded)))


def test_every_intact_frame_of_a_cut_file_is_recovered(tmp_path: Path, recorded: Path) -> None:
    data = recorded.read_bytes()
    path, out = tmp_path / "cut.mcap", tmp_path / "out.mcap"
    kept = set()
    for length in np.linspace(1, len(data) - 1, 30).astype(int):
        path.write_bytes(data[:length])
        assert refused(path).endswith(f"; irsim import {path} -o NEW.mcap keeps what is whole")
        try:
            rescued = open_recording(recover(path, out))
        except InputError:
            assert not out.exists()
            continue
        kept.add(len(rescued))
        assert same_frames(rescued.frames(), Noise().frames(stop=len(rescued)))
        assert list(rescued.truths()) == list(Noise().truths(stop=len(rescued)))
        out.unlink()
    assert kept == {2, 4, 6, 7}  # intact chunks of two frames, and the last


def test_frames_after_a_damaged_chunk_are_recovered(tmp_path: Path, recorded: Path) -> None:
    data = bytearray(recorded.read_bytes())
    data[data.find(Noise().frame(2).image.tobytes()) + 10] ^= 1
    path = tmp_path / "broken.mcap"
    path.write_bytes(data)
    recording = open_recording(path)
    assert list(damages(recording)) == ["frames 2 to 3"]
    assert same_frames(recording.frames(stop=2), Noise().frames(stop=2))
    with pytest.raises(InputError, match=r"broken\.mcap: damaged: .* does not match its CRC"):
        recording.frame(2)
    rescued = open_recording(recover(path, tmp_path / "out.mcap"))
    assert [round(frame.time * 30) for frame in rescued.frames()] == [0, 1, 4, 5, 6]
    assert [frame.index for frame in rescued.frames()] == [0, 1, 2, 3, 4]
    assert rescued.contents.notes == ("5 of 7 frames recovered from broken.mcap",)


def test_frames_outlast_any_damage_of_the_metadata(tmp_path: Path, recorded: Path) -> None:
    whole, path = recorded.read_bytes(), tmp_path / "broken.mcap"
    entry = next(each for each in open_recording(recorded).mcap.metadata_index if each.name == "irsim")
    for at in range(entry.offset, entry.offset + entry.length, 29):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << at % 8]) + whole[at + 1 :])
        if at - entry.offset < 9:  # opcode and length, which the index states, too
            assert len(open_recording(path)) == 7
            continue
        assert f"irsim import {path} -o NEW.mcap keeps what is whole" in refused(path)
        rescued = open_recording(recover(path, tmp_path / "out.mcap"))
        assert same_frames(rescued.frames(), Noise().frames())
        assert list(rescued.truths()) == list(Noise().truths())
        assert "its metadata was lost" in rescued.contents.notes[-1]
        assert (rescued.bits, rescued.rate_hz, rescued.size) == (14, 30.0, Noise().size)


def test_bytes_after_the_end_are_reported(tmp_path: Path, recorded: Path) -> None:
    path = tmp_path / "longer.mcap"
    path.write_bytes(recorded.read_bytes() + b"junk")
    assert "longer.mcap: damaged: 4 bytes of something else after its end; " in refused(path)
    assert len(open_recording(recover(path, tmp_path / "out.mcap"))) == len(Noise())


def damaged(folder: Path, lost: int, *overrides: str, start: int = 0) -> Path:
    """Return the recovered recording of the scene after damage of the chunk of frame `lost`."""
    path = record(Rendering(irsim.loads(SCENE, overrides=overrides)), folder / "whole.mcap", start)
    data = bytearray(path.read_bytes())
    data[data.find(open_recording(path).frame(lost).image.tobytes()) + 10] ^= 1
    broken = folder / "broken.mcap"
    broken.write_bytes(data)
    return recover(broken, folder / "left.mcap")


def times(recording: Recording) -> list[float]:
    return [frame.time for frame in recording.frames()]


@pytest.mark.parametrize(("overrides", "start"), [((), 0), ((DROPS,), 3)])
def test_a_recovered_end_is_rendered_again(tmp_path: Path, overrides: tuple[str, ...], start: int) -> None:
    left = damaged(tmp_path, 0, *overrides, start=start)
    recording = open_recording(left)
    assert recording.header.first_frame == start + 2
    rendering, first, stop = open_rendering(left)
    again = list(rendering.pairs(first, stop))
    assert [frame.time for frame, _ in again] == times(recording)
    assert all((one.image == other.image).all() for (one, _), other in zip(again, recording.frames(), strict=True))


@pytest.mark.parametrize("overrides", [(), (DROPS,)])
def test_rendering_with_lost_frames_is_refused(tmp_path: Path, overrides: tuple[str, ...]) -> None:
    left = damaged(tmp_path, 6, *overrides)
    assert len(times(open_recording(left))) == (10 if not overrides else 9)
    for command in (["masks"], ["render", "seed=7"]):
        done = CliRunner().invoke(app, [command[0], str(left), *command[1:], "-o", str(tmp_path / "again.mcap")])
        assert isinstance(done.exception, InputError)
        message = str(done.exception)
        assert message.startswith(f"{left}: frame 6 was taken at ")
        assert message.endswith("allowed: a recording of all frames from its first to its last, or the scenario itself")
        assert "\n" not in message


def test_a_wrong_first_frame_is_refused(tmp_path: Path) -> None:
    source = Rendering(irsim.loads(SCENE))
    path = tmp_path / "late.mcap"
    with writing(path, header_of(source), source.scenario_text) as writer:
        for frame, truth in source.pairs(2, 4):
            writer.add(frame, truth)
        writer.finish()
    with pytest.raises(InputError, match=r"late\.mcap: frame 0 was taken at 0\.0666667 s, its scenario's at 0 s"):
        open_rendering(path)


def test_frames_that_the_scenario_drops_are_not_lost(tmp_path: Path) -> None:
    """Nor where overrides drop other frames, or none, or shorten the scenario."""
    path = record(Rendering(irsim.loads(SCENE, overrides=[DROPS])), tmp_path / "a.mcap", 2)
    for change in ([], ["camera.faults=[]"], ["frames=9"], ["camera.rate_hz=25"]):
        rendering, start, stop = open_rendering(path, change)
        assert (start, stop) == (2, min(11, len(rendering)))


def test_bounds_of_intact_frames_are_kept(tmp_path: Path) -> None:
    """In a recovered recording, in a copied one and in a part of one."""
    rendering = Rendering(irsim.loads(SCENE))
    path = record(rendering, tmp_path / "bounded.mcap", bounds=irsim.FrameBounds(rendering.scenario).of)
    whole = list(open_recording(path).bounds())
    assert [len(rows) for rows in whole] == [1] * 12
    assert list(open_recording(irsim.import_frames(path, tmp_path / "copy.mcap")).bounds()) == whole
    part = open_recording(record(open_recording(path), tmp_path / "part.mcap", 3, 7))
    assert [(row.index, row.sd_x) for (row,) in part.bounds()] == [(k - 3, whole[k][0].sd_x) for k in range(3, 7)]
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    rescued = open_recording(recover(cut, tmp_path / "rescued.mcap"))
    assert 0 < len(rescued) < 12
    assert list(rescued.bounds()) == whole[: len(rescued)]
