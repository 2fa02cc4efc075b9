"""Mean shift on patterns holds its target under a drifting gain more closely than on grey levels alone."""

from __future__ import annotations

import numpy as np
import pytest
from tracker_scenes import blob, follow

import irsim
from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.registry.table import make
from irtrack.trackers.lbp_mean_shift import LBPMeanShift

FURTHEST = 20.0
"""Largest error that counts, px."""


def test_reference_is_the_joint_histogram() -> None:
    frame, at = blob(0, count=1)[0]
    state = LBPMeanShift(bins=4, bins_range="full").init(frame, Box(*at, 14, 10), stream(0, 0))
    picture = state.appearance.picture(frame)
    assert state.reference.shape == (40,)
    assert state.reference.sum() == pytest.approx(1)
    window = state.appearance.window
    cells = window.cut(picture, window.corner(at))
    by_hand = np.bincount(cells.ravel(), state.appearance.kernel.ravel(), 40)
    np.testing.assert_allclose(state.reference, by_hand / by_hand.sum(), atol=1e-12)


@pytest.mark.slow
def test_drifting_gain_costs_less_than_on_grey_levels() -> None:
    """The shipped ground scene through a gain that drifts by 30 %: mean error of six seeds, at most 20 px a frame."""
    errors = []
    for seed in range(10, 16):
        scene = irsim.load("examples/ground", [f"seed={seed}", "frames=60"])
        rendered = [(frame.image, truth.targets[0]) for frame, truth in irsim.frames(scene)]
        low, high = np.percentile(rendered[0][0], (0.5, 99.9))
        frames = []
        for k, (counts, _) in enumerate(rendered):
            gain, offset = 1 + 0.3 * np.sin(2 * np.pi * k / 50), 18 * np.sin(2 * np.pi * k / 37)
            level = ((counts - low) / (high - low) * 200 - 80) * gain + 100 + offset
            frames.append(Frame(np.clip(np.rint(level), 0, 255).astype(np.uint8), k, k / 30, 8))
        first, places = rendered[0][1], np.array([target.center for _, target in rendered[1:]])
        row = []
        for tracker in (make("lbp_mean_shift"), make("mean_shift", {"bins": 8}), make("mean_shift")):
            found = follow(tracker, frames, Box(first.center[0], first.center[1], first.box.w, first.box.h))
            off = np.hypot(*(np.array([estimate.center for estimate in found]) - places).T)
            row.append(np.minimum(off, FURTHEST).mean())
        errors.append(row)
    ours, coarse, fine = np.array(errors).T
    print(np.round(errors, 2).tolist())
    assert ours.mean() < coarse.mean() - 0.2
    assert (ours < coarse).sum() >= 5
    assert ours.mean() < fine.mean() + 0.1
