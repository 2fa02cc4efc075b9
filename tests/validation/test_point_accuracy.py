"""`imm_mf` on a point before flat ground in white noise: error after 20 frames beside the Cramér-Rao bounds."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

import irsim
from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.registry.table import make

SCENE = """
frames: 21
camera: {size: [48, 40], psf_px: 0.7, elevation_deg: -30, netd_mk: 60, bits: 14, noise: [{kind: white}]}
background: {kind: ground, spread_k: 0.0}
targets:
  - {id: one, shape: {kind: point, contrast_k: CONTRAST}, path: {kind: straight, start: [14.3, 18.2], speed: 0.6}}
"""
SEEDS, FRAMES = 200, 21
LOST_PX = 3.0


def scene(contrast_k: float) -> irsim.Scenario:
    return irsim.loads(SCENE.replace("CONTRAST", f"{contrast_k:.9g}"))


def single_frame_bound(moments: irsim.Moments) -> float:
    """Return the root of the summed Cramér-Rao bounds of x and y in the last frame, px; amplitude unknown."""
    step, last = 0.02, FRAMES - 1

    def drawn(x: float, y: float) -> np.ndarray:
        return np.asarray(moments.contribution(last, "one", (x, y)).ravel())

    slopes = [(drawn(*at) - drawn(*(-a for a in at))) / (2 * step) for at in ((step, 0.0), (0.0, step))]
    J = np.stack([*slopes, drawn(0.0, 0.0)], axis=1)
    weight = 1 / moments.variance(last, fixed=False).ravel()
    return sqrt(np.linalg.inv(J.T @ (J * weight[:, None]))[:2, :2].trace())


@pytest.mark.parametrize("d", [12, 20, 40])
def test_error_after_20_frames_is_near_the_bound(d: int) -> None:
    """RMSE, bias included, at most 1.5 times the single-frame bound; few tracks lost, which are left out of the RMSE.

    The bound of a straight path from 21 frames is beside it: the variance of a fitted line at its end is
    2 (2 n - 1) / (n (n + 1)) of that of a frame.
    """
    unit = irsim.Detectability(scene(1.0)).d2(FRAMES - 1, "one") ** 0.5
    scenario = scene(d / unit)
    truths = [truth.targets[0] for _, truth in irsim.frames(scenario)]
    moments = irsim.Moments(scenario)
    bound = single_frame_bound(moments)
    means = [moments.mean(k) for k in range(FRAMES)]
    deviations = [np.sqrt(moments.variance(k, fixed=False)) for k in range(FRAMES)]
    tracker, box, errors = make("imm_mf"), truths[0].box, []
    start = Box(box.cx, box.cy, max(box.w, 5.0), max(box.h, 5.0))
    for seed in range(SEEDS):
        rng, state = stream(seed, "point_accuracy", d), None
        for k in range(FRAMES):
            counts = np.rint(means[k] + deviations[k] * rng.standard_normal(means[k].shape)).clip(0, 2**14 - 1)
            frame = Frame(counts.astype(np.uint16), k, k / 25, 14)
            if state is None:
                state = tracker.init(frame, start, stream(seed, "imm_mf", "one", k))
            else:
                state, estimate = tracker.step(state, frame, stream(seed, "imm_mf", "one", k))
        errors.append(np.subtract(estimate.center, truths[-1].center))
    distances = np.hypot(*np.array(errors).T)
    held = distances < LOST_PX
    rmse, lost = sqrt((distances[held] ** 2).mean()), int((~held).sum())
    bias = np.array(errors)[held].mean(axis=0)
    n = FRAMES
    straight = bound * sqrt(2 * (2 * n - 1) / (n * (n + 1)))
    print(
        f"d {d}: RMSE {rmse:.4f} px, {rmse / bound:.2f} bounds of {bound:.4f}; straight path {straight:.4f}", end="; "
    )
    print(f"bias {bias.round(4)}; lost {lost} of {SEEDS}")
    assert rmse <= 1.5 * bound
    assert lost <= 0.05 * SEEDS
