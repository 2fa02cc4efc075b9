"""How likely a wandering level is, beside the closed form by the whole covariance."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.measure.level import _likelihood


@pytest.mark.parametrize("number", [np.arange(12), np.array([0, 1, 4, 5, 6, 11, 12, 13, 20, 21, 22, 30])])
def test_the_likelihood_is_that_of_the_whole_covariance(number: np.ndarray) -> None:
    """Harville (1974): -1/2 (log |V| + log |X' V^-1 X| - log |X' X| + y' P y), X a column of ones and
    P = V^-1 - V^-1 X (X' V^-1 X)^-1 X' V^-1; frames that were left out lie between."""
    series, ones = 7000 + np.random.default_rng(3).normal(0, 2, 12), np.ones(12)
    sigmas, times, known = np.array([0.1, 1.0, 8.0]), np.array([1.0, 5.0, 40.0]), 0.3
    found = _likelihood(series, np.exp(-np.diff(number)[:, None] / times), sigmas, known)
    for row, time in enumerate(times):
        for column, sigma in enumerate(sigmas):
            apart = np.abs(np.subtract.outer(number, number))
            covariance = sigma**2 * np.exp(-apart / time) + known * np.eye(12)
            inverse = np.linalg.inv(covariance)
            weight = ones @ inverse @ ones
            left = series - (ones @ inverse @ series) / weight
            entropy = np.linalg.slogdet(covariance)[1] + np.log(weight) - np.log(12)
            assert found[row, column] == pytest.approx(-0.5 * (entropy + left @ inverse @ left), rel=1e-9)
