"""The figures of one track against one reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, get_args, get_type_hints

import numpy as np

from irsim.types import Floats
from irtrack.metrics.centre import (
    PRECISION_NORM,
    area,
    centre_errors,
    mean_abs,
    normalised_errors,
    precision_curve,
    rmse,
)
from irtrack.metrics.loss import loss, off_frames
from irtrack.metrics.overlap import overlaps, success_curve, widened
from irtrack.metrics.reference import Reference
from irtrack.types import Track


@dataclass(frozen=True, slots=True)
class CentreFigures:
    """Figures of the centre errors of some frames; None where there is no frame.

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
        """The figures of errors (n, 2) px."""
        if len(offsets) == 0:
            return cls(*[None] * len(fields(cls)))
        errors = np.hypot(offsets[:, 0], offsets[:, 1])
        (abs_x, sd_x), (abs_y, sd_y) = mean_abs(offsets[:, 0]), mean_abs(offsets[:, 1])
        squares = rmse(errors), rmse(offsets[:, 0]), rmse(offsets[:, 1])
        return cls(float(errors.mean()), abs_x, abs_y, sd_x, sd_y, *squares)


@dataclass(frozen=True, slots=True)
class Score:
    """What one track scores. A figure is None where no frame says anything about it.

    Scored frames are those after the start frame in which the target is present; held ones are the
    scored frames before the loss (all of them where there is none).

    frames, held_frames     how many frames were scored, and how many of them before the loss
    lost                    lost by `irtrack.metrics.loss`; None where nothing was scored
    lost_at                 index of the frame that the loss is dated to
    off_share               share of the scored frames with a visible target that are off (far from it)
    all, held               figures of the centre errors of all scored frames, and of the held ones
    precision_5, _20        share of scored frames with centre error <= 5, 20 px
    precision_norm          area under the normalised precision curve, 0..1
    success_auc             area under the success curve, 0..1
    ms_mean, ms_median      wall time of a step (not of the start), ms
    """

    frames: int
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
    ms_mean: float | None
    ms_median: float | None

    def as_dict(self) -> dict[str, Any]:
        """The figures by name (`FIGURES`), plain values for JSON or a table."""
        flat: dict[str, Any] = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, CentreFigures):
                flat |= {name + _SUFFIX[field.name]: figure for name, figure in asdict(value).items()}
            else:
                flat[field.name] = value
        return flat

    @classmethod
    def from_dict(cls, flat: Mapping[str, Any]) -> Score:
        """The inverse of `as_dict`; truth values may be 0 and 1, as SQLite keeps them."""
        values: dict[str, Any] = {}
        for field in fields(cls):
            if field.name in _SUFFIX:
                suffix = _SUFFIX[field.name]
                values[field.name] = CentreFigures(*(flat[each.name + suffix] for each in fields(CentreFigures)))
            else:
                value = flat[field.name]
                values[field.name] = bool(value) if FIGURES[field.name] is bool and value is not None else value
        return cls(**values)


_SUFFIX = {"all": "", "held": "_held"}


def _figures() -> dict[str, type]:
    found: dict[str, type] = {}
    for name, hint in get_type_hints(Score).items():
        if name in _SUFFIX:
            found |= {each.name + _SUFFIX[name]: float for each in fields(CentreFigures)}
        else:
            found[name] = next((each for each in get_args(hint) if each is not type(None)), hint)
    return found


FIGURES: dict[str, type] = _figures()
"""The name of every figure in `Score.as_dict`, and whether it is an int, a bool or a float (or None)."""


def score(track: Track, reference: Reference) -> Score:
    """The figures of a track; the start frame, given to the tracker, is not scored.

    `reference` may hold any frames; those that the track has not seen are left out.
    """
    truth = reference.at(track.indices)
    scored = truth.present
    scored[:1] = False
    centers, sizes, true_sizes = track.centers, widened(track.sizes), widened(truth.sizes)
    errors = centre_errors(centers, truth.centers)
    off = off_frames(errors, truth.diagonals, truth.accuracy)
    counted = scored & truth.shown
    lost_position = loss(off, counted)
    held = scored.copy()
    if lost_position is not None:
        held[lost_position:] = False

    precise = errors[scored] <= truth.accuracy[scored]
    at_5, at_20 = precision_curve(errors[scored], np.array([5.0, 20.0]), precise)
    normalised = normalised_errors(centers, truth.centers, true_sizes)[scored]
    overlap = overlaps(centers, sizes, truth.centers, true_sizes)[scored]
    offsets = centers - truth.centers
    figures = {
        "off_share": float(off[counted].mean()) if counted.any() else np.nan,
        "precision_5": at_5,
        "precision_20": at_20,
        "precision_norm": area(precision_curve(normalised, PRECISION_NORM, precise)),
        "success_auc": area(success_curve(overlap)),
        "ms_mean": float(np.mean(track.step_ms[1:])) if len(track.step_ms) > 1 else np.nan,
        "ms_median": float(np.median(track.step_ms[1:])) if len(track.step_ms) > 1 else np.nan,
    }
    return Score(
        frames=int(scored.sum()),
        held_frames=int(held.sum()),
        lost=lost_position is not None if scored.any() else None,
        lost_at=None if lost_position is None else int(track.indices[lost_position]),
        all=CentreFigures.of(offsets[scored]),
        held=CentreFigures.of(offsets[held]),
        **{name: float(value) if np.isfinite(value) else None for name, value in figures.items()},
    )
