"""Recordings: MCAP files of frames, truth and the scenario, that common viewers open."""

from irsim.recording.read import Recording, open_recording
from irsim.recording.recover import recover
from irsim.recording.replaced import check_default
from irsim.recording.tracks import TrackHeader, TrackRecording, TrackState, read_tracks, write_tracks
from irsim.recording.verify import damages
from irsim.recording.write import record

__all__ = [
    "Recording",
    "TrackHeader",
    "TrackRecording",
    "TrackState",
    "check_default",
    "damages",
    "open_recording",
    "read_tracks",
    "record",
    "recover",
    "write_tracks",
]
