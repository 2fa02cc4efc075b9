"""Association of detections with predicted tracks: nearest neighbours, probabilities, and the k best assignments.

Log-likelihood ratios L (n, m) compare "detection j is of track i" with "detection j is false or new, track i is
missed"; -inf outside the gate:

    L = ln P_D + ln N(z; z_i, S_i) + amplitude - ln(1 - P_D) - ln(clutter)

S. Blackman, R. Popoli, "Design and Analysis of Modern Tracking Systems", 1999, chapters 6 and 7.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from math import log

import numpy as np
import numpy.typing as npt

from irsim.types import Floats

Pairs = npt.NDArray[np.int64]
"""(k, 2): rows of track and detection."""

LEVEL_SD = 0.4
"""Standard deviation of the logarithm of a target's score about its level. Chosen here: matched-filter scores of a
fluctuating point source scatter by about a third."""
MOST_AMPLITUDE = 5.0
"""Largest absolute logarithm of the likelihood ratio of amplitudes: scores change the odds by at most 150."""
EVENTS = 10_000
"""Largest number of joint events of a cluster for which `joint_probabilities` is exact."""
_IMPOSSIBLE = 1e9


def amplitude_ratios(level: Floats, scores: Floats, clutter_score: float) -> Floats:
    """Return ln p1(score) - ln p0(score), (n, m), for a target of a level (n,) and for clutter.

    p1 is log-normal about the level; p0 is exponential above the least score of the frame, with the mean score of false
    detections (S. Blackman, R. Popoli 1999, section 6.6: amplitude as a feature).
    """
    least = float(scores.min())
    apart = np.log(scores)[None] - np.log(np.maximum(level, 1e-9))[:, None]
    mean = max(clutter_score - least, 0.05 * clutter_score)
    clutter = -(scores - least) / mean - log(mean)
    ratios: Floats = -0.5 / LEVEL_SD**2 * apart**2 - (np.log(LEVEL_SD * (2 * np.pi) ** 0.5 * scores) + clutter)
    return np.minimum(np.maximum(ratios, -MOST_AMPLITUDE), MOST_AMPLITUDE)  # np.clip is slower on small arrays


def nearest_neighbours(L: Floats) -> Pairs:
    """Return the pairs of the global nearest neighbours: the assignment with the largest sum of positive L."""
    from scipy.optimize import linear_sum_assignment  # 0.4 s to import

    gain = np.maximum(L, 0.0)
    pairs = np.stack(linear_sum_assignment(gain, maximize=True), axis=1)
    found: Pairs = pairs[gain[pairs[:, 0], pairs[:, 1]] > 0]
    return found


def joint_probabilities(L: Floats, events: int = EVENTS) -> Floats:
    """Return the probabilities (n, m) that a detection is of a track, over all joint events (JPDA).

    T. Fortmann, Y. Bar-Shalom, M. Scheffe, "Sonar tracking of multiple targets using joint probabilistic data
    association", IEEE J. Oceanic Engineering 8(3), 1983: each detection is of one track at most, each track has one
    detection at most. Tracks that share detections form a cluster, whose events are listed one by one. Clusters of more
    than `events` events are approximated by R. Fitzgerald's weights B = G / (S_t + S_d - G + 1) ("Development of
    practical PDA logic for multitarget tracking by microprocessor", ACC 1986, eq. 7), where G is the likelihood ratio,
    S_t its sum over detections, S_d its sum over tracks.
    """
    ratios = np.exp(L)
    beta: Floats = ratios / (1 + ratios.sum(axis=1, keepdims=True))
    for rows, columns in clusters(ratios > 0):
        part = ratios[np.ix_(rows, columns)]
        if np.prod(1.0 + (part > 0).sum(axis=1)) <= events:
            beta[np.ix_(rows, columns)] = _exact(part)
        else:
            sums = part.sum(axis=1, keepdims=True) + part.sum(axis=0, keepdims=True) - part
            beta[np.ix_(rows, columns)] = part / (sums + 1)
    return beta


def clusters(gated: npt.NDArray[np.bool_]) -> Iterator[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]]:
    """Yield (rows, columns) of each group of two or more tracks that share detections, directly or through other
    tracks."""
    left = np.asarray(gated[:, gated.sum(axis=0) > 1].any(axis=1), dtype=bool)
    while left.any():
        rows = np.zeros(len(gated), bool)
        rows[np.argmax(left)] = True
        while True:
            columns = gated[rows].any(axis=0)
            grown = np.asarray(left & gated[:, columns].any(axis=1))
            if (grown == rows).all():
                break
            rows = grown
        left = left & ~rows
        yield np.flatnonzero(rows), np.flatnonzero(columns)


def _exact(ratios: Floats) -> Floats:
    """Return the probabilities (n, m) from likelihood ratios (n, m), by a list of all joint events.

    An event is a row: the detection of each track so far, or -1.
    """
    chosen, weight = np.zeros((1, 0), np.int64), np.ones(1)
    for row in ratios:
        options = np.flatnonzero(row > 0)
        parts, weights = [np.insert(chosen, chosen.shape[1], -1, axis=1)], [weight]
        for j in options:
            free = (chosen != j).all(axis=1)
            parts.append(np.insert(chosen[free], chosen.shape[1], j, axis=1))
            weights.append(weight[free] * row[j])
        chosen, weight = np.concatenate(parts), np.concatenate(weights)
    beta = np.stack([np.bincount(each + 1, weight, ratios.shape[1] + 1)[1:] for each in chosen.T])
    found: Floats = beta / weight.sum()
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Assignment:
    """Columns (n,) assigned to the rows of a cost table, and the sum of their costs."""

    cost: float
    columns: npt.NDArray[np.int64]


def k_best(cost: Floats, k: int, worst: float = np.inf) -> Iterator[Assignment]:
    """Yield the k assignments of least cost of a table (n, m), n <= m, best first; none above `worst`.

    K. Murty, "An algorithm for ranking all the assignments in order of increasing cost", Operations Research 16(3),
    1968. An infinite cost forbids its pair.
    """
    table = np.where(np.isfinite(cost), cost, _IMPOSSIBLE)
    first = _solved(table)
    waiting: list[tuple[float, int, npt.NDArray[np.int64], Floats, int]] = []
    count = 0
    if first is not None and first[0] <= worst:
        waiting.append((first[0], count, first[1], table, 0))
    while waiting and k > 0:
        total, _, columns, table, fixed = heapq.heappop(waiting)
        yield Assignment(total, columns)
        k -= 1
        for row in range(fixed, len(table)):  # earlier rows are assigned as in the parent
            other = table.copy()
            other[row, columns[row]] = _IMPOSSIBLE
            least = other[row].min() - table[row, columns[row]]
            contested = (table[:, columns[row]] < _IMPOSSIBLE).sum() > 1
            if total + (min(least, 0.0) if contested else least) <= worst:
                found = _solved(other)
                if found is not None and found[0] <= worst:
                    count += 1
                    heapq.heappush(waiting, (found[0], count, found[1], other, row))
            kept = table[row, columns[row]]
            table = table.copy()
            table[row], table[:, columns[row]] = _IMPOSSIBLE, _IMPOSSIBLE
            table[row, columns[row]] = kept


def _solved(table: Floats) -> tuple[float, npt.NDArray[np.int64]] | None:
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(table)
    total = float(table[rows, columns].sum())
    return None if total >= _IMPOSSIBLE / 2 else (total, columns)
