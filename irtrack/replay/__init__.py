"""Replay of the frames of a source into trackers, and the start of a track."""
