"""`fusion_wspf`: confidence, update, selection and redetection by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tracker_scenes import blob, follow

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.features.gradients import Cues
from irtrack.trackers.fusion_pf import FusionState, FusionWSPF, Match


def test_confidence_is_shared_between_the_cues() -> None:
    """Grey tells all apart (distance 1), gradients with rho = 3/4 (distance 1/2): 2/3 and 1/3."""
    model = Cues(np.array([1.0, 0]), np.array([1.0, 0]))
    ring = Cues(np.array([0.0, 1]), np.array([0.75**2, 1 - 0.75**2]))
    bhattacharyya = FusionWSPF(confidence="bhattacharyya")
    assert bhattacharyya._confidence(model, ring) == pytest.approx([2 / 3, 1 / 3])
    # Log-ratios with xi = .01: ln(1 / .01) = 4.61 and ln(1 / .5625) = .575.
    shares = np.log([100, 1 / 0.5625])
    assert FusionWSPF(xi=0.01)._confidence(model, ring) == pytest.approx(shares / shares.sum())
    assert FusionWSPF(confidence="equal")._confidence(model, ring).tolist() == [0.5, 0.5]
    assert FusionWSPF(cues="gradient")._confidence(model, ring).tolist() == [0, 1]
    assert FusionWSPF()._confidence(model, model).tolist() == [0.5, 0.5]


def start(tracker: FusionWSPF) -> tuple[FusionState, Frame]:
    scene = blob(0, count=2)
    return tracker.init(scene[0][0], Box(*scene[0][1], 14, 10), stream(0, 0)), scene[1][0]


def matched(fused: float, rho: tuple[float, float]) -> Match:
    empty = Cues(np.zeros(8), np.zeros(8))
    return Match(np.zeros(6), empty, np.array(rho), fused, empty, 0.1)


def test_one_condition_of_eq_13_updates_the_model() -> None:
    """rho_T = .86: the fused coefficient passes, or that of the cue of greater confidence, here grey's."""
    tracker = FusionWSPF()
    state, _ = start(tracker)
    assert state.confidence[0] > state.confidence[1]
    for fused, rho, hit in (
        (0.87, (0.8, 0.9), True),
        (0.80, (0.87, 0.5), True),
        (0.80, (0.5, 0.99), False),
        (0.85, (0.85, 0.85), False),
    ):
        assert (tracker._monitor(state, matched(fused, rho)).misses == 0) is hit
    assert FusionWSPF(rho_t=None)._monitor(state, matched(0.5, (0.5, 0.5))).misses == 0


def test_the_model_moves_by_its_rate() -> None:
    def moved(**parameters: Any) -> float:
        tracker = FusionWSPF(size_sd=0, **parameters)
        state, frame = start(tracker)
        after, _ = tracker.step(state, frame, stream(0, 1))
        assert after.model.grey.sum() == pytest.approx(1)
        return float(np.abs(after.model.grey - state.model.grey).sum())

    assert moved(update=0) == 0
    assert moved(update=0.2) == pytest.approx(4 * moved(update=0.05))
    assert moved() == moved(update=0.05) > 0


def test_always_updates_where_the_target_is_not_seen() -> None:
    """Hidden from frame 14 on: the model of the tracker that always updates drifts, the other's stays."""
    scene = blob(30, count=18, hidden=range(14, 18))
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)

    def change(**parameters: Any) -> float:
        tracker = FusionWSPF(redetect=False, widening=0, **parameters)
        state = tracker.init(frames[0], box, stream(0, 0))
        for k in range(1, 18):
            before = state.model.grey
            state, _ = tracker.step(state, frames[k], stream(0, k))
        return float(np.abs(state.model.grey - before).sum())

    assert change() == change(rho_t=0) == 0
    assert change(update_when="always") > 0


def test_all_chosen_is_the_standard_filter() -> None:
    """Np = N: the estimate is the mean over all particles and weights."""
    tracker = FusionWSPF(share=1)
    state, frame = start(tracker)
    _, estimate = tracker.step(state, frame, stream(0, 1))
    assert estimate.particles is not None
    assert estimate.weights is not None
    assert estimate.center == pytest.approx((estimate.weights @ estimate.particles)[:2].tolist())
    # Np < N: the estimate is the mean over the Np of largest weight alone.
    _, estimate = FusionWSPF().step(start(FusionWSPF())[0], frame, stream(0, 1))
    assert estimate.particles is not None
    assert estimate.weights is not None
    best = np.argsort(estimate.weights)[-56:]
    kept = estimate.weights[best] / estimate.weights[best].sum()
    assert estimate.center == pytest.approx((kept @ estimate.particles[best])[:2].tolist())


def test_a_target_that_reappears_elsewhere_is_redetected() -> None:
    """Hidden for 8 frames, then 50 px off its course."""
    seed = 3
    scene = blob(30 + seed, count=28, hidden=range(14, 22))
    jump = 50 if scene[22][1][0] < 80 else -50
    frames = [frame for frame, _ in scene]
    for k in range(22, 28):
        frames[k] = Frame(np.roll(frames[k].image, jump, axis=1), k, k / 30, 8)
    box = Box(*scene[0][1], 14, 10)
    found = follow(FusionWSPF(), frames, box, seed)
    at = np.add(scene[27][1], (jump, 0))
    assert found[-1].status == "tracking"
    assert np.hypot(*(found[-1].center - at)) < 3
    # While hidden it is lost.
    assert [e.status for e in found[17:20]] == ["lost"] * 3
    alone = follow(FusionWSPF(redetect=False, widening=0), frames[:25], box, seed)[-1]
    assert np.hypot(*np.subtract(alone.center, np.add(scene[24][1], (jump, 0)))) > 10
