"""Ways at constant speed whose turn rate is constant over stretches of frames: exact arcs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic_core import PydanticCustomError

from irsim.config.base import Several
from irsim.config.quantities import Number
from irsim.types import Floats

Leg = Annotated[tuple[Number, Number, Number], Field(strict=False)]
Legs = Several[Leg]


def check_legs(legs: Sequence[tuple[float, float, float]]) -> None:
    """Legs [from, to, rate] must follow each other from frame 0 on; PydanticCustomError at `turns`."""
    ends = [end for leg in legs for end in leg[:2]]
    for index, (first, last, _) in enumerate(legs):
        if first < 0 or last <= first:
            raise PydanticCustomError(
                "turns",
                "the turn from frame {first} to {last} cannot be; allowed: [from, to, rate] with 0 <= from < to",
                {"first": first, "last": last, "at": ("turns", index)},
            )
    if any(b < a for a, b in pairwise(ends)):
        raise PydanticCustomError("turns", "the turns overlap; allowed: turns one after the other", {"at": ("turns",)})


def arcs(frames: Floats, legs: Sequence[tuple[float, float, float]], speed: float) -> Floats:
    """(n, 2) displacement since frame 0 of something that then moves along the first axis.

    legs: (from, to, rad per frame), in order, turning the first axis towards the second; straight
    between them, before frame 0 and after the last. speed: length per frame.
    """
    frames = np.asarray(frames, dtype=np.float64)
    knots = np.array([0.0, *(end for leg in legs for end in leg[:2])])
    rates = np.array([0.0, *(rate for leg in legs for rate in (leg[2], 0.0))])
    spans = np.diff(knots)
    headings = np.append(0.0, np.cumsum(rates[:-1] * spans))
    places = np.concatenate([np.zeros((1, 2)), np.cumsum(chord(speed, headings[:-1], rates[:-1], spans), axis=0)])
    leg = np.maximum(np.searchsorted(knots, frames, side="right") - 1, 0)
    rate = np.where(frames < 0, 0.0, rates[leg])
    return np.asarray(places[leg] + chord(speed, headings[leg], rate, frames - knots[leg]))


def chord(speed: float, heading: Floats, rate: Floats, frames: Floats) -> Floats:
    """(n, 2) the way made in some frames at a constant turn rate, rad and frames (n,)."""
    length = speed * frames * np.sinc(rate * frames / (2 * np.pi))
    direction = heading + rate * frames / 2
    return np.stack([length * np.cos(direction), length * np.sin(direction)], axis=-1)
