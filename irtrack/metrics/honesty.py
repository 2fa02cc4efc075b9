"""Whether a tracker's status says what is so."""

from __future__ import annotations

import numpy as np

from irtrack.metrics.interval import share


def false_tracking(statuses: np.ndarray, off: np.ndarray, counted: np.ndarray) -> float:
    """Share 0..1 of the off frames in which it says "tracking"; nan where no counted frame is off.

    statuses (n,) words; off, counted (n,) bool, see `irtrack.metrics.trace.Trace`.
    """
    return share((statuses == "tracking")[off & counted])


def false_lost(statuses: np.ndarray, off: np.ndarray, counted: np.ndarray) -> float:
    """Share 0..1 of the frames on a visible target in which it says "lost"; nan where there is none."""
    return share((statuses == "lost")[~off & counted])


def hidden_tracking(statuses: np.ndarray, hidden: np.ndarray) -> float:
    """Share 0..1 of the frames in which nothing of the target is to be seen and it says "tracking"."""
    return share((statuses == "tracking")[hidden])


def lost_late(statuses: np.ndarray, lost_position: int | None) -> float:
    """Frames from the loss (its position) until it says "lost"; nan where the track is not lost.

    Where it never says so: the frames to the track's end, the least that it can be.
    """
    if lost_position is None:
        return np.nan
    said = np.flatnonzero(statuses[lost_position:] == "lost")
    return float(said[0]) if len(said) else float(len(statuses) - lost_position)
