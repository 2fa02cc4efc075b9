"""Frames of a source, one after the other, into trackers."""
