"""Random cases for oracles: sequences of targets and tracks, masks, filters, likelihood ratios; by numpy alone."""

from __future__ import annotations

from typing import Any

import numpy as np


def sequence(seed: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return frames of a sequence: numbers of targets and of tracks, and their similarities."""
    rng = np.random.default_rng(seed)
    targets, tracks, frames = rng.integers(1, 6), rng.integers(1, 8), rng.integers(2, 14)
    found = []
    for _ in range(frames):
        t, r = np.flatnonzero(rng.random(targets) < 0.8), np.flatnonzero(rng.random(tracks) < 0.7)
        found.append((t, r, rng.random((len(t), len(r))) * (rng.random((len(t), len(r))) < 0.5)))
    return found


def masks(seed: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return three predictions (rows, cols) of 0..1 and their truths: targets hit, missed, and false ones."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(3):
        truth, prediction = np.zeros((40, 50), bool), rng.random((40, 50)) * 0.49
        for _ in range(rng.integers(0, 5)):
            y, x = rng.integers(2, 36), rng.integers(2, 46)
            truth[y : y + rng.integers(1, 4), x : x + rng.integers(1, 4)] = True
            if rng.random() < 0.8:
                dy, dx = rng.integers(-3, 4, 2)
                prediction[max(0, y + dy) :, max(0, x + dx) :][:2, :2] = 0.9
        for _ in range(rng.integers(0, 4)):
            prediction[rng.integers(0, 40), rng.integers(0, 50)] = 0.8
        found.append((prediction, truth))
    return found


def turning_target(seed: int) -> dict[str, Any]:
    """Return detections (20, 2) px of a target that turns, and the numbers of an IMM of CV and two turns."""
    rng = np.random.default_rng(seed)
    angle = np.cumsum(np.where(np.arange(20) < 10, 0.0, 0.15))
    places = np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=1) * 3, axis=0) + 50
    return {"detections": places + rng.normal(0, 1, places.shape), "rate": 0.15, "acceleration": 0.3, "stay": 0.95}


def shared_gates(seed: int) -> dict[str, np.ndarray]:
    """Return predicted centres (n, 2), variances (n,), and detections (m, 2) that several tracks may claim, px."""
    rng = np.random.default_rng(seed)
    tracks = int(rng.integers(2, 5))
    centers = rng.uniform(0, 12, (tracks, 2))
    near = centers[rng.random(tracks) < 0.8]
    detections = np.concatenate([near + rng.normal(0, 1, near.shape), rng.uniform(0, 12, (int(rng.integers(0, 4)), 2))])
    return {"centers": centers, "variances": rng.uniform(1, 4, tracks), "detections": detections}


def one_gate(seed: int) -> dict[str, Any]:
    """Return a predicted centre (2,), covariance (2, 2) px^2, and up to five detections (m, 2) px near it."""
    rng = np.random.default_rng(seed)
    center, factor = rng.uniform(20, 40, 2), rng.normal(0, 1, (2, 2))
    covariance = factor @ factor.T + np.eye(2)
    return {
        "center": center,
        "covariance": covariance,
        "detections": center + rng.normal(0, 2, (int(rng.integers(1, 6)), 2)),
        "detection_probability": float(rng.uniform(0.5, 0.99)),
        "clutter": float(rng.uniform(0.001, 0.05)),
    }


def bearing_target(seed: int) -> dict[str, Any]:
    """Return ranges and bearings (10, 2) of a target ahead of the sensor, and the numbers of its filters."""
    rng = np.random.default_rng(seed)
    start, velocity = np.array([rng.uniform(40, 120), rng.uniform(-40, 40)]), rng.uniform(-1.5, 1.5, 2)
    places = start + np.arange(1, 11)[:, None] * velocity
    z = np.stack([np.hypot(*places.T), np.arctan2(places[:, 1], places[:, 0])], axis=1)
    return {
        "plots": z + rng.normal(0, 1, z.shape) * (2.0, 0.02),
        "start": np.array([*(start + rng.normal(0, 2, 2)), 0.0, 0.0]),
        "sds": np.array([2.0, 2.0, 1.0, 1.0]),
        "range_sd": 2.0,
        "bearing_sd": 0.02,
        "acceleration": float(rng.uniform(0.05, 0.5)),
    }


def straight_target(seed: int) -> dict[str, Any]:
    """Return detections (20, 2) px of a target at constant velocity, and the numbers of an H-infinity filter."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(40, 60, 2) + np.arange(20)[:, None] * rng.uniform(-2, 2, 2)
    return {
        "detections": places + rng.normal(0, 1, places.shape),
        "acceleration": float(rng.uniform(0.1, 0.5)),
        "measurement_sd": float(rng.uniform(0.5, 2)),
        "theta": float(rng.uniform(0.001, 0.02)),
    }


def two_classes(seed: int) -> dict[str, Any]:
    """Return vectors (80, 6) of two overlapping classes, exact in float32, the class of each, and C of an SVM."""
    rng = np.random.default_rng(seed)
    vectors = np.rint(rng.normal(0, 1, (80, 6)) * 256) / 256
    positive = vectors[:, 0] + vectors[:, 1] * vectors[:, 2] + rng.normal(0, 0.5, 80) > rng.normal(0, 0.3)
    return {"vectors": vectors, "positive": positive, "cost": float(rng.uniform(0.02, 2)), "rounds": 12}
