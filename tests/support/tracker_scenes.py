"""Scenes that trackers should find easy, made here without the simulator."""

from __future__ import annotations

import cv2
import numpy as np
from textures import counts, texture

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
        shown = image if bits == 8 else (3000 + 20 * image.astype(np.uint16)).astype(np.uint16)
        shown.setflags(write=False)
        scene.append((Frame(shown, k, k / 30, bits), (float(cx), float(cy))))
    return scene


def hiding(seed: int, pan: float = 0.0) -> tuple[list[Frame], list[tuple[float, float]], list[bool]]:
    """A spot no brighter than its ground, hidden behind a bar for some frames; another beside it that is not."""
    wide = texture(seed, 120, 260)
    rng = np.random.default_rng([seed, 1])
    y, x = np.mgrid[:120, :160]
    frames, at, seen = [], [], []
    for k in range(60):
        left = pan * k
        picture = cv2.warpAffine(wide, np.array([[1.0, 0, -20 - left], [0, 1, 0]]), (160, 120), flags=cv2.INTER_CUBIC)
        cx, cy = 30 + 1.5 * k, 50.0
        for row in (cy, cy + 25):
            picture = np.where(np.hypot(x - cx + left, y - row) < 4.5, 135.0, picture)
        bar = (np.abs(x - 75 + left) < 10) & (np.abs(y - 50) < 9)
        picture = np.where(bar, 60.0, picture)
        frames.append(Frame(counts(picture + 2 * rng.standard_normal(picture.shape)), k, k / 30, 8))
        at.append((cx - left, cy))
        seen.append(abs(cx - 75) > 15)
    return frames, at, seen


def follow(tracker: Tracker, frames: list[Frame], box: Box, seed: int = 0) -> list[Estimate]:
    state = tracker.init(frames[0], box, stream(seed, "test", 0))
    estimates = []
    for k, frame in enumerate(frames[1:], 1):
        state, estimate = tracker.step(state, frame, stream(seed, "test", k))
        estimates.append(estimate)
    return estimates
