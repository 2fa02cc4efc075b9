"""Recordings: MCAP files of frames, truth and the scenario, which common viewers open."""

from irsim.recording.reader import Recording, open_recording
from irsim.recording.recovery import damages, recover
from irsim.recording.tracks import TrackHeader, TrackRecording, TrackState, read_tracks, write_tracks
from irsim.recording.writer import check_default_output, record

__all__ = [
    "Recording",
    "TrackHeader",
    "TrackRecording",
    "TrackState",
    "check_default_output",
    "damages",
    "open_recording",
    "read_tracks",
    "record",
    "recover",
    "write_tracks",
]
