"""Playback of a source to viewers over a WebSocket."""

from irsim.live.server import LiveServer, Overlay

__all__ = ["LiveServer", "Overlay"]
