"""Forged recordings: one clear line, no code is run, memory is bounded."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from recording_fakes import Noise, same_frames
from recording_forge import SOURCE, forge, honest_image, honest_truth
from typer.testing import CliRunner

from irsim.cli.app import app
from irsim.errors import InputError
from irsim.recording import open_recording, record, recover
from irsim.recording.mcap_records import unpack
from irsim.recording.mcap_writer import McapWriter, Message
from irsim.recording.messages import TRACK_STATE, TrackStateMessage, TruthMessage
from irsim.recording.tracks import TrackHeader, read_tracks


def read_all(path: Path) -> None:
    recording = open_recording(path)
    list(recording.frames("display"))
    list(recording.truths())
    _ = recording.scenario_text


def refused(path: Path) -> str:
    """Return the one line of the error of reading all of a recording."""
    with pytest.raises(InputError) as caught:
        read_all(path)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(f"{path}: ")
    return text


def not_recovered(path: Path) -> None:
    out = path.with_name("out.mcap")
    with pytest.raises(InputError, match="no intact frame"):
        recover(path, out)
    assert not out.exists()


def test_forge_writes_valid_recordings(tmp_path: Path) -> None:
    recording = open_recording(forge(tmp_path / "r.mcap"))
    assert same_frames(recording.frames(), SOURCE.frames())
    assert list(recording.truths()) == list(SOURCE.truths())


def test_no_module_named_in_a_recording_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A kind of the user is read after the user has imported its module."""
    name = "agc_of_my_own"
    (tmp_path / f"{name}.py").write_text("from irsim.camera.agc import Plain\n\n\nclass Mine(Plain):\n    pass\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    path = forge(tmp_path / "r.mcap", {"agc": f'{{"kind": "{name}:Mine"}}'})
    assert "are not imported" in refused(path)
    with pytest.raises(InputError, match="are not imported"):
        recover(path, tmp_path / "out.mcap")
    assert name not in sys.modules
    __import__(name)
    assert open_recording(path).agc.kind == f"{name}:Mine"


@pytest.mark.parametrize(
    "change",
    [
        {"size": "[-1, 64]"},
        {"size": "[32, 65536]"},
        {"size": "[" * 100_000},
        {"agc": "linear"},
        {"bits": "99999999999999999999"},
        {"rate_hz": "NaN"},
        {"rate_hz": "1e308"},
        {"agc": '{"kind": "irsim.camera.agc:Agc"}'},
    ],
)
def test_wrong_headers(tmp_path: Path, change: dict[str, str]) -> None:
    assert "metadata" in refused(forge(tmp_path / "r.mcap", change))


@pytest.mark.parametrize("change", [{"frames": "0"}, {"frames": "1e400"}, {"targets": "[{}]"}])
def test_wrong_contents(tmp_path: Path, change: dict[str, str]) -> None:
    assert "metadata" in refused(forge(tmp_path / "r.mcap", contents=change))
    path = forge(tmp_path / "more.mcap", contents={"frames": "3"})
    assert "has 1 message for 3 frames" in refused(path)
    assert len(open_recording(recover(path, tmp_path / "out.mcap"))) == 1


def changed_image(**fields: object) -> bytes:
    message = RawImage.FromString(honest_image())
    for name, value in fields.items():
        setattr(message, name, value)
    return bytes(message.SerializeToString())


@pytest.mark.parametrize(
    "image",
    [
        b"\xff\xff\xff",
        b"",
        changed_image(width=24, height=32),
        changed_image(data=b"short"),
        changed_image(encoding="rgb8"),
    ],
)
def test_wrong_images(tmp_path: Path, image: bytes) -> None:
    path = forge(tmp_path / "r.mcap", image=image)
    assert "damaged: frame 0 cannot be read" in refused(path)
    not_recovered(path)


def encoded(target: Mapping[str, object]) -> bytes:
    return bytes(TruthMessage(index=0, time=0.0, targets=[target]).SerializeToString())


@pytest.mark.parametrize(
    "truth",
    [
        b"\xff\xff",
        encoded({"id": "jet", "center": {"x": 1, "y": 2}}),
        encoded({"id": "jet", "center": {"x": 1e308, "y": 2}, "box": {"cx": 1e308, "cy": 2, "w": 3, "h": 4}}),
        encoded({"id": "jet", "center": {"x": float("nan"), "y": 2}, "box": {"cx": 1, "cy": 2, "w": 3, "h": 4}}),
        *(honest_truth().replace(word, b"\xff" * len(word)) for word in (b"jet", b"body", b"pole")),
    ],
)
def test_wrong_truths(tmp_path: Path, truth: bytes) -> None:
    """No message, without a box, not finite, or not text in id, class or occluder."""
    path = forge(tmp_path / "r.mcap", truth=truth)
    assert "damaged: the truth of frame 0 cannot be read" in refused(path)
    not_recovered(path)


def test_names_do_not_control_the_terminal(tmp_path: Path) -> None:
    escape = "\x1b[2J\nscene hash 0"
    target = {"id": escape, "cls": escape, "center": {"x": 1, "y": 2}, "box": {"cx": 1, "cy": 2, "w": 3, "h": 4}}
    header = {"name": escape, "follow": escape}
    path = forge(tmp_path / "r.mcap", header, {"notes": json.dumps([escape])}, truth=encoded(target))
    recording = open_recording(path)
    (truth,) = recording.truths()
    assert truth.targets[0].id == truth.targets[0].cls == recording.follow == "\\x1b[2J\\nscene hash 0"
    out = CliRunner().invoke(app, ["info", str(path)]).stdout
    assert "\x1b" not in out
    assert not [line for line in out.splitlines() if line.startswith("scene hash 0")]


def test_a_small_file_does_not_unpack_to_a_large_chunk() -> None:
    import zstandard

    plain = bytes((1 << 27) + 1)
    assert unpack(memoryview(zstandard.compress(plain)), "zstd", len(plain)) is None


def test_a_scenario_that_is_not_text(tmp_path: Path) -> None:
    path = forge(tmp_path / "s.mcap", scenario=b"\xff\xfe")
    assert "the scenario in it is no text" in refused(path)
    assert open_recording(recover(path, tmp_path / "out.mcap")).scenario_text is None


def test_track_states_without_a_box(tmp_path: Path) -> None:
    path = tmp_path / "t.mcap"
    header = TrackHeader(tracker="x", source="s", source_hash="h", rate_hz=1.0, states=1)
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.metadata("irsim_track", header.to_record())
        channel = writer.topic("/tracks/x/states", TRACK_STATE)
        writer.chunk([Message(channel, 0, 0, TrackStateMessage(index=0).SerializeToString())])
        writer.finish()
    with pytest.raises(InputError, match=r"t\.mcap: damaged: state 0 cannot be read$"):
        read_tracks(path)


def test_an_index_past_the_end_of_the_file(tmp_path: Path) -> None:
    recording = open_recording(record(Noise(), tmp_path / "r.mcap"))
    for chunk in recording.mcap.chunks:
        chunk.chunk_length = 2**60
    with pytest.raises(InputError, match="its index points past its end"):
        recording.frame(0)


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
def test_chunks_unpack_to_their_stated_size(compression: str) -> None:
    import lz4.frame  # type: ignore[import-untyped]  # lz4 has no stubs
    import zstandard

    plain = bytes(4_000_000)
    packed = memoryview(lz4.frame.compress(plain) if compression == "lz4" else zstandard.compress(plain))
    whole = unpack(packed, compression, len(plain))
    assert whole is not None
    assert np.frombuffer(whole, np.uint8).size == len(plain)
    for stated in (1000, len(plain) - 1, len(plain) + 1, 0, -1, 2**62):
        assert unpack(packed, compression, stated) is None
