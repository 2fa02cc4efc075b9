"""Rendering: one frame, its composite and moments, and the stream of frames."""
