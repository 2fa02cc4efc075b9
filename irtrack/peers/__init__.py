"""Trackers that run as programs of their own, spoken to over pipes: OpenCV's and dlib's, and anybody's."""

from irtrack.peers.child import Child
from irtrack.peers.environment import HINT, command, offered, required
from irtrack.peers.server import PEERS
from irtrack.peers.session import Answer, Session
from irtrack.peers.trax import TraxSession

__all__ = ["HINT", "PEERS", "Answer", "Child", "Session", "TraxSession", "command", "offered", "required"]
