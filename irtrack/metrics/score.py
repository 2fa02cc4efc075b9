"""Score: the metrics of one track against one reference.

A metric ("figure") is a line in `irtrack.metrics.figures.OF_TRACE` and a field of `Score`; files, tables and exports
follow from both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np

import irsim
from irsim.types import Floats, Source
from irtrack.errors import InputError
from irtrack.metrics.centre_error import mean_abs, rmse
from irtrack.metrics.figures import OF_TRACE, Figure
from irtrack.metrics.trace import Reference, Trace
from irtrack.types import Track


@dataclass(frozen=True, slots=True)
class CentreFigures:
    """Metrics of the centre errors of a set of frames; None where the set is empty.

    error                   mean Euclidean centre error, px
    abs_x, abs_y            mean |error| per axis, px;  sd_x, sd_y  its standard deviation
    rmse, rmse_x, rmse_y    root mean square error, px
    """

    error: float | None
    abs_x: float | None
    abs_y: float | None
    sd_x: float | None
    sd_y: float | None
    rmse: float | None
    rmse_x: float | None
    rmse_y: float | None

    @classmethod
    def of(cls, offsets: Floats) -> CentreFigures:
        """Return the metrics of centre errors (n, 2) px."""
        if len(offsets) == 0:
            return cls(*[None] * len(fields(cls)))
        errors = np.hypot(offsets[:, 0], offsets[:, 1])
        (abs_x, sd_x), (abs_y, sd_y) = mean_abs(offsets[:, 0]), mean_abs(offsets[:, 1])
        squares = rmse(errors), rmse(offsets[:, 0]), rmse(offsets[:, 1])
        return cls(*map(float, (errors.sum() / len(errors), abs_x, abs_y, sd_x, sd_y, *squares)))


@dataclass(frozen=True, slots=True)
class Score:
    """Metrics of one track; None where no frame defines the metric.

    Scored frames are those after the start frame in which the target is present; held ones are the
    scored frames before the loss (all of them where there is none); a frame counts where the target
    is visible as well (`irtrack.metrics.lost.LOSS_RULE`).

    frames, counted_frames, held_frames
                            numbers of scored frames, of frames that count towards loss and off_share, of held frames
    lost                    True: the track is lost by `irtrack.metrics.lost`; None where no frame is scored
    lost_at                 index of the frame that the loss is dated to
    off_share               share of the frames that count in which the track is off target
    all, held               metrics of the centre errors of all scored frames, and of the held frames
    precision_5, _20        share of scored frames with centre error <= 5, 20 px
    precision_norm          area under the normalised precision curve, 0..1
    success_auc             area under the success curve, 0..1
    overlap                 average overlap over the scored frames (AO of GOT-10k), 0..1
    success_50, _75         share of scored frames with an overlap above .5, .75 (SR of GOT-10k)
    lt_precision, lt_recall, lt_f   long-term precision, recall and F at the threshold of largest F, 0..1
    returns, reacquired     number of reappearances of the target, and of those after which the tracker found it
    reacquired_after        mean number of frames from reappearance until the tracker found the target
    false_tracking          share of frames with the status "tracking", of frames off target
    false_lost              share of frames with the status "lost", of frames on target
    hidden_tracking         share of frames with the status "tracking", of frames with a fully occluded target
    lost_late               frames from the loss to the status "lost" (to the last frame without this status)
    nees                    mean normalised estimation error squared over the held frames; 2 where calibrated
    neff                    mean effective number of particles
    ms_mean, ms_median      wall time of a step (not of the start), ms
    cpu_ms_mean, cpu_ms_median   CPU time of the process in a step, ms
    """

    frames: int
    counted_frames: int
    held_frames: int
    lost: bool | None
    lost_at: int | None
    off_share: float | None
    all: CentreFigures
    held: CentreFigures
    precision_5: float | None
    precision_20: float | None
    precision_norm: float | None
    success_auc: float | None
    overlap: float | None
    success_50: float | None
    success_75: float | None
    lt_precision: float | None
    lt_recall: float | None
    lt_f: float | None
    returns: int
    reacquired: int
    reacquired_after: float | None
    false_tracking: float | None
    false_lost: float | None
    hidden_tracking: float | None
    lost_late: float | None
    nees: float | None
    neff: float | None
    ms_mean: float | None
    ms_median: float | None
    cpu_ms_mean: float | None
    cpu_ms_median: float | None

    def as_dict(self) -> dict[str, Any]:
        """Return the metrics by name (`FIGURES`) as plain values for JSON or a table."""
        return {name: self.figure(name) for name in FIGURES}

    def figure(self, name: str) -> Any:
        """Return a metric of `FIGURES` by name; None where undefined."""
        group, inner = _GROUPED.get(name, (None, name))
        return getattr(self if group is None else getattr(self, group), inner)

    @classmethod
    def from_dict(cls, flat: Mapping[str, Any]) -> Score:
        """Return the score from the dictionary of `as_dict`; true and false may be 1 and 0, as in SQLite."""
        values: dict[str, Any] = {}
        for field in fields(cls):
            if field.name in _SUFFIX:
                suffix = _SUFFIX[field.name]
                values[field.name] = CentreFigures(*(flat[each.name + suffix] for each in fields(CentreFigures)))
            else:
                value = flat[field.name]
                values[field.name] = None if value is None else FIGURES[field.name].kind(value)
        return cls(**values)


_SUFFIX = {"all": "", "held": "_held"}
_GROUPED = {
    each.name + suffix: (group, each.name) for group, suffix in _SUFFIX.items() for each in fields(CentreFigures)
}
"""Metrics of centre errors by name in `FIGURES`: (field of `Score`, field of `CentreFigures`)."""


def _figures() -> dict[str, Figure]:
    found: dict[str, Figure] = {}
    for name, hint in get_type_hints(Score).items():
        if name in _SUFFIX:
            found |= {each.name + _SUFFIX[name]: Figure(None, "px", "less") for each in fields(CentreFigures)}
        else:
            kind = next((each for each in get_args(hint) if each is not type(None)), hint)
            found[name] = replace(OF_TRACE[name], kind=kind)
    return found


FIGURES: dict[str, Figure] = _figures()
"""Descriptions of the metrics of `Score.as_dict` by name."""


def score_trace(trace: Trace) -> Score:
    """Return the metrics of a trace."""
    figures: dict[str, Any] = {name: _finite(figure.of(trace)) for name, figure in OF_TRACE.items() if figure.of}
    everywhere = CentreFigures.of(trace.offsets[trace.scored])
    held = everywhere if trace.lost_position is None else CentreFigures.of(trace.offsets[trace.held])
    return Score(all=everywhere, held=held, **figures)


def _finite(value: Any) -> Any:
    """Return a value as a number of Python; None where it is not finite."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if value is None or (isinstance(value, float) and not math.isfinite(value)) else value


def score(track: Track, against: Reference | str | Path | irsim.Scenario | Source) -> Score:
    """Return the metrics of a track; the start frame, in which the tracker is given the box, is not scored.

    against   the source that the track was run on, as `irtrack.run` takes it (a scenario is rendered again for its
              ground truth), or a `Reference` of any frames; frames that the track lacks are left out

    InputError where the track is of another source, and as for `irsim.open_source`.
    """
    if not isinstance(track, Track):
        raise InputError(f"track: a {type(track).__name__}; allowed: a Track, the result of irtrack.run")
    if isinstance(against, Reference):
        return score_trace(Trace.of(track, against))
    source = irsim.open_source(against)
    if source.hash != track.source_hash:
        seeds = "" if source.seed == track.scene_seed else f" with seed {track.scene_seed}, not {source.seed}"
        raise InputError(
            f"source: {source.name} is not the source of the track; allowed: {track.source}{seeds}, unchanged"
        )
    return score_trace(Trace.of(track, Reference.of(source.truths(), track.target)))
