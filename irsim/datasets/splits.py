"""Splits of a data set: whole clips for train, val and test."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence

from irsim.errors import InputError, counted, is_number

SPLITS = ("train", "val", "test")
_ROUNDING = 1e-6
"""Allowed error of the sum of the shares."""


def split_names(names: Sequence[str], shares: Sequence[float] | None) -> list[str]:
    """Return the split of each clip, '' without shares. The order of drawing is that of digests of the names, so that
    it depends on nothing else. InputError where a split would be empty."""
    if shares is None:
        return [""] * len(names)
    given = ",".join(f"{share:g}" if is_number(share) else str(share) for share in shares)
    if (
        not 2 <= len(shares) <= len(SPLITS)
        or not all(is_number(share) and 0 <= share <= 1 for share in shares)
        or abs(sum(shares) - 1) > _ROUNDING
    ):
        raise InputError(f"split {given}: allowed: shares of train, val and perhaps test that add up to 1, as .8,.1,.1")
    wanted = [name for name, share in zip(SPLITS, shares, strict=False) if share > 0]
    if len(names) < len(wanted):
        raise InputError(
            f"split {given}: {counted(len(names), 'clip')} for {counted(len(wanted), 'split')}, as the frames of a "
            "clip stay together; allowed: more scenes, or seeds=N"
        )
    counts = _counts(len(names), [share for share in shares if share > 0])
    ordered = sorted(names, key=lambda name: hashlib.blake2b(name.encode()).digest())
    drawn = [split for split, count in zip(wanted, counts, strict=True) for _ in range(count)]
    split_of = dict(zip(ordered, drawn, strict=True))
    return [split_of[name] for name in names]


def _counts(clips: int, shares: Sequence[float]) -> list[int]:
    """Return the number of clips of each split, at least one each: one apiece, the others by the largest remainder."""
    exact = [share * clips for share in shares]
    counts = [max(math.floor(each + _ROUNDING), 1) for each in exact]
    while sum(counts) != clips:
        step = 1 if sum(counts) < clips else -1
        apart = [
            step * (each - count) if count + step >= 1 else -math.inf for each, count in zip(exact, counts, strict=True)
        ]
        counts[apart.index(max(apart))] += step
    return counts
