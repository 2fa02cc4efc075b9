"""Frame times as MCAP's log times: whole nanoseconds on one epoch, so that recordings line up."""

from __future__ import annotations

EPOCH_NS = 1_577_836_800 * 10**9
"""Time 0 of every source: 2020-01-01T00:00:00Z, ns since the Unix epoch. Viewers show dates; a fixed
one keeps files reproducible and lets a track be opened beside its source."""


def to_ns(time: float) -> int:
    """Log time of a frame time in s."""
    return EPOCH_NS + round(time * 1e9)


def from_ns(log_time: int, rate_hz: float) -> float:
    """Frame time in s of a log time.

    Log times are rounded to 1 ns; a time that rounds like a whole number of frame periods is one, so
    that index / rate comes back bit for bit.
    """
    seconds = (log_time - EPOCH_NS) / 1e9
    regular = round(seconds * rate_hz) / rate_hz
    return regular if to_ns(regular) == log_time else seconds
