"""Status calibration: agreement of the reported status and covariance with the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.types import Floats
from irtrack.metrics.statistics import share


def false_tracking(statuses: np.ndarray, off: np.ndarray, counted: np.ndarray) -> float:
    """Return the share 0..1 of frames with the status "tracking" among the counted frames off target; nan where there
    is none.

    statuses (n,) reported statuses; off, counted (n,) bool, see `irtrack.metrics.Trace`.
    """
    return share((statuses == "tracking")[off & counted])


def false_lost(statuses: np.ndarray, off: np.ndarray, counted: np.ndarray) -> float:
    """Return the share 0..1 of frames with the status "lost" among the counted frames on target; nan where there is
    none."""
    return share((statuses == "lost")[~off & counted])


def hidden_tracking(statuses: np.ndarray, hidden: np.ndarray) -> float:
    """Return the share 0..1 of frames with the status "tracking" among the `hidden` frames (fully occluded target)."""
    return share((statuses == "tracking")[hidden])


def lost_late(statuses: np.ndarray, lost_position: int | None) -> float:
    """Return the number of frames from the loss to the status "lost"; nan where the track is not lost.

    Without this status it is the number of frames to the end of the track, a lower bound.
    """
    if lost_position is None:
        return np.nan
    said = np.flatnonzero(statuses[lost_position:] == "lost")
    return float(said[0]) if len(said) else float(len(statuses) - lost_position)


@dataclass(frozen=True, slots=True)
class Return:
    """Reappearance of a target.

    at       position of the first frame in which it counts again
    watched  number of frames in which it counts, from `at` until it is occluded again or the track ends
    after    frames from `at` until the tracker is on target (0: at once); None where it is off target in all of them
    """

    at: int
    watched: int
    after: int | None


def returns(off: np.ndarray, shown: np.ndarray) -> list[Return]:
    """Return the reappearances of the target; off, shown (n,) bool as for `irtrack.metrics.lost.loss`.

    The time to reacquire is counted in frames in which the target counts: "back within 5 frames" is
    ``after is not None and after <= 5``. A target that is visible from the first frame on does not reappear.
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
    """Return the normalised estimation error squared e' P^-1 e of errors (n, 2) px and covariances (n, 2, 2) px^2.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, eq. 5.4.2-1.
    Its mean is 2, the number of dimensions, for a calibrated filter. nan where there is no covariance; inf where it
    has no inverse and the error is not 0.
    """
    # The 2x2 inverse is written out, since the test for a singular matrix needs the determinant.
    a, b, d = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    x, y = offsets[:, 0], offsets[:, 1]
    determinant = a * d - b * b
    with np.errstate(divide="ignore", invalid="ignore"):
        found = (d * x * x - 2 * b * x * y + a * y * y) / determinant
    singular = determinant <= 0
    found[singular] = np.where((x[singular] == 0) & (y[singular] == 0), 0.0, np.inf)
    return np.asarray(found)


def nees_interval(count: int, level: float = 0.95) -> tuple[float, float]:
    """Return the interval of the mean of `count` independent NEES of a calibrated filter in 2-D.

    `count` times the mean is chi-square with 2 `count` degrees of freedom (Bar-Shalom et al. 2001, section 5.4.2).
    Errors in successive frames are correlated: `count` is the number of runs, not of frames.
    """
    from scipy.stats import chi2

    tail = (1 - level) / 2
    return float(chi2.ppf(tail, 2 * count)) / count, float(chi2.ppf(1 - tail, 2 * count)) / count
