"""Trackers that run as programs, over pipes: those of other libraries, TraX trackers, and any other program."""

from irtrack.external.install import ALL_PEERS, HINT, command, offered, required
from irtrack.external.json_protocol import Answer, DetectionSession, Session
from irtrack.external.process import Child
from irtrack.external.server import PEERS
from irtrack.external.trax import TraxSession

__all__ = [
    "ALL_PEERS",
    "HINT",
    "PEERS",
    "Answer",
    "Child",
    "DetectionSession",
    "Session",
    "TraxSession",
    "command",
    "offered",
    "required",
]
