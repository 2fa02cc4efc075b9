"""Tracks as recordings of their own."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import SeekingReader
from recording_fakes import Noise

from irsim.errors import InputError
from irsim.recording import TrackHeader, TrackState, open_recording, read_tracks, record, write_tracks
from irsim.types import Box


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(Noise(), tmp_path_factory.mktemp("rec") / "noise.mcap")


STATES = (
    TrackState(0, 0.0, Box(5.0, 6.0, 8.0, 8.0), "tracking"),
    TrackState(1, 1 / 30, Box(5.5, 6.0, 8.0, 8.0), "occluded", 0.5, (1.0, -2.0), ((1.0, 0.1), (0.1, 2.0)), 37.5),
    TrackState(3, 3 / 30, Box(6.0, 6.0, 3.0, 3.0), "lost", score=0.0),
)
TRACK = TrackHeader(tracker="grey:n=50", source="noise", source_hash="abc", rate_hz=30.0, target="jet")


def test_tracks_are_read_as_written(tmp_path: Path) -> None:
    track = read_tracks(write_tracks(tmp_path / "noise.grey.mcap", TRACK, STATES))
    assert track.states == STATES
    assert track.header == TRACK.model_copy(update={"states": 3})


def test_tracks_have_the_times_of_their_source(tmp_path: Path, recorded: Path) -> None:
    path = write_tracks(tmp_path / "noise.grey.mcap", TRACK, STATES)
    with path.open("rb") as file:
        messages = list(SeekingReader(file, validate_crcs=True).iter_messages())
    topics = {(channel.topic, schema.name) for schema, channel, _ in messages if schema is not None}
    assert topics == {
        ("/tracks/grey_n_50/annotations", "foxglove.ImageAnnotations"),
        ("/tracks/grey_n_50/states", "irsim.TrackState"),
    }
    with recorded.open("rb") as file:
        times = {m.sequence: m.log_time for _, _, m in SeekingReader(file).iter_messages(topics=["/ir/image"])}
    assert all(message.log_time == times[message.sequence] for _, _, message in messages)


def test_tracks_are_not_recordings(tmp_path: Path, recorded: Path) -> None:
    path = write_tracks(tmp_path / "t.mcap", TRACK, STATES)
    with pytest.raises(InputError, match="holds a track, not frames"):
        open_recording(path)
    with pytest.raises(InputError, match="not a track recording"):
        read_tracks(recorded)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="cut short"):
        read_tracks(path)
