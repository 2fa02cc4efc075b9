"""What a scenario expects of whoever tracks its target: rules that trackers are held to.

A scenario only states them. Trackers are no matter of irsim: who replays the scene judges.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from irsim.config.base import Family, Kind, Name
from irsim.config.quantities import Index, Positive


class Expectation(Kind):
    """A rule about a track of a target."""

    target: Name | None = None
    """Id of the target it is about; the followed one where not given."""


class NeverLost(Expectation):
    """The track is not lost while the target can be seen."""


class ErrorBelow(Expectation):
    """The centre error stays below a bound while the target can be seen."""

    px: Positive
    """The bound, px."""
    share: Annotated[float, Field(gt=0, le=1)] = 1.0
    """Share of those frames in which it holds: 0.95 lets one in twenty be worse."""


class ReacquiredWithin(Expectation):
    """The track is back on the target soon after each time that it was hidden, out of view or absent."""

    frames: Index
    """Frames from the first in which it can be seen again."""


class HonestWhileHidden(Expectation):
    """The track does not claim to see what is hidden, out of view or absent."""

    within: Index = 5
    """Frames after it went in which the claim may still stand."""


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
