"""Whether a tracker's status says what is so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.types import Floats
from irtrack.metrics.statistics import share


def false_tracking(statuses: np.ndarray, off: np.ndarray, counted: np.ndarray) -> float:
    """Share 0..1 of the off frames in which it says "tracking"; nan where no counted frame is off.

    statuses (n,) words; off, counted (n,) bool, see `irtrack.metrics.trace_.Trace`.
    """
    return share((statuses == "tracking")[off & counted])


def false_lost(statuses: np.ndarray, off: np.ndarray, counted: np.ndarray) -> float:
    """Share 0..1 of the frames on a visible target in which it says "lost"; nan where there is none."""
    return share((statuses == "lost")[~off & counted])


def hidden_tracking(statuses: np.ndarray, hidden: np.ndarray) -> float:
    """Share 0..1 of the frames in which nothing of the target is to be seen and it says "tracking"."""
    return share((statuses == "tracking")[hidden])


def lost_late(statuses: np.ndarray, lost_position: int | None) -> float:
    """Frames from the loss (its position) until it says "lost"; nan where the track is not lost.

    Where it never says so: the frames to the track's end, the least that it can be.
    """
    if lost_position is None:
        return np.nan
    said = np.flatnonzero(statuses[lost_position:] == "lost")
    return float(said[0]) if len(said) else float(len(statuses) - lost_position)


@dataclass(frozen=True, slots=True)
class Return:
    """A target's coming back into sight.

    at       position of the first frame in which it counts again
    watched  how many frames it then counts, until it is hidden again or the track ends
    after    frames from `at` until the tracker is on it (0: at once); None where it was not, while it was watched
    """

    at: int
    watched: int
    after: int | None


def returns(off: np.ndarray, shown: np.ndarray) -> list[Return]:
    """Every time that the target comes back into sight; off, shown (n,) bool as for `irtrack.metrics.lost.loss`.

    The time to reacquire is counted in frames in which the target counts: "back within 5 frames" is
    ``after is not None and after <= 5``. A target that shows from the first frame on has not come back.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], shown, [False]]).astype(np.int8)))
    found = []
    for begin, end in edges.reshape(-1, 2).tolist():
        if begin == 0:
            continue
        on = np.flatnonzero(~off[begin:end])
        found.append(Return(begin, end - begin, int(on[0]) if len(on) else None))
    return found


def nees(offsets: Floats, covariances: Floats) -> Floats:
    """(n,) normalised estimation error squared e' P^-1 e of errors (n, 2) px and covariances (n, 2, 2) px^2.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, eq. 5.4.2-1.
    Of an honest filter its mean is 2, the number of dimensions. nan where there is no covariance;
    inf where it has no inverse and the error is none of what it allows.
    """
    # The inverse of a 2x2 matrix written out: one without an inverse gives a plain number to test for.
    a, b, d = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    x, y = offsets[:, 0], offsets[:, 1]
    determinant = a * d - b * b
    with np.errstate(divide="ignore", invalid="ignore"):
        found = (d * x * x - 2 * b * x * y + a * y * y) / determinant
    singular = determinant <= 0
    found[singular] = np.where((x[singular] == 0) & (y[singular] == 0), 0.0, np.inf)
    return np.asarray(found)


def nees_interval(count: int, level: float = 0.95) -> tuple[float, float]:
    """Within which the mean of `count` independent NEES of an honest filter in 2-D lies with that probability.

    Chi-square of 2 n degrees of freedom over n (the same, section 5.4.2). Errors of one track follow
    each other: count runs, not frames.
    """
    from scipy.stats import chi2

    tail = (1 - level) / 2
    return float(chi2.ppf(tail, 2 * count)) / count, float(chi2.ppf(1 - tail, 2 * count)) / count
