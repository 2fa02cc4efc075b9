"""Recovered recordings rendered again by their scenario."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from typer.testing import CliRunner

import irsim
from irsim.cli.app import app
from irsim.recording import Recording, open_recording, record, recover
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


def damaged(folder: Path, lost: int, *overrides: str, start: int = 0) -> Path:
    """Return the recovered recording of the scene after the chunk of frame `lost` was damaged."""
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
    folder = tmp_path / "masks"
    assert CliRunner().invoke(app, ["masks", str(left), "-o", str(folder)]).exit_code == 0
    whole = tmp_path / "whole"
    assert CliRunner().invoke(app, ["masks", str(tmp_path / "whole.mcap"), "-o", str(whole)]).exit_code == 0
    name = "{:06}_jet_whole.png"
    for index in range(len(recording)):
        assert (folder / name.format(index)).read_bytes() == (whole / name.format(index + 2)).read_bytes()


@pytest.mark.parametrize("overrides", [(), (DROPS,)])
def test_rendering_with_lost_frames_is_refused(tmp_path: Path, overrides: tuple[str, ...]) -> None:
    left = damaged(tmp_path, 6, *overrides)
    assert len(times(open_recording(left))) == (10 if not overrides else 9)
    for command in (["masks"], ["render"], ["masks", "--frames", "2"], ["render", "seed=7"], ["render", "frames=11"]):
        done = CliRunner().invoke(app, [command[0], str(left), *command[1:], "-o", str(tmp_path / "again.mcap")])
        assert isinstance(done.exception, irsim.InputError)
        told = str(done.exception)
        assert told.startswith(f"{left}: frame 6 was taken at ")
        assert told.endswith(
            "lost; allowed: a recording of all frames from its first to its last, or the scenario itself"
        )
        assert len(told.splitlines()) == 1


def test_a_wrong_first_frame_is_refused(tmp_path: Path) -> None:
    source = Rendering(irsim.loads(SCENE))
    path = tmp_path / "late.mcap"
    with writing(path, header_of(source), source.scenario_text) as writer:
        for frame, truth in source.pairs(2):
            writer.add(frame, truth)
        writer.finish()
    with pytest.raises(irsim.InputError, match=r"late\.mcap: frame 0 was taken at 0\.0666667 s, its scenario's at 0 s"):
        open_rendering(path)


def test_frames_that_the_scenario_drops_are_not_lost(tmp_path: Path) -> None:
    """Nor where overrides drop other frames, or none, or shorten the scenario."""
    path = record(Rendering(irsim.loads(SCENE, overrides=[DROPS])), tmp_path / "a.mcap", 2)
    for change in ([], ["camera.faults=[]"], ["seed=8"], ["frames=9"], ["camera.rate_hz=25"], ["without=[drop]"]):
        rendering, start, stop = open_rendering(path, change)
        assert (start, stop) == (2, min(11, len(rendering)))


def test_chunks_of_several_topics_are_not_lost_frames(tmp_path: Path) -> None:
    """Another program may write all topics to each chunk."""
    path = record(Rendering(irsim.loads(SCENE)), tmp_path / "whole.mcap")
    mixed = tmp_path / "mixed.mcap"
    with path.open("rb") as source, mixed.open("wb") as out:
        reader, writer = make_reader(source), Writer(out, chunk_size=20_000)
        writer.start()
        summary = reader.get_summary()
        assert summary is not None
        schemas = {
            number: writer.register_schema(schema.name, schema.encoding, schema.data)
            for number, schema in summary.schemas.items()
        }
        channels = {
            number: writer.register_channel(
                channel.topic, channel.message_encoding, schemas.get(channel.schema_id, 0), channel.metadata
            )
            for number, channel in summary.channels.items()
        }
        for metadata in reader.iter_metadata():
            writer.add_metadata(metadata.name, metadata.metadata)
        for attachment in reader.iter_attachments():
            writer.add_attachment(
                attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, attachment.data
            )
        for _, channel, message in reader.iter_messages():
            number = channels[channel.id]
            writer.add_message(number, message.log_time, message.data, message.publish_time, message.sequence)
        writer.finish()  # type: ignore[no-untyped-call]
    rendering, _, _ = open_rendering(mixed)
    assert len(list(rendering.frames())) == 12
