"""Temperatures of what the ground is made of, by day and by night."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

Hour = Literal["any", "day", "night"]
"""`any` stands for no hour: every temperature is as its key says."""

TEMPERATURES: dict[str, dict[str, float]] = {
    "any": {
        "fields": 3.0,
        "roads": 6.0,
        "water": -8.0,
        "trees": 288.0,
        "walls": 290.0,
    },
    "day": {
        "ground": 303.0,
        "spread": 4.0,
        "fields": 4.0,
        "roads": 9.0,
        "water": -11.0,
        "trees": 297.0,
        "walls": 304.0,
    },
    "night": {
        "ground": 283.0,
        "spread": 1.2,
        "fields": 1.0,
        "roads": 4.0,
        "water": 5.0,
        "trees": 285.5,
        "walls": 287.0,
    },
}
"""K: ground, trees and walls themselves; spreads of the ground and between fields; roads and water
less the ground. Those of no hour are choices, the others round figures for a clear summer day and night at
mid latitudes: bare soil and asphalt swing most between day and night, water hardly, crowns of trees stay
near the air (Oke, Boundary Layer Climates, 2nd ed. 1987, chapters 2 to 4). So water is the coldest by day
and warm by night."""


def by_hour(given: Mapping[str, Any], keys: Mapping[str, str]) -> dict[str, Any]:
    """A part's keys with those that are missing taken from its `hour`; `keys`: key of the part -> key of the table."""
    hour = given.get("hour")
    table = TEMPERATURES.get(hour, {}) if isinstance(hour, str) else {}
    return {**{key: table[what] for key, what in keys.items() if what in table}, **given}


def leaves_k(hour: Hour) -> float | None:
    """How warm leaves are at an hour, K; None where it is none."""
    return None if hour == "any" else TEMPERATURES[hour]["trees"]


def typical(given: float | None, hour: Hour, what: str) -> float:
    """What is given, or else what the table has of that hour, K."""
    return given if given is not None else TEMPERATURES[hour][what]
