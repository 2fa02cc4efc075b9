"""Rules about all targets of a scene: probability of detection, identity switches, false tracks, false alarms.

Shares and rates are taken over one second at least, since in a few frames a single miss would be a large share: the
frames that a shorter scene lacks count as right.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

import irsim
from irsim.errors import counted
from irsim.types import Truth
from irtrack.metrics import Comparison, DetectionFigures, ManyFigures
from irtrack.metrics.multiple import NOBODY
from irtrack.tracks import DetectionSet, TrackSet

BEST = 0.999
"""Largest margin of a rule that was tested: below that of an untested one."""

UNTESTED = math.inf
"""Margin of a rule without a target to test it on; `irtrack.falsify.rules.margin` limits it."""

_OF_FRAMES = ("frames", "times", "step_ms", "cpu_ms")
"""Columns with a value for each frame; other columns have one for each track or detection in a frame."""


@dataclass(frozen=True, eq=False)
class SceneTrace:
    """Tracks of many targets, or detections, beside the ground truth of their scene (for one target:
    `irtrack.metrics.Trace`).

    rate_hz   frames a second
    """

    found: TrackSet | DetectionSet
    truths: tuple[Truth, ...]
    rate_hz: float

    @property
    def indices(self) -> np.ndarray:
        """Indices of the frames, (k,)."""
        return self.found.frames

    def first(self, n: int) -> SceneTrace:
        """Return the trace of the first n frames, as if the source had ended there."""
        rows = int(np.searchsorted(self.found.frame, self.indices[n - 1], side="right"))
        cut: dict[str, Any] = {}
        for name, value in self._columns():
            cut[name] = value[: n if name in _OF_FRAMES else rows]
        return replace(self, found=replace(self.found, **cut))

    def same_as(self, other: object) -> bool:
        """Return True if all values of two traces except times are equal, bit for bit."""
        if not isinstance(other, SceneTrace):
            return False
        pairs = zip(self._columns(), other._columns(), strict=False)
        return all(
            (name, np.asarray(one).shape, np.asarray(one).tobytes())
            == (own, np.asarray(two).shape, np.asarray(two).tobytes())
            for (name, one), (own, two) in pairs
            if name not in ("step_ms", "cpu_ms")
        )

    def _columns(self) -> list[tuple[str, Any]]:
        values = [(each.name, getattr(self.found, each.name)) for each in fields(self.found)]
        return [(name, value) for name, value in values if isinstance(value, np.ndarray | tuple)]

    @cached_property
    def many(self) -> ManyFigures:
        """Figures of tracks of many targets."""
        assert isinstance(self.found, TrackSet)
        return ManyFigures(Comparison.of(self.truths, self.found), self.rate_hz)

    @cached_property
    def detection(self) -> DetectionFigures:
        """Figures of detections."""
        assert isinstance(self.found, DetectionSet)
        return DetectionFigures.of(self.truths, self.found, self.rate_hz)

    @cached_property
    def hits(self) -> dict[str, np.ndarray]:
        """By the id of each target: whether it was found, in each frame in which it is not ignored, (m,)."""
        if isinstance(self.found, DetectionSet):
            names, number = self.detection.names, self.detection.number
            return {name: np.isfinite(self.detection.score[number == k]) for k, name in enumerate(names)}
        present, matches = self.many.present, self.many.matches
        return {
            name: matches[present[:, k], k] != NOBODY
            for k, name in enumerate(self.many.comparison.names)
            if present[:, k].any()
        }

    @cached_property
    def switches(self) -> list[tuple[int, str]]:
        """Identity switches in order: (index of the frame, id of the target)."""
        found = []
        for name, column in zip(self.many.comparison.names, self.many.matches.T, strict=True):
            rows = np.flatnonzero(column != NOBODY)
            changed = rows[1:][np.diff(column[rows]) != 0]
            found += [(int(self.indices[row]), name) for row in changed]
        return sorted(found)

    @property
    def at_least_a_second(self) -> float:
        """Number of frames, at least those of one second."""
        return max(float(len(self.indices)), self.rate_hz)


def _of(target: str | None, names: Sequence[str]) -> list[str]:
    return [name for name in names if target in (None, name)]


def pd_margin(rule: irsim.PdAtLeast, trace: SceneTrace) -> float:
    """Return Pd / share - 1, where Pd is the share of positions found, over at least one second of each target."""
    hits = [trace.hits[name] for name in _of(rule.target, list(trace.hits))]
    if not hits:
        return UNTESTED
    missed = sum(int((~each).sum()) for each in hits)
    positions = max(sum(map(len, hits)), trace.rate_hz * len(hits))
    return float(min((1 - missed / positions) / rule.share - 1, BEST))


def pd_requirement(rule: irsim.PdAtLeast) -> str:
    whose = "all targets" if rule.target is None else rule.target
    return f"a probability of detection of at least {rule.share:g}, of {whose}"


def pd_result(rule: irsim.PdAtLeast, trace: SceneTrace) -> str:
    """Describe the share found, and the target that was missed most often."""
    hits = {name: trace.hits[name] for name in _of(rule.target, list(trace.hits))}
    if not hits:
        return "no target"
    found, positions = sum(int(each.sum()) for each in hits.values()), sum(map(len, hits.values()))
    worst = min(hits, key=lambda name: hits[name].mean())
    rest = f"; of {worst} in {int(hits[worst].sum())} of {counted(len(hits[worst]), 'frame')}" if len(hits) > 1 else ""
    return f"{found} of {counted(positions, 'position')} found{rest}"


def switches_margin(rule: irsim.SwitchesAtMost, trace: SceneTrace) -> float:
    """Return the share of the allowed switches that is left."""
    if not _of(rule.target, list(trace.hits)):
        return UNTESTED
    return _left(rule.count, len(_own_switches(rule, trace)), 1.0)


def switches_requirement(rule: irsim.SwitchesAtMost) -> str:
    whose = "" if rule.target is None else f" of {rule.target}"
    return f"no more identity switches{whose} than {rule.count}"


def switches_result(rule: irsim.SwitchesAtMost, trace: SceneTrace) -> str:
    own = _own_switches(rule, trace)
    return f"{len(own)}, the first at frame {own[0][0]}, of {own[0][1]}" if own else "none"


def _own_switches(rule: irsim.SwitchesAtMost, trace: SceneTrace) -> list[tuple[int, str]]:
    return [each for each in trace.switches if rule.target in (None, each[1])]


def false_tracks_margin(rule: irsim.FalseTracksAtMost, trace: SceneTrace) -> float:
    """Return the share of the allowed rate that is left; a rate of 1 a minute is the unit where less is allowed."""
    return _left(rule.per_minute, _false_tracks(trace), 1.0)


def _false_tracks(trace: SceneTrace) -> float:
    """Return the false tracks a minute."""
    return trace.many.false_tracks * 60 * trace.rate_hz / trace.at_least_a_second


def false_tracks_requirement(rule: irsim.FalseTracksAtMost) -> str:
    return f"at most {rule.per_minute:g} false tracks a minute"


def false_tracks_result(_: irsim.FalseTracksAtMost, trace: SceneTrace) -> str:
    number = counted(trace.many.false_tracks, "false track")
    return f"{number} in {counted(len(trace.indices), 'frame')}, {_false_tracks(trace):.3g} a minute"


def false_alarms_margin(rule: irsim.FalseAlarmsAtMost, trace: SceneTrace) -> float:
    """Return the share of the allowed rate that is left; 0.1 a frame is the unit where less is allowed."""
    return _left(rule.per_frame, len(trace.detection.false_score) / trace.at_least_a_second, 0.1)


def false_alarms_requirement(rule: irsim.FalseAlarmsAtMost) -> str:
    return f"at most {rule.per_frame:g} false alarms a frame"


def false_alarms_result(_: irsim.FalseAlarmsAtMost, trace: SceneTrace) -> str:
    false, frames = trace.detection.false_frame, len(trace.indices)
    if not len(false):
        return f"no false alarm in {counted(frames, 'frame')}"
    most = np.bincount(false, minlength=frames)
    number = f"{counted(len(false), 'false alarm')} in {counted(frames, 'frame')}"
    return f"{number}, {len(false) / frames:.3g} a frame; {most.max()} in frame {trace.indices[most.argmax()]}"


def _left(allowed: float, value: float, unit: float) -> float:
    """Return (allowed - value) / max(allowed, unit): below 0 where the value is larger than allowed."""
    return min((allowed - value) / max(allowed, unit), BEST)
