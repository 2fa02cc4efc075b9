"""Maximum-likelihood fits of position and amplitude to drawn frames of a scene whose target stands still."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import ndtr

from irsim.render.bounds import FrameInformation
from irsim.render.frame import NO_SHIFTS
from irsim.render.moments import MeanCounts
from irsim.scenario.model import Scenario

STEP = 0.05

Score = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Derivative of the log-likelihood of counts (draws, n) by their means (draws, n)."""


def with_noise(scenario: Scenario, counts: float) -> Scenario:
    """Return the scenario with a NETD of `counts`."""
    camera = scenario.camera
    netd_mk = camera.netd_mk * counts / camera.response().noise
    return scenario.model_copy(update={"camera": camera.model_copy(update={"netd_mk": netd_mk})})


def drawn(scenario: Scenario, draws: int) -> np.ndarray:
    """Return frames 0 .. draws-1, (draws, n) counts, of a scene that stands still."""
    renderer = FrameInformation(scenario).renderer
    light = renderer.light(0)
    return np.stack([renderer.sensor.expose(light, index).ravel() for index in range(draws)]).astype(np.float64)


def fit(scenario: Scenario, images: np.ndarray, score: Score, target: str = "one", steps: int = 12) -> np.ndarray:
    """Return the fitted displacements (draws, 2), px, by Fisher scoring from the truth.

    The composite mean is expanded to the second order in x and y, and linear in the amplitude.
    """
    information = FrameInformation(scenario)
    means = MeanCounts(information.renderer)
    at = {
        (x, y): means.of(0, {target: (STEP * x, STEP * y)} if x or y else NO_SHIFTS).ravel()
        for x in (-1, 0, 1)
        for y in (-1, 0, 1)
    }
    own = at[0, 0]
    base = means.without(0, target, None).ravel()
    derivatives = information.derivatives(0, target, whole=True)
    assert derivatives is not None
    along, down, added = (part.ravel() for part in derivatives.values)
    xx = (at[1, 0] + at[-1, 0] - 2 * own) / STEP**2
    yy = (at[0, 1] + at[0, -1] - 2 * own) / STEP**2
    xy = (at[1, 1] + at[-1, -1] - at[1, -1] - at[-1, 1]) / (4 * STEP**2)
    J = information.of(0, derivatives)
    found = np.zeros((len(images), 3))
    for _ in range(steps):
        x, y, more = found.T[:, :, None]
        shape = added + x * along + y * down + x**2 / 2 * xx + x * y * xy + y**2 / 2 * yy
        slopes = ((1 + more) * (along + x * xx + y * xy), (1 + more) * (down + x * xy + y * yy), shape)
        scores = score(base + (1 + more) * shape, images)
        found += np.stack([(slope * scores).sum(axis=1) for slope in slopes], axis=1) @ np.linalg.inv(J)
    return found[:, :2]


def gaussian(variance: np.ndarray) -> Score:
    """Return the score of independent Gaussian pixels of `variance` (n,)."""
    return lambda mean, counts: (counts - mean) / variance


def correlated(covariance: np.ndarray) -> Score:
    """Return the score of Gaussian pixels of a dense covariance (n, n)."""
    inverse = np.linalg.inv(covariance)
    return lambda mean, counts: (counts - mean) @ inverse


def rounded(sigma: float, full: int) -> Score:
    """Return the score of counts rounded and clipped to 0..full in normal noise `sigma`."""

    def score(mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        lower = np.where(counts == 0, -np.inf, (counts - 0.5 - mean) / sigma)
        upper = np.where(counts == full, np.inf, (counts + 0.5 - mean) / sigma)
        density = (np.exp(-(lower**2) / 2) - np.exp(-(upper**2) / 2)) / (np.sqrt(2 * np.pi) * sigma)
        mirrored = lower > 0
        low, high = np.where(mirrored, -upper, lower), np.where(mirrored, -lower, upper)
        return np.asarray(density / np.maximum(ndtr(high) - ndtr(low), 1e-300))

    return score
