"""The ensemble of pixel classifiers: least squares, two Gaussians against Bayes' error, and a crossing."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np
from tracker_scenes import blob, follow

from irsim.types import Box, Floats
from irtrack.features.ensemble import Ensemble, balanced, pixel_features, weak_fit, with_constant
from irtrack.registry.table import make


def two_gaussians(seed: int, count: int) -> tuple[Floats, Floats]:
    """Features (2 count, 9) and labels of two classes 2 standard deviations apart."""
    rng = np.random.default_rng(seed)
    labels = np.repeat([1.0, -1.0], count)
    features = rng.standard_normal((2 * count, 9))
    features[:, [1, 4]] += labels[:, None] / np.sqrt(2)
    return features, labels


def test_weak_fit_is_weighted_least_squares() -> None:
    features, labels = two_gaussians(1, 200)
    x, weights = with_constant(features), np.random.default_rng(2).random(400)
    theirs = np.linalg.lstsq(np.sqrt(weights)[:, None] * x, np.sqrt(weights) * labels, rcond=None)[0]
    np.testing.assert_allclose(weak_fit(x, labels, weights), theirs, rtol=1e-6, atol=1e-8)
    assert balanced(np.array([1.0, -1.0, -1.0])).tolist() == [0.5, 0.25, 0.25]


def test_error_on_two_gaussians_is_that_of_bayes() -> None:
    """Within two standard errors, after renewal too; a changed world is learned within five frames."""
    features, labels = two_gaussians(3, 4000)
    fresh, truth = two_gaussians(4, 4000)
    bayes = NormalDist().cdf(-1)
    limit = bayes + 2 * np.sqrt(bayes * (1 - bayes) / 8000)
    ensemble = Ensemble.fitted(features, labels, 5)
    assert (np.sign(ensemble.scores(fresh)) != truth).mean() < limit
    assert (np.sign(ensemble.updated(features, labels, 5, keep=4).scores(fresh)) != truth).mean() < limit
    shifted = np.roll(features, 2, axis=1)
    before = (np.sign(ensemble.scores(shifted)) != labels).mean()
    for _ in range(5):
        ensemble = ensemble.updated(shifted, labels, 5, keep=4)
    after = (np.sign(ensemble.scores(np.roll(fresh, 2, axis=1))) != truth).mean()
    assert before > 0.4
    assert after < limit


def test_features_of_a_ramp() -> None:
    """A ramp along x has all its gradient in the bin of +x, 4 counts a pixel times 8 over the grey range."""
    image = np.tile(np.arange(0, 80, 4, dtype=np.uint8), (12, 1))
    found = pixel_features(image, (4, 3, 12, 9), 0.0, 100.0)
    assert found.shape == (6, 8, 9)
    np.testing.assert_allclose(found[..., 0], 4 * 8 / 100)
    assert found[..., 1:8].max() == 0
    np.testing.assert_allclose(found[0, :, 8], np.arange(16, 48, 4) / 100)


def test_first_frame_keeps_the_ensemble_from_drifting() -> None:
    """Mean error without and with the first frame's pixels among those learned: the drift is of some 2 px."""
    errors = []
    for anchor in (0, 3):
        row = []
        for seed in range(2):
            scene = blob(seed, count=25)
            found = follow(
                make("ensemble", {"anchor": anchor}), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
            )
            row += [np.hypot(*np.subtract(e.center, at)) for e, (_, at) in zip(found, scene[1:], strict=True)]
        errors.append(np.mean(row))
    assert errors[1] < 1.2
    assert errors[1] < errors[0] - 1
