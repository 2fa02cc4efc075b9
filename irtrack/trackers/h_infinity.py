"""`h_infinity`: the filter with the least worst-case error, in place of a Kalman filter."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.types import Floats
from irtrack.filters import kalman
from irtrack.trackers.base import Spread
from irtrack.trackers.kalman import PositionFilter

MOST_SHARE = 0.99
"""Largest share of the feasible theta: at 1 the covariance is infinite."""


class HInfinity(PositionFilter):
    """H-infinity filter of a target at nearly constant velocity, with the measurements of `kalman`.

    Ling 2005, of which only the title is available. The filter is that of D. Simon, "Optimal State Estimation", 2006,
    eq. 11.89:

        M = (I - theta S P + H' R^-1 H P)^-1,   K = P M H' R^-1,   P <- F P M F' + Q,
        feasible where P^-1 - theta S > 0

    It bounds the sum of squared prediction errors, weighted by S, by 1 / theta times the sum of squared disturbances in
    units of P, Q and R, whatever these are; theta = 0 gives the Kalman filter. S = diag(1, 1, s, s), s being
    `speed_weight` (chosen here: 0, since places are scored). A frame without a measurement is predicted as by a Kalman
    filter.

    Simon's eq. 11.90 requires only P^-1 - theta S + H' R^-1 H > 0. That is enough for M, but not for the bound: at the
    last prediction no measurement is left to correct the error (B. Hassibi, A. Sayed, T. Kailath, "Indefinite-Quadratic
    Estimation and Control", 1999, section 4.2, the a-priori filter). With a theta for each step, the bound is that of
    the sum of theta times the squared error. The covariance is P M, larger than that of the Kalman filter: a bound for
    the worst case, not a variance.
    """

    source: ClassVar[str] = "Ling 2005; Simon 2006, section 11.3"

    theta: Annotated[float | None, Field(ge=0, le=1e6)] = None
    """theta, px^-2; in steps where it is not given or not feasible, `share` of the largest feasible value."""
    share: Annotated[float, Field(ge=0, le=MOST_SHARE)] = 0.5
    """Share of the largest feasible theta."""
    speed_weight: Spread = 0.0
    """Weight s of squared errors of velocity, frames^2, against those of place."""

    def updated(self, mean: Floats, covariance: Floats, place: Floats) -> tuple[Floats, Floats]:
        """Return mean and covariance P M after a measured position (2,) px."""
        H, R = self._measured(mean)
        _, posterior = kalman.update(mean, covariance, place, H, R)  # posterior^-1 = P^-1 + H' R^-1 H
        after = np.linalg.solve(np.eye(4) - self.feasible_theta(covariance) * posterior * self._root**2, posterior)
        after = (after + after.T) / 2
        nu, _ = kalman.innovation(mean, covariance, place, H, R)
        return mean + after @ H.T @ np.linalg.solve(R, nu), after

    def feasible_theta(self, covariance: Floats) -> float:
        """Return theta of a step, from the predicted covariance P (4, 4)."""
        largest = 1 / float(np.linalg.eigvalsh(self._root[:, None] * covariance * self._root).max())
        return self.theta if self.theta is not None and self.theta < largest else self.share * largest

    @property
    def _root(self) -> Floats:
        """Square root of the diagonal of S, (4,)."""
        root: Floats = np.sqrt(np.array([1.0, 1.0, self.speed_weight, self.speed_weight]))
        return root
