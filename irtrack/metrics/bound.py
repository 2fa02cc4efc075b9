"""Errors of tracks as multiples of the Cramér-Rao bound of single frames.

    ratio = root mean square of error / bound, over both axes

Frames before the loss count where the bound holds: a detectability index d of at least LEAST_D, and a bound of at least
LEAST_SD_PX, below which models of shape and truth matter more than noise. A tracker that filters over time may be below
1.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from irsim.types import Floats, TargetBounds
from irtrack.metrics.statistics import mean_interval
from irtrack.metrics.trace import Trace

LEAST_D = 10.0
"""Least detectability index d at which the best estimators reach the bound."""
LEAST_SD_PX = 0.03
"""Smallest bound, px, with which errors are compared."""


@dataclass(frozen=True, slots=True, eq=False)
class TargetBound:
    """Bound of one target in the frames of a source: indices (n,) rising, sds (n, 2) px, d (n,)."""

    indices: np.ndarray
    sds: Floats
    d: Floats

    @classmethod
    def of(cls, rows: Iterable[TargetBounds], target: str) -> TargetBound:
        """Return the bound of a target by id; it has no frames where the target has no bounds."""
        own = [(row.index, row.sd_x, row.sd_y, row.d) for row in rows if row.target == target]
        table = np.array(own, dtype=np.float64).reshape(-1, 4)
        return cls(table[:, 0].astype(np.int64), table[:, 1:3], table[:, 3])

    def at(self, indices: np.ndarray) -> tuple[Floats, Floats]:
        """Return bounds (n, 2) px and d (n,) at frame indices; nan where there is none."""
        sds, d = np.full((len(indices), 2), np.nan), np.full(len(indices), np.nan)
        known = np.isin(indices, self.indices)
        place = np.searchsorted(self.indices, np.asarray(indices)[known])
        sds[known], d[known] = self.sds[place], self.d[place]
        return sds, d

    def holds(self, indices: np.ndarray) -> np.ndarray:
        """Return True at frame indices (n,) in which the bound holds."""
        sds, d = self.at(indices)
        with np.errstate(invalid="ignore"):
            return np.asarray((d >= LEAST_D) & (sds >= LEAST_SD_PX).all(axis=1))

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the values as arrays by name, for a results file."""
        return {"indices": self.indices, "sds": self.sds, "d": self.d}


@dataclass(frozen=True, slots=True)
class BoundFigures:
    """Errors of a tracker against the bound, over all runs with a bound; None where no frame defines the figure.

    runs, lost      number of runs with truth and a bound, and of lost ones among them
    frames          number of frames before the loss in which the bound holds
    ratio           root mean square of error / bound in these frames
    low, high       95 % interval of the ratio over the runs (Student's t of its square)
    bias_x, bias_y      mean error in these frames, px
    spread_x, spread_y  standard deviation of the error in these frames, px
    """

    runs: int
    lost: int
    frames: int
    ratio: float | None = None
    low: float | None = None
    high: float | None = None
    bias_x: float | None = None
    bias_y: float | None = None
    spread_x: float | None = None
    spread_y: float | None = None

    @property
    def lost_share(self) -> float | None:
        """Share of the runs that are lost; None without runs."""
        return self.lost / self.runs if self.runs else None

    def as_dict(self) -> dict[str, Any]:
        return asdict(self) | {"lost_share": self.lost_share}


BIN_FRAMES, MOST_BINS = 30, 8
"""Least number of frames of a bin of d, and largest number of bins."""


def ratios_by_d(traces: Sequence[Trace], bounds: Sequence[TargetBound]) -> Floats:
    """Return (d, root mean square of error / bound, its 95 % ends), (bins, 4), over bins of d of equal numbers of
    frames; frames count as in `bound_figures`.

    The interval is that of Student's t of the mean square over the runs; nan where a bin holds one run.
    """
    rows = []
    for run, (trace, bound) in enumerate(zip(traces, bounds, strict=True)):
        used = trace.held & bound.holds(trace.indices)
        sds, d = bound.at(trace.indices)
        squares = ((trace.offsets / sds)[used] ** 2).mean(axis=1)
        rows.append(np.stack([d[used], squares, np.full(len(squares), run)], axis=1))
    table = np.concatenate(rows) if rows else np.zeros((0, 3))
    table = table[np.argsort(table[:, 0], kind="stable")]
    bins = min(MOST_BINS, len(table) // BIN_FRAMES)
    curve = np.full((bins, 4), np.nan)
    for row, (d, squares, run) in zip(curve, (part.T for part in np.array_split(table, max(bins, 1))), strict=False):
        row[:2] = np.median(d), math.sqrt(squares.mean())
        means = np.array([squares[run == each].mean() for each in np.unique(run)])
        if len(means) > 1:
            _, low, high = mean_interval(means)
            row[2:] = math.sqrt(max(float(low), 0.0)), math.sqrt(float(high))
    return curve


def bound_figures(traces: Sequence[Trace], bounds: Sequence[TargetBound]) -> BoundFigures:
    """Return the errors of traces against the bounds of their targets, one for each trace."""
    scored = [(trace, bound) for trace, bound in zip(traces, bounds, strict=True) if trace.scored.any()]
    lost = sum(trace.lost_position is not None for trace, _ in scored)
    offsets, squares = [], []
    for trace, bound in scored:
        used = trace.held & bound.holds(trace.indices)
        if used.any():
            offsets.append(trace.offsets[used])
            squares.append(((trace.offsets / bound.at(trace.indices)[0])[used] ** 2).mean(axis=1))
    if not offsets:
        return BoundFigures(len(scored), lost, 0)
    together = np.concatenate(offsets)
    _, low, high = mean_interval(np.array([each.mean() for each in squares]))
    (bias_x, bias_y), (spread_x, spread_y) = together.mean(axis=0).tolist(), together.std(axis=0).tolist()
    return BoundFigures(
        runs=len(scored),
        lost=lost,
        frames=len(together),
        ratio=math.sqrt(float(np.concatenate(squares).mean())),
        low=math.sqrt(max(float(low), 0.0)) if math.isfinite(low) else None,
        high=math.sqrt(float(high)) if math.isfinite(high) else None,
        bias_x=bias_x,
        bias_y=bias_y,
        spread_x=spread_x,
        spread_y=spread_y,
    )
