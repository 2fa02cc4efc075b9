"""`fusion_wspf`, its cues and their confidence, by hand."""

from __future__ import annotations

from math import exp, log, sqrt
from typing import Any

import numpy as np
import pytest
from irtrack.features.confidence import distance, kullback_leibler, variance_ratio
from irtrack.features.cues import Cue, Field, Pattern, likeness_map
from irtrack.features.quantise import full_range
from irtrack.trackers.fusion_looks import FusionState, Look
from irtrack.trackers.fusion_wspf import FusionWSPF, weigh
from tracker_scenes import blob, follow

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.features.gradients import orientations, sobel
from irtrack.features.window import Window

LEVELS = full_range(8, 8)


def test_gradient_histogram_of_three_by_three_pixels() -> None:
    """A step of 10 counts to the right of the middle column. Sobel: (1 + 2 + 1) 10 = 40 in +x wherever
    the step is within reach, 0 elsewhere and in y. All of it is in bin 0; turned by 90 degrees, in bin 2 of 8."""
    image = np.array([[0, 0, 10]] * 3, np.uint8)
    gx, gy = sobel(image, 0, 0, 3, 3)
    assert gx.tolist() == [[0, 40, 40]] * 3
    assert not gy.any()
    cells, magnitude = orientations(gx, gy, 8)
    assert np.bincount(cells.ravel(), magnitude.ravel(), 8).tolist() == [240, 0, 0, 0, 0, 0, 0, 0]
    for picture, u in ((image.T, 2), (image[:, ::-1], 4), (image.T[::-1], 6)):
        cells, magnitude = orientations(*sobel(np.ascontiguousarray(picture), 0, 0, 3, 3), 8)
        assert np.bincount(cells.ravel(), magnitude.ravel(), 8)[u] == 240


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_part_has_the_gradients_of_the_whole(dtype: type[Any]) -> None:
    image = np.random.default_rng(0).integers(0, 255, (30, 40)).astype(dtype)
    gx, gy = sobel(image, 0, 0, 40, 30)
    part = sobel(image, 7, 5, 20, 30)
    assert np.array_equal(part[0], gx[5:30, 7:20])
    assert np.array_equal(part[1], gy[5:30, 7:20])
    assert gx[12, 9] == image[11:14, 10] @ [1.0, 2, 1] - image[11:14, 8] @ [1.0, 2, 1]


@pytest.mark.parametrize("angle", range(0, 360, 15))
def test_an_orientation_falls_into_the_nearest_bin(angle: int) -> None:
    gx, gy = (np.full((1, 1), 5 * f(np.radians(angle + 1)), np.float32) for f in (np.cos, np.sin))
    cells, magnitude = orientations(gx, gy, 8)
    assert cells[0, 0] == round((angle + 1) / 45) % 8
    assert magnitude[0, 0] == pytest.approx(5)


def test_windows_of_all_sizes_by_hand() -> None:
    """A target of 4 x 2 px at level 200 in one of 20; a window of twice the size covers as many places, at twice
    the distance: of its 4 x 2 places the inner 2 x 2 see the target's columns, one row each misses it."""
    image = np.full((20, 20), 20, np.uint8)
    image[9:11, 8:12] = 200
    window = Window.of(Box(9.5, 9.5, 4, 2))
    pattern = Pattern.of(window, 400)
    field = Field(image, LEVELS, 8)
    cue, visible = field.windows(pattern, np.array([[9.5, 9.5], [11.5, 9.5], [30.0, 9.5]]), np.ones((3, 2)))
    # Kernel: 1 - (x / 2)^2 - y^2 with x = .5, 1.5 and y = .5: .6875, .1875, on both sides alike.
    assert pattern.kernel[0] == pytest.approx([0.1875 / 3.5, 0.6875 / 3.5, 0.6875 / 3.5, 0.1875 / 3.5])
    assert cue.grey[0, 6] == pytest.approx(1)
    assert cue.grey[1, [0, 6]] == pytest.approx([0.5, 0.5])
    assert visible.tolist() == [1, 1, 0]
    assert not cue.grey[2].any()
    strayed, nothing = field.windows(pattern, np.array([[30.0, 9.5]]), np.ones((1, 2)))
    assert not strayed.grey.any()
    assert not strayed.gradient.any()
    assert nothing == 0
    doubled, _ = field.windows(pattern, np.array([[9.5, 9.5]]), np.array([[2.0, 1.0]]))
    # x = .5, 1.5 become 1, 3: columns 6, 8 (8.5 rounds up to 9), 10 and 12 (12.5 to 13).
    assert doubled.grey[0, 6] == pytest.approx(2 * (2 * 0.6875) / 3.5)


def test_the_map_is_the_likeness_of_each_window() -> None:
    image = np.random.default_rng(1).integers(0, 255, (24, 30), np.uint8)
    window = Window.of(Box(10.2, 8.7, 6, 5))
    pattern = Pattern.of(window, 400)
    field = Field(image, LEVELS, 8)
    model, _ = field.windows(pattern, np.array([[10.2, 8.7]]), np.ones((1, 2)))
    model = Cue(model.grey[0], model.gradient[0])
    grey, gradient = likeness_map(field, window, pattern, model)
    assert grey.shape == (20, 25)
    corners = [(0, 0), (7, 6), (24, 19), (13, 4)]
    cues, _ = field.windows(pattern, np.array([window.center(c) for c in corners]), np.ones((4, 2)))
    for corner, rho, edge in zip(corners, *cues.like(model), strict=True):
        assert grey[corner[1], corner[0]] == pytest.approx(rho, abs=1e-4)
        assert gradient[corner[1], corner[0]] == pytest.approx(edge, abs=1e-4)
    assert grey[window.corner((10.2, 8.7))[::-1]] == pytest.approx(1, abs=1e-4)
    assert likeness_map(field, Window(40, 5, (0, 0)), pattern, model)[0].size == 0


def test_confidence_by_hand() -> None:
    """q = (1/2, 1/2, 0), b = (0, 1/2, 1/2): rho = 1/2. With delta = .001: KL = 1/2 ln 500; L = ln 500 (1, 0, -1);
    var(L; q) = (1/2 - 1/4) ln^2 = var(L; b), var(L; (q + b) / 2) = 1/2 ln^2: ratio 1."""
    q, b = np.array([0.5, 0.5, 0]), np.array([0, 0.5, 0.5])
    assert distance(q, b) == pytest.approx(sqrt(0.5))
    assert kullback_leibler(q, b) == pytest.approx(0.5 * log(500))
    assert variance_ratio(q, b) == pytest.approx(1)
    for measure in (distance, kullback_leibler, variance_ratio):
        assert measure(q, q) == pytest.approx(0, abs=1e-7)


def test_confidence_is_shared_between_the_cues() -> None:
    """Grey tells all apart (distance 1), gradients with rho = 3/4 (distance 1/2): 2/3 and 1/3."""
    model = Cue(np.array([1.0, 0]), np.array([1.0, 0]))
    ring = Cue(np.array([0.0, 1]), np.array([0.75**2, 1 - 0.75**2]))
    assert FusionWSPF()._confidence(model, ring) == pytest.approx([2 / 3, 1 / 3])
    assert FusionWSPF(confidence="equal")._confidence(model, ring).tolist() == [0.5, 0.5]
    assert FusionWSPF(cues="gradient")._confidence(model, ring).tolist() == [0, 1]
    assert FusionWSPF()._confidence(model, model).tolist() == [0.5, 0.5]


def test_weights_by_hand() -> None:
    """Eq. 12 with sigma = .5: exp(-2 (1 - rho)); rho = .9, .4 are as 1 to exp(-1), times .25 and .5 before."""
    weights, in_view = weigh(np.array([0.25, 0.5, 0.25]), np.array([0.9, 0.4, 0.0]), np.array([1.0, 1, 0]), 0.5)
    assert in_view
    assert weights == pytest.approx(np.array([0.25, 0.5 * exp(-1), 0]) / (0.25 + 0.5 * exp(-1)))
    weights, in_view = weigh(np.full(4, 0.25), np.zeros(4), np.zeros(4), 0.15)
    assert not in_view
    assert weights.tolist() == [0.25] * 4


def start(tracker: FusionWSPF) -> tuple[FusionState, Frame]:
    scene = blob(0, count=2)
    return tracker.init(scene[0][0], Box(*scene[0][1], 14, 10), stream(0, 0)), scene[1][0]


def looked(fused: float, rho: tuple[float, float]) -> Look:
    empty = Cue(np.zeros(8), np.zeros(8))
    return Look(np.zeros(6), empty, np.array(rho), fused, empty, 0.1)


def test_the_model_is_updated_where_one_condition_of_eq_13_holds() -> None:
    """rho_T = .86: the fused coefficient passes, or that of the cue of greater confidence, here grey's."""
    tracker = FusionWSPF()
    state, _ = start(tracker)
    assert state.confidence[0] > state.confidence[1]
    for fused, rho, seen in (
        (0.87, (0.8, 0.9), True),
        (0.80, (0.87, 0.5), True),
        (0.80, (0.5, 0.99), False),
        (0.85, (0.85, 0.85), False),
    ):
        assert (tracker._sight(state, looked(fused, rho)).missed == 0) is seen
    assert FusionWSPF(rho_t=None)._sight(state, looked(0.5, (0.5, 0.5))).missed == 0


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


@pytest.mark.parametrize("seed", range(3))
def test_a_hidden_target_that_comes_back_elsewhere_is_found_again(seed: int) -> None:
    """Hidden for 8 frames, it is 50 px away from where it would be: prediction alone cannot find it."""
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
    # While it was hidden, nothing else was taken for it.
    assert [e.status for e in found[17:20]] == ["lost"] * 3
    alone = follow(FusionWSPF(redetect=False), frames[:25], box, seed)[-1]
    assert np.hypot(*np.subtract(alone.center, np.add(scene[24][1], (jump, 0)))) > 10
