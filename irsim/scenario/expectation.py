"""Expectations of a scenario: rules for the track of its target.

A scenario only states them; irtrack replays the scene and judges.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from irsim.config.base import Family, Kind, Name
from irsim.config.quantities import Index, Positive


class Expectation(Kind):
    """Rule for the track of a target."""

    target: Name | None = None
    """Id of its target; default: the followed one."""


class NeverLost(Expectation):
    """The track is not lost while the target is visible."""


class ErrorBelow(Expectation):
    """The centre error stays below a bound while the target is visible."""

    px: Positive
    """The bound, px."""
    share: Annotated[float, Field(gt=0, le=1)] = 1.0
    """Fraction of those frames in which it holds: 0.95 allows one in twenty to be worse."""


class ReacquiredWithin(Expectation):
    """The track is back on the target soon after each time that it was occluded, out of view or absent."""

    frames: Index
    """Number of frames from the first in which it is visible again."""


class HonestWhileHidden(Expectation):
    """The track does not report a target as visible that is occluded, out of view or absent."""

    within: Index = 5
    """Number of frames after it vanished in which the report may still stand."""


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
