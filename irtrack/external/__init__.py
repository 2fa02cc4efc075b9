"""Trackers that run as programs, over pipes: those of OpenCV and dlib, TraX trackers, and any other program."""

from irtrack.external.install import HINT, command, offered, required
from irtrack.external.json_protocol import Answer, Session
from irtrack.external.process import Child
from irtrack.external.server import PEERS
from irtrack.external.trax import TraxSession

__all__ = ["HINT", "PEERS", "Answer", "Child", "Session", "TraxSession", "command", "offered", "required"]
