"""Frames with known noise, fixed pattern and bad pixels, for the tests of irsim.calibration."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

import irsim
from irsim.types import Floats

REAL = Path(__file__).resolve().parents[3] / "shared" / "real"


def real_counts(name: str) -> Floats:
    """Counts (T, rows, columns) of a real sensor."""
    with np.load(REAL / name / "frames.npz") as file:
        return np.asarray(file["frames"])


def series(rng: np.random.Generator, shape: tuple[int, ...], sigma: float, rho: float = 0.0) -> Floats:
    """AR(1) noise over the first axis; white for rho 0."""
    drawn = rng.normal(0, sigma, shape)
    for k in range(1, shape[0]):
        drawn[k] = rho * drawn[k - 1] + np.sqrt(1 - rho**2) * drawn[k]
    return drawn


def noise_frames(
    seed: int, shape: tuple[int, int, int] = (60, 48, 48), *, rho: float = 0.0, correlated: float = 0.0, **sigmas: float
) -> Floats:
    """Frames about 1000 with 3-D noise terms of these sigmas (t, v, h, tv, th, vh, tvh), and AR(1) noise of pixels."""
    rng = np.random.default_rng(seed)
    times, rows, columns = shape
    sizes = {"t": times, "v": rows, "h": columns}
    frames = np.full(shape, 1000.0)
    for term, sigma in sigmas.items():
        frames += rng.normal(0, sigma, [sizes[axis] if axis in term else 1 for axis in "tvh"])
    if correlated:
        frames += series(rng, shape, correlated, rho)
    return frames


@lru_cache
def rendered(text: str, seed: int = 1) -> Floats:
    """Counts of a scenario."""
    scenario = irsim.loads(f"seed: {seed}\n{text}")
    return np.stack([frame.image for frame, _ in irsim.frames(scenario)])
