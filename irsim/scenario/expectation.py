"""Expectations of a scenario: rules for the track of its target.

A scenario declares them; irtrack evaluates them on a replay of the scene.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from irsim.config.base import Family, Kind, Name
from irsim.config.quantities import Index, Positive


class Expectation(Kind):
    """Rule for the track of a target."""

    target: Name | None = None
    """Id of the target; default: the target to track (`follow`)."""


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


EXPECTATIONS = Family(
    "expectation",
    Expectation,
    {
        "never_lost": NeverLost,
        "error_below": ErrorBelow,
        "reacquired_within": ReacquiredWithin,
        "honest_while_hidden": HonestWhileHidden,
    },
)
