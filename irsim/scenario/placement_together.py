"""What occluders that are placed by whom they hide do to a target together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import groupby

from irsim.errors import Notice
from irsim.scenario.placement_hold import FEW, LEEWAY, MUCH, Hold
from irsim.scenario.placement_window import asked
from irsim.scenario.visibility import Watch

Holds = Mapping[int, Hold]
"""Placed occluders that are on, by their number in the scenario."""


def spoiled(watch: Watch, holds: Holds) -> Iterator[Notice]:
    """Occluders in whose frames others hide the target, too, and together by MUCH more than asked.

    Of several that ask for a frame, the one that asks for most is told; two that do so to each other are told once.
    """
    said: set[tuple[int, int]] = set()
    for number, hold in holds.items():
        name, (first, last) = asked(hold.occluder)
        over: dict[int, float] = {}
        helpers: set[int] = set()
        for index in range(first, last + 1):
            asking = [other for other in holds.values() if _asks(other, name, index)]
            most = max(other.occluder.fraction for other in asking)
            alone = any(other.shares[index] > other.occluder.fraction + MUCH for other in asking)  # is told of that
            if alone or hold.occluder.fraction < most or most + MUCH >= 1:
                continue
            others = [key for key, other in holds.items() if other is not hold and _adds(watch, other, name, index)]
            if not others:
                continue
            share = watch.hidden_by([holds[key].screen for key in (number, *others)], name, index)
            if share > most + MUCH:
                over[index] = share
                helpers.update(others)
        if not helpers <= {other for other, helped in said if helped == number}:
            said |= {(number, helper) for helper in helpers}
            names, foreign = _named([holds[key] for key in sorted(helpers)], name)
            yield Notice(
                ("occluders", number, "fraction"),
                f"with {names} it hides up to {max(over.values()):.2f} of {name} in frames {min(over)} to {max(over)}, "
                f"where {hold.occluder.fraction:g} is asked: try frames farther apart, or "
                f"{'another range_m' if foreign else 'less of each'}",
            )


def unbroken(watch: Watch, holds: Holds) -> Iterator[Notice]:
    """Occluders between whose frames the target is not seen in more than FEW that nobody asks for: each hides some of
    it there, and no one of them is told to hide it for too long."""
    by_target = sorted(holds, key=lambda key: asked(holds[key].occluder))
    for name, run in groupby(by_target, key=lambda key: asked(holds[key].occluder)[0]):
        numbers = list(run)
        before = numbers[0]
        for number in numbers[1:]:
            (start, stop), (begin, end) = (asked(holds[key].occluder)[1] for key in (before, number))
            both = [holds[before], holds[number]]
            gap = range(stop + 1, begin)
            if len(gap) > FEW and not any(hold.too_long() for hold in both) and _bridged(watch, both, name, gap):
                yield Notice(
                    ("occluders", number, "frames"),
                    f"with {holds[before].occluder.name} it hides {min(hold.enough for hold in both):.2f} or more of "
                    f"{name} in frames {start} to {end} without a break, where {start} to {stop} and {begin} to {end} "
                    "are asked: try frames farther apart, or a faster target",
                )
            before = number if end > stop else before


def _named(others: list[Hold], name: str) -> tuple[str, bool]:
    """Occluders, with whom they shall hide where that is not target `name`; and is that so of any?"""
    told = [(hold.occluder.name, asked(hold.occluder)[0]) for hold in others]
    words = [screen if whom == name else f"{screen}, which shall hide {whom}," for screen, whom in told]
    return " and ".join(words), any(whom != name for _, whom in told)


def _bridged(watch: Watch, both: list[Hold], name: str, gap: range) -> bool:
    """Do two hide as much as the lesser of them is asked to in each of these frames?"""
    enough = min(hold.enough for hold in both)
    screens = [hold.screen for hold in both]
    if any(sum(float(hold.shares[index]) for hold in both) < enough for index in gap):
        return False  # together they hide no more than that
    return all(watch.hidden_by(screens, name, index) >= enough for index in gap)


def _asks(hold: Hold, name: str, index: int) -> bool:
    whom, (first, last) = asked(hold.occluder)
    return whom == name and first <= index <= last


def _adds(watch: Watch, hold: Hold, name: str, index: int) -> bool:
    """Does it hide some of target `name` at frame `index`, whomever it shall hide?"""
    own = asked(hold.occluder)[0] == name
    return float(hold.shares[index] if own else watch.hidden(hold.screen, name, index)) > LEEWAY
