"""Expectations of a scenario: rules for the track of its target, for tracks of all targets, and for detections.

A scenario declares them; irtrack evaluates them on a replay of the scene, each for the tasks that it is about.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from irsim.config.base import Family, Kind, Name
from irsim.config.quantities import Index, NotNegative, Positive


class Expectation(Kind):
    """Rule for tracks or detections."""

    target: Name | None = None
    """Id of the target; default: the target to track (`follow`), or all."""


class NeverLost(Expectation):
    """Expectation that the track is not lost while the target is visible."""


class ErrorBelow(Expectation):
    """Expectation that the centre error stays below a bound while the target is visible."""

    px: Positive
    """Bound of the centre error, px."""
    share: Annotated[float, Field(gt=0, le=1)] = 1.0
    """Least share of the visible frames in which the bound holds: 0.95 allows one in twenty to be worse."""


class ReacquiredWithin(Expectation):
    """Expectation that the track is back on the target soon after the target was hidden, absent or out of view."""

    frames: Index
    """Largest number of frames from the first one in which the target is visible again."""


class HonestWhileHidden(Expectation):
    """Expectation that the track does not report an occluded, absent or out-of-view target as visible."""

    within: Index = 5
    """Number of frames after the target vanishes in which it may still be reported as visible."""


class PdAtLeast(Expectation):
    """Probability of detection (tasks many, detect)."""

    share: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Least share of target positions found."""


class SwitchesAtMost(Expectation):
    """Identity switches (many)."""

    count: Index = 0
    """Most in the scene."""


class FalseTracksAtMost(Expectation):
    """False tracks (many)."""

    per_minute: NotNegative
    """Most a minute."""


class FalseAlarmsAtMost(Expectation):
    """False alarms (detect)."""

    per_frame: NotNegative
    """Most a frame, in the mean."""


EXPECTATIONS = Family(
    "expectation",
    Expectation,
    {
        "never_lost": NeverLost,
        "error_below": ErrorBelow,
        "reacquired_within": ReacquiredWithin,
        "honest_while_hidden": HonestWhileHidden,
        "pd_at_least": PdAtLeast,
        "switches_at_most": SwitchesAtMost,
        "false_tracks_at_most": FalseTracksAtMost,
        "false_alarms_at_most": FalseAlarmsAtMost,
    },
)
