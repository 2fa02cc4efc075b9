"""The ideal matched filter: d^2 against dense algebra, Pd by simulation, a scene in white noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import fft

import irsim
from irsim.render.detectability import clutter_spectrum, deflection, detection_probability

SIDE = 24
POINTS = """
seed: 3
frames: 4
camera: {size: [96, 72], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - {id: a, shape: {kind: point, scr: 3}, path: {kind: straight, start: [20, 30], speed: 1, range_m: 3000}}
  - {id: b, shape: {kind: point, scr: 3}, path: {kind: straight, start: [1, 50], speed: 0, range_m: 3000}}
"""


def point(side: int = SIDE) -> np.ndarray:
    """Return a point's image, 1 count high, beside the middle of a square."""
    y, x = np.mgrid[:side, :side] - side / 2
    return np.asarray(np.exp(-((x - 0.3) ** 2 + (y + 0.2) ** 2) / 2))


def steep(side: int = SIDE, level: float = 40.0) -> np.ndarray:
    """Return the power spectrum of clutter, f^-3 above one cycle a side."""
    f = np.hypot(fft.fftfreq(side)[:, None], fft.fftfreq(side)) * side
    return np.asarray(level / np.maximum(f, 1) ** 3)


def drawn(rng: np.random.Generator, spectrum: np.ndarray, count: int) -> np.ndarray:
    """Return fields (count, rows, cols) of a power spectrum."""
    white = fft.fft2(rng.standard_normal((count, *spectrum.shape)))
    return np.asarray(fft.ifft2(white * np.sqrt(spectrum)).real)


def covariance(spectrum: np.ndarray) -> np.ndarray:
    """Return the dense covariance of a periodic field."""
    rows, columns = spectrum.shape
    first = fft.ifft2(spectrum).real
    down, across = np.divmod(np.arange(rows * columns), columns)
    return np.asarray(first[(down[:, None] - down) % rows, (across[:, None] - across) % columns])


@pytest.mark.parametrize("clutter", [np.zeros((SIDE, SIDE)), steep()], ids=["white", "clutter"])
def test_simulated_filter_has_the_pd_of_the_formula(clutter: np.ndarray) -> None:
    """Of the dense filter V^-1 s, in uneven noise with dead pixels, over 12,000 draws: Pd within .02."""
    rng = np.random.default_rng(1)
    variance = rng.uniform(0.5, 1.5, (SIDE, SIDE))
    variance[rng.random((SIDE, SIDE)) < 0.05] = np.inf
    works = np.isfinite(variance).ravel()
    s = point() * 1.6
    V = covariance(clutter)[np.ix_(works, works)] + np.diag(variance.ravel()[works])
    h = np.linalg.solve(V, s.ravel()[works])
    d2 = deflection(s, variance, clutter)
    assert d2 == pytest.approx(float(s.ravel()[works] @ h), rel=1e-6)
    draws = 12_000
    noise = rng.standard_normal((draws, int(works.sum()))) * np.sqrt(variance.ravel()[works])
    noise += drawn(rng, clutter, draws).reshape(draws, -1)[:, works]
    scores = noise @ h / np.sqrt(d2)
    for pfa in (0.01, 0.1, 0.5):
        threshold = np.quantile(scores, 1 - pfa)
        pd = (scores + np.sqrt(d2) > threshold).mean()
        assert pd == pytest.approx(float(detection_probability(d2, pfa)), abs=0.02), pfa


def test_measured_spectrum_gives_the_same_pd() -> None:
    """The covariance measured in one drawn field, in place of the one that it was drawn from: Pd within .02."""
    rng, side = np.random.default_rng(4), 192
    known = steep(side, 13_500.0)
    down, across = np.divmod(np.arange(32 * 32), 32)
    V = fft.ifft2(known).real[(down[:, None] - down) % side, (across[:, None] - across) % side] + np.eye(32 * 32)
    s = 1.8 * point(32).ravel()
    exact = detection_probability(float(s @ np.linalg.solve(V, s)), 0.05)
    assert 0.6 < exact < 0.9
    for field in drawn(rng, known, 4):
        found = deflection(1.8 * point(48), np.ones((48, 48)), clutter_spectrum(field, (48, 48)))
        assert detection_probability(found, 0.05) == pytest.approx(exact, abs=0.02)


def test_white_noise_has_the_sum_of_squares() -> None:
    """Spectra of white noise are its variance; d^2 of a point in a plain scene is that of its samples in the noise."""
    field = np.random.default_rng(2).standard_normal((128, 128)) * 3
    assert clutter_spectrum(field, (32, 32)).mean() == pytest.approx(9, rel=0.05)
    scenario = irsim.loads(POINTS)
    moments, found = irsim.Moments(scenario), irsim.Detectability(scenario)
    for name in ("a", "b"):
        s, variance = moments.contribution(2, name), moments.variance(2, fixed=False)
        without_clutter = float((s**2 / variance).sum())
        assert 0.8 * without_clutter < found.d2(2, name) <= without_clutter * (1 + 1e-9)


def test_frame_offsets_and_fixed_patterns_take_nothing() -> None:
    """A drift of the whole frame and a fixed pattern leave d^2 unchanged."""
    target = "scr: 3}, path: {kind: straight, start: [20"
    plain = POINTS.replace(target, target.replace("scr: 3", "contrast_k: 0.2"))
    more = plain.replace("[{kind: white}]", "[{kind: white}, {kind: fixed_pattern}, {kind: drift}]")
    one, other = (irsim.Detectability(irsim.loads(text)).d2(1, "a") for text in (plain, more))
    assert other == pytest.approx(one, rel=1e-3)


def test_wrong_target_or_frame() -> None:
    found = irsim.Detectability(irsim.loads(POINTS))
    with pytest.raises(irsim.InputError, match="there is no 'c'"):
        found.d2(0, "c")
    with pytest.raises(IndexError):
        found.d2(9, "a")
