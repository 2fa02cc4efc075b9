"""Explanation of a lost track: the share of each cause, with its interval, and the repairs; in words and as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from irsim.types import Box
from irtrack.explain.game import Repair
from irtrack.metrics import wilson

PATH_PX = 0.5
"""Change of the target's path in the picture, px, from which on a share is confounded with the path."""

LUCK, UNEXPLAINED = "luck", "unexplained"


@dataclass(frozen=True)
class CauseShare:
    """Share of a cause in the probability of the loss.

    value, low, high   share from -1 to 1 and its interval (`irtrack.explain.game.Share`); negative: it holds the track
    restored           number of seeds in which its removal alone restores the track
    named              True where the interval lies above the placebo's effect
    anchored, changes  properties that its twin keeps, and that it changes beside the cause
    path_px            largest change of the target's place in the picture, px
    hidden             frames in which the target is hidden with, and without the cause
    """

    cause: str
    value: float
    low: float
    high: float
    restored: int
    named: bool
    anchored: str
    changes: str
    path_px: float
    hidden: tuple[int, int]

    @property
    def confounded(self) -> bool:
        """True where the twin moves the target in the picture, past other background, too."""
        return self.path_px > PATH_PX

    def notes(self) -> str:
        """Return what its twin keeps and changes, in words."""
        parts = [f"kept: {self.anchored}"]
        if self.confounded:
            parts.append(f"path, confounded: up to {self.path_px:.1f} px")
        if self.changes:
            parts.append(f"also changed: {self.changes}")
        if self.hidden[0] != self.hidden[1]:
            parts.append(f"hidden in {self.hidden[1]} frames instead of {self.hidden[0]}")
        return "; ".join(parts)


@dataclass(frozen=True)
class Parting:
    """Moment at which the tracks in the scene and in the twin without the first cause part.

    time_s   of the frame
    boxes    estimated and true box in the scene, then in the twin; the true box is None where the target is absent
    """

    removed: tuple[str, ...]
    time_s: float
    boxes: tuple[Box, Box | None, Box, Box | None]


@dataclass(frozen=True)
class Explanation:
    """Explanation of the loss of one run.

    tracker, scene, target, seed, lost_at   of the run
    first       the scenario's frame in which the track starts;  input  of the tracker
    seeds       number of seeds of each twin;  seed_kind  'tracker', or 'noise' for a tracker that draws nothing
    design      'all subsets' (Shapley values) or 'first and last arrival'
    twins       number of twins
    p_all, p_none   probability of the loss with all causes, and with none (unexplained)
    placebo     share of all seeds in which another seed alone restores the track
    residual    p_all - p_none less the sum of the shares
    dropped     causes that are none, with the reason
    """

    tracker: str
    scene: str
    target: str
    seed: int
    lost_at: int
    first: int
    input: str
    seeds: int
    seed_kind: Literal["tracker", "noise"]
    design: str
    twins: int
    p_all: float
    p_none: float
    placebo: float
    residual: float
    shares: tuple[CauseShare, ...]
    repairs: tuple[Repair, ...]
    dropped: Mapping[str, str]
    parting: Parting | None = None

    @property
    def named(self) -> tuple[str, ...]:
        """Causes whose intervals lie above the placebo, the largest share first."""
        return tuple(share.cause for share in self.shares if share.named)

    @property
    def p_none_interval(self) -> tuple[float, float]:
        """95 % interval of `p_none` (Wilson)."""
        return wilson(round(self.p_none * self.seeds), self.seeds)

    @property
    def verdict(self) -> str:
        """Named causes, else `UNEXPLAINED` where most twins without any cause are lost, else `LUCK`."""
        return ", ".join(self.named) or (UNEXPLAINED if self.p_none >= 0.5 else LUCK)

    def brief(self) -> str:
        """Return the verdict with the shares of the named causes and their intervals."""
        shares = (
            f"{each.cause} ({each.value:.2f}, {each.low:.2f} to {each.high:.2f})" for each in self.shares if each.named
        )
        return ", ".join(shares) or self.verdict

    def as_dict(self) -> dict[str, Any]:
        """Return the explanation as plain values for JSON."""
        return asdict(self) | {"verdict": self.verdict}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Explanation:
        """Return the explanation from the values of `as_dict`."""
        given = {key: value for key, value in values.items() if key != "verdict"}
        shares = tuple(CauseShare(**{**each, "hidden": tuple(each["hidden"])}) for each in given["shares"])
        repairs = tuple(Repair(tuple(each["causes"]), each["restored"]) for each in given["repairs"])
        parting = given["parting"]
        if parting is not None:
            boxes = tuple(None if each is None else Box(**each) for each in parting["boxes"])
            parting = Parting(tuple(parting["removed"]), parting["time_s"], boxes)  # type: ignore[arg-type]
        return cls(**{**given, "shares": shares, "repairs": repairs, "parting": parting})

    def lines(self) -> list[str]:
        """Return the explanation as lines of text."""
        head = [
            f"{self.tracker} on {self.scene}, seed {self.seed}: lost at frame {self.lost_at}: {self.verdict}",
            f"  {self.seeds} {self.seed_kind} seeds, {self.twins} twins ({self.design}); lost in {self.p_all:.0%} with "
            f"all causes, {self.p_none:.0%} with none; another seed alone restores {self.placebo:.0%}",
        ]
        width = max((len(share.cause) for share in self.shares), default=0)
        width = max(width, len(UNEXPLAINED))
        rows = [
            f"{'*' if share.named else ' '} {share.cause:{width}}  {share.value:+.2f}  [{share.low:+.2f}, "
            f"{share.high:+.2f}]  alone restores {share.restored}  {share.notes()}"
            for share in self.shares
        ]
        low, high = self.p_none_interval
        rows.append(f"  {UNEXPLAINED:{width}}  {self.p_none:+.2f}  [{low:+.2f}, {high:+.2f}]")
        if abs(self.residual) > 1e-9:
            rows.append(f"  residual of the shares {self.residual:+.2f}")
        lost = round(self.p_all * self.seeds)
        repairs = [f"{' and '.join(each.causes)} ({each.restored} of {lost})" for each in self.repairs]
        rows.append(f"  removals that restore: {', '.join(repairs) or 'none of at most two causes'}")
        rows += [f"  no cause: {name}, {reason}" for name, reason in self.dropped.items()]
        return head + rows
