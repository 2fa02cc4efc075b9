"""`adaboost_pf`: its detector finds the target again; the step follows the dispersion of the particles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tracker_scenes import blob, follow

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.registry.table import make
from irtrack.training.frames import SCENARIOS, labelled_frames
from irtrack.training.scores import roc_scores
from irtrack.training.windows import windows_of


def negative(frame: Frame) -> Frame:
    return replace(frame, image=255 - frame.image)


@pytest.mark.parametrize("cold", [False, True])
def test_detector_finds_the_target_in_its_gate(cold: bool) -> None:
    tracker: Any = make("adaboost_pf")
    for seed in range(4):
        scene = blob(seed, count=1)
        frame, at = negative(scene[0][0]) if cold else scene[0][0], np.array(scene[0][1])
        state = tracker.init(frame, Box(float(at[0]), float(at[1]), 14, 10), stream(seed, 0))
        assert state.cold == cold
        gate = at + np.array([8, -6]), 25 * np.eye(2)
        found = tracker._detection(frame.image, *gate, (14.0, 10.0), cold)
        assert found == pytest.approx(at, abs=3)
        empty = tracker._detection(np.full((120, 160), 90, np.uint8), *gate, (14.0, 10.0), cold)
        assert empty is None


def test_feedback_brings_the_track_back() -> None:
    """The target jumps by 18 px in frame 12, out of the reach of particles that stay: feedback finds it again."""
    held = {}
    for feedback in (True, False):
        found = 0
        for seed in range(4):
            scene = blob(seed, count=30, speed=0.5)
            frames = [f if k < 12 else Frame(np.roll(f.image, 18, 1), k, k / 30, 8) for k, (f, _) in enumerate(scene)]
            x, y = scene[-1][1]
            tracker = make("adaboost_pf", {"feedback": feedback, "damping": 0.0, "step_by": "fixed", "fixed_step": 0.5})
            last = follow(tracker, frames, Box(*scene[0][1], 14, 10), seed)[-1]
            found += np.hypot(last.center[0] - x - 18, last.center[1] - y) < 5
        held[feedback] = found
    assert held[True] >= 3
    assert held[False] <= 1


def test_step_follows_the_dispersion() -> None:
    """R = clip(c sqrt(tr Sigma / 2), Rmin, Rmax), by hand; half the mean side of the box is Rmax."""
    tracker: Any = make("adaboost_pf", {"dispersion": 0.5, "r_min": 0.4})
    for dispersion, step in ((0.1, 0.4), (4.0, 2.0), (1e3, np.sqrt(14 * 10) / 2)):
        assert tracker._step_deviation(dispersion, (14.0, 10.0)) == pytest.approx(step)
    scene = blob(2, count=6)
    state = tracker.init(scene[0][0], Box(*scene[0][1], 14, 10), stream(0, 0))
    for k in range(1, 6):
        state, estimate = tracker.step(state, scene[k][0], stream(0, k))
        sigma = np.sqrt(np.trace(estimate.covariance) / 2)
        assert state.deviation == pytest.approx(np.clip(0.5 * sigma, 0.4, np.sqrt(140) / 2))
    fixed: Any = make("adaboost_pf", {"step_by": "fixed", "fixed_step": 3.0})
    assert fixed._step_deviation(0.1, (14.0, 10.0)) == 3.0


@pytest.mark.slow
def test_roc_of_the_detector_on_unseen_seeds() -> None:
    """Windows of seeds that no training has seen; the card's figures are no better."""
    model = make("adaboost_pf").classifier  # type: ignore[attr-defined]  # of this tracker
    decisions, classes = [], []
    for part in windows_of(labelled_frames([2000], SCENARIOS), model.standard):
        region = replace(part.region, pixels=-part.region.pixels) if part.cold else part.region
        boxes = np.concatenate([part.given[:, :2], np.broadcast_to(part.unit, (len(part.given), 2))], axis=1)
        kept = part.positive | part.negative(boxes)
        decisions.append(model.decisions(region, boxes[kept, :2]))
        classes.append(part.positive[kept])
    figures = roc_scores(np.concatenate(decisions), np.concatenate(classes))
    print(figures)
    assert figures["area under ROC"] > 0.97
    assert figures["detection rate at 1 % false alarms"] > 0.8
