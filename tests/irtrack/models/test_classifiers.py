"""Linear SVM, Platt's probabilities and AdaBoost against scikit-learn's, and in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from oracle_cases import two_classes
from oracles import values_of

from irtrack.models.adaboost import fit_stumps
from irtrack.models.svm import LinearSVM, fit_platt, fit_svm


@pytest.mark.parametrize("seed", range(len(values_of("sklearn"))))
def test_classifiers_equal_scikit_learn(seed: int) -> None:
    """Margins of `LinearSVC`, its sigmoid calibration, decisions of `AdaBoostClassifier` on trees of depth 1."""
    case, theirs = two_classes(seed), values_of("sklearn")[seed]
    x, positive = case["vectors"], case["positive"]
    margins = fit_svm(x, positive, case["cost"]).margins(x)
    np.testing.assert_allclose(margins, theirs["margins"], atol=1e-5)
    np.testing.assert_allclose(fit_platt(margins, positive), (theirs["a"], theirs["c"]), rtol=1e-3)
    stumps = fit_stumps(x, positive, case["rounds"])
    np.testing.assert_allclose(stumps.alpha, theirs["alpha"][: len(stumps.alpha)], atol=1e-9)
    assert (stumps.decisions(x[:, stumps.feature]) > 0).tolist() == theirs["decisions"]


@pytest.mark.parametrize("criterion", ["gini", "error"])
def test_training_error_is_below_its_bound(criterion: str) -> None:
    """The share of wrong examples is at most the product of 2 sqrt(e (1 - e)), after each round."""
    case = two_classes(7)
    x, positive = case["vectors"], case["positive"]
    shares = []
    for rounds in (1, 3, 10, 30):
        stumps = fit_stumps(x, positive, rounds, criterion)  # type: ignore[arg-type]  # one of both words
        wrong = (stumps.decisions(x[:, stumps.feature]) > 0) != positive
        assert wrong.mean() <= stumps.bound
        shares.append(stumps.bound)
    assert shares == sorted(shares, reverse=True)
    assert shares[-1] < 0.5


def test_one_stump_by_hand() -> None:
    """e = 1/6: alpha = ln(5) / 2, bound 2 sqrt(5/36)."""
    x = np.array([[0.0], [1], [2], [3], [4], [5]])
    stumps = fit_stumps(x, np.array([False, False, True, False, True, True]), 1)
    assert stumps.alpha == pytest.approx([np.log(5) / 2])
    assert stumps.threshold[0] in (1.5, 3.5)
    assert stumps.bound == pytest.approx(2 * np.sqrt(5 / 36))
    perfect = fit_stumps(x, x[:, 0] > 2, 9)
    assert len(perfect.alpha) == 1
    assert perfect.threshold == pytest.approx([2.5])


def test_probabilities_do_not_overflow() -> None:
    svm = LinearSVM(np.ones(1), 0.0, 1e3, 0.0)
    logs = svm.log_probabilities(np.array([-1e6, 0.0, 1e6]))
    assert logs == pytest.approx([-1e9, -np.log(2), 0.0])
