"""Scenes that trackers should find easy, made here without the simulator."""

from __future__ import annotations

import numpy as np

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.types import Estimate, Tracker

Scene = list[tuple[Frame, tuple[float, float]]]


def blob(seed: int, *, count: int = 40, bits: int = 8, speed: float = 1.5, hidden: range = range(0)) -> Scene:
    """A Gaussian blob of 14 x 10 px on noise (SNR 13), and its true centre, px; hidden in some frames."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi)
    step = speed * np.array([np.cos(angle), np.sin(angle)])
    y, x = np.mgrid[:120, :160]
    scene = []
    for k in range(count):
        cx, cy = np.array([80.0, 60.0]) + (k - count / 2) * step
        target = 80 * np.exp(-((x - cx) ** 2) / (2 * 3.5**2) - (y - cy) ** 2 / (2 * 2.5**2))
        picture = 80 + (0 if k in hidden else 1) * target + 6 * rng.standard_normal(x.shape)
        image = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
        counts = image if bits == 8 else (3000 + 20 * image.astype(np.uint16)).astype(np.uint16)
        counts.setflags(write=False)
        scene.append((Frame(counts, k, k / 30, bits), (float(cx), float(cy))))
    return scene


def follow(tracker: Tracker, frames: list[Frame], box: Box, seed: int = 0) -> list[Estimate]:
    state = tracker.init(frames[0], box, stream(seed, "test", 0))
    estimates = []
    for k, frame in enumerate(frames[1:], 1):
        state, estimate = tracker.step(state, frame, stream(seed, "test", k))
        estimates.append(estimate)
    return estimates
