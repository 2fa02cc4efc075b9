"""Trackers' C kernels against their plain twins: exactly, or to rounding where sums differ in order."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracker_loops import pictures, plain, quantisers, seeds, windows
from tracker_scenes import blob, follow

import irtrack
from irsim.types import Box, Image
from irtrack._native import COMPILED, kernels
from irtrack.features import gradients, highpass, histogram, mean_shift, trajectory
from irtrack.features.hog import HOG
from irtrack.features.quantiser import Quantiser
from irtrack.features.window import Window
from irtrack.filters import resampling
from irtrack.registry.table import TRACKERS
from irtrack.types import Estimate

pytestmark = pytest.mark.skipif(not COMPILED, reason="nothing is compiled")

ROUNDING = 1e-12


@settings(max_examples=40)
@given(pictures(), windows(), quantisers(), st.integers(1, 60), seeds)
def test_similarity(image: Image, window: Window, levels: Quantiser, count: int, seed: int) -> None:
    """Windows on, across and off the frame's edge."""
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-20, 50, (count, 2))
    reference = rng.dirichlet(np.ones(levels.bins))
    kernel = histogram.gaussian_kernel(window, 3.0)
    arguments = image, centers, window, kernel, levels, reference
    rho, visible = histogram.similarity(*arguments)
    with plain():
        expected_rho, expected_visible = histogram.similarity(*arguments)
    assert rho == pytest.approx(expected_rho, rel=ROUNDING)
    assert visible.tolist() == expected_visible.tolist()


def test_windows_at_no_place_are_outside() -> None:
    image, window = np.zeros((9, 9), np.uint8), Window(3, 3, (0.0, 0.0))
    centers = np.array([[np.nan, 4], [np.inf, 4], [-np.inf, np.nan], [1e300, -1e300], [4, 4]])
    kernel = np.full((3, 3), 1 / 9)
    rho, visible = histogram.similarity(image, centers, window, kernel, Quantiser(0, 256, 2), np.array([1.0, 0.0]))
    assert rho.tolist() == visible.tolist() == [0, 0, 0, 0, pytest.approx(1)]
    modes = mean_shift.mean_shift(image, centers[[0, 1, 3, 4]], (2, 2), Quantiser(0, 256, 2), np.array([1.0, 0.0]))
    assert modes.centers[-1] == pytest.approx([4, 4])
    assert modes.visible[-1] == pytest.approx(1)


@pytest.mark.parametrize("scheme", resampling.RESAMPLERS)
@settings(max_examples=30)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=300), st.integers(1, 300), seeds)
def test_drawing(scheme: resampling.Resampling, shares: list[float], count: int, seed: int) -> None:
    weights = np.array(shares)
    weights = weights / weights.sum() if weights.sum() > 0 else np.full(len(shares), 1 / len(shares))
    chosen = resampling.RESAMPLERS[scheme](weights, np.random.default_rng(seed), count)
    with plain():
        expected = resampling.RESAMPLERS[scheme](weights, np.random.default_rng(seed), count)
    assert chosen.tolist() == expected.tolist()


@pytest.mark.parametrize("speed", ["lambda", "sqrt_lambda"])
@settings(max_examples=40)
@given(st.integers(2, 20), st.integers(0, 40), st.sampled_from([0.0, 3.0]), seeds)
def test_velocities(speed: trajectory.Speed, k: int, count: int, spread: float, seed: int) -> None:
    """Trajectories at rest, too."""
    rng = np.random.default_rng(seed)
    track = 50 + spread * rng.standard_normal((k, 2)) + 2 * (spread > 0) * np.arange(k)[:, None]
    places = track[-1] + spread * rng.standard_normal((count, 2))
    similarity = trajectory.trajectory_similarity(track, places, speed)
    ahead, velocity = trajectory.line_fit(track)
    with plain():
        expected = trajectory.trajectory_similarity(track, places, speed)
        expected_ahead, expected_velocity = trajectory.line_fit(track)
    assert similarity == pytest.approx(expected, rel=1e-9, abs=ROUNDING)
    assert ahead == pytest.approx(expected_ahead, rel=ROUNDING)
    assert velocity == pytest.approx(expected_velocity, rel=ROUNDING, abs=ROUNDING)


@settings(max_examples=40)
@given(
    pictures(), quantisers(), st.tuples(st.floats(1, 8), st.floats(1, 8)), st.integers(0, 20), st.integers(1, 9), seeds
)
def test_mean_shift(
    image: Image, levels: Quantiser, h: tuple[float, float], iterations: int, count: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-20, 50, (count, 2))
    reference = rng.dirichlet(np.ones(levels.bins))
    modes = mean_shift.mean_shift(image, centers, h, levels, reference, iterations)
    with plain():
        expected = mean_shift.mean_shift(image, centers, h, levels, reference, iterations)
    assert modes.centers.tolist() == expected.centers.tolist()
    assert modes.visible.tolist() == expected.visible.tolist()
    assert modes.rho == pytest.approx(expected.rho, rel=ROUNDING)


@settings(max_examples=40)
@given(pictures(), windows(), quantisers(), st.integers(1, 9), st.sampled_from([20, 400]), st.integers(1, 30), seeds)
def test_cues(
    image: Image, window: Window, levels: Quantiser, edge_bins: int, places: int, count: int, seed: int
) -> None:
    """Windows of all sizes on, across and off the frame's edge, and rings around them, to the last bit."""
    rng = np.random.default_rng(seed)
    field, pattern = gradients.CueImage(image, levels, edge_bins), gradients.Pattern.of(window, places)
    centers = rng.uniform(-20, 50, (count, 6))[:, :2] if seed % 3 else rng.uniform(12, 18, (count, 2))
    scales = rng.uniform(0.5, 2, (count, 2))
    box, margin = (*centers[0].tolist(), *rng.uniform(1, 20, 2).tolist()), int(rng.integers(0, 12))

    def counted() -> list[object]:
        cue, visible = field.windows(pattern, centers, scales)
        ring = field.ring(box, margin)
        return [each.tolist() for each in (cue.grey, cue.gradient, visible, ring.grey, ring.gradient)]

    ours = counted()
    with plain():
        assert ours == counted()


@pytest.mark.parametrize("loops", [nullcontext, plain])
def test_cues_at_no_place_are_empty(loops: Callable[[], AbstractContextManager[None]]) -> None:
    field = gradients.CueImage(np.zeros((9, 9), np.uint8), Quantiser(0, 256, 2), 8)
    centers = np.array([[np.nan, 4], [np.inf, 4], [-np.inf, np.nan], [1e300, -1e300], [4, 4]])
    pattern = gradients.Pattern.of(Window(3, 3, (0.0, 0.0)), 400)
    with loops():
        cue, visible = field.windows(pattern, centers, np.ones((5, 2)))
        none, _ = field.windows(pattern, centers[:0], np.ones((0, 2)))
    assert cue.grey[:, 0].tolist() == [0, 0, 0, 0, 1]
    assert visible.tolist() == [0, 0, 0, 0, pytest.approx(1)]
    assert not cue.gradient.any()
    assert none.grey.shape == (0, 2)


@given(pictures(), st.integers(1, 40), st.integers(3, 16), st.booleans(), st.sampled_from([0.5, 2.7, 55.0, 1e6]), seeds)
def test_high_passed_pictures(image: Image, L: int, m: int, full: bool, gain: float, seed: int) -> None:
    """Wholes and parts, with neighbourhoods beyond the frame and of more samples than there is a loop for."""
    kernel = highpass.full_kernel(L) if full else highpass.ring_kernel(L, m)
    high_pass = highpass.HighPass(kernel, 1, gain)
    whole = high_pass(image)
    first, end = np.sort(np.random.default_rng(seed).integers(0, np.array(image.shape) + 1, (2, 2)), axis=0)
    part = slice(first[0], end[0]), slice(first[1], end[1])
    assert high_pass.view(image)[part].tolist() == whole[part].tolist()
    with plain():
        assert high_pass(image).tolist() == whole.tolist()


@settings(max_examples=30)
@given(st.integers(2, 30), st.integers(2, 30), st.sampled_from([(20, 20, 4), (16, 32, 4), (8, 6, 1)]), seeds)
def test_oriented_gradients(rows: int, columns: int, layout: tuple[int, int, int], seed: int) -> None:
    """Windows on, across and off the picture; constant pictures too."""
    rng = np.random.default_rng(seed)
    picture = rng.integers(0, rng.choice([1, 200]), (rows, columns), endpoint=True).astype(np.float32)
    places, spacing = rng.uniform(-20, 50, (9, 2)), rng.uniform(0.2, 3, (9, 2))
    vectors = HOG(*layout).vectors(picture, places, spacing)
    with plain():
        assert vectors.tolist() == HOG(*layout).vectors(picture, places, spacing).tolist()


@pytest.mark.parametrize("name", TRACKERS)
def test_tracks_with_and_without_kernels(name: str) -> None:
    """Of a target that is hidden for some frames, by every tracker."""

    def track() -> list[Estimate]:
        scene = blob(3, count=8, hidden=range(5, 7))
        return follow(irtrack.make(name), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10))

    ours = track()
    with plain():
        expected = track()
    for one, other in zip(ours, expected, strict=True):
        assert one.center == pytest.approx(other.center, rel=ROUNDING)
        assert one.status == other.status
        assert (one.score is None) == (other.score is None)
        assert one.score is None or one.score == pytest.approx(other.score, rel=1e-9, abs=ROUNDING)


def test_wrong_calls_are_errors() -> None:
    """Lengths that do not agree, places beyond all, other types: none reads or writes elsewhere."""
    image, table = np.zeros((5, 5), np.uint8), np.zeros(256, np.uint16)
    two, three = np.zeros(2), np.zeros(3)
    places, corners = np.zeros(2, np.intp), np.zeros((2, 2), np.intp)
    single, box = np.zeros(4, np.float32), np.zeros((1, 2))
    places_at = image, table, two, two, box, box
    ring, nothing, part = highpass.ring_kernel(1, 4), np.zeros((3, 3), np.float32), image.copy()
    none, flat, four = np.zeros(0), np.zeros((3, 3)), np.zeros((2, 4))
    windows, bounds = np.ones((1, 4)), np.ones((8, 2))
    wrong: list[Callable[[], object]] = [
        lambda: kernels.high_pass(image, ring, 1.0, 1, 0, part),
        lambda: kernels.high_pass(image, ring, 1.0, 0, -1, part),
        lambda: kernels.high_pass(image, ring[:2], 1.0, 0, 0, part),
        lambda: kernels.high_pass(image, nothing, 1.0, 0, 0, part),
        lambda: kernels.high_pass(image, -ring, 1.0, 0, 0, part),
        lambda: kernels.high_pass(image, nothing + np.float32(0.5), 1.0, 0, 0, part),
        lambda: kernels.window_gradients(*places_at[:5], three, single, single),
        lambda: kernels.window_gradients(*places_at[:2], two[:0], *places_at[3:], single, single),
        lambda: kernels.window_gradients(*places_at, single, single[:3]),
        lambda: kernels.window_cues(*places_at, three, corners > 0, single, single, two, two, two[:1]),
        lambda: kernels.window_cues(*places_at, box, corners > 0, single, single, two, two, two[:1]),
        lambda: kernels.window_cues(*places_at, corners * 1.0, corners > 0, single[:3], single[:3], two, two, two[:1]),
        lambda: kernels.window_cues(*places_at, corners * 1.0, corners > 0, single, single, two, two, two),
        lambda: kernels.distinct_windows(two, 0, 0, 3, 3, 5, 5, corners, places),
        lambda: kernels.distinct_windows(np.zeros((2, 2)), 0, 0, 0, 3, 5, 5, corners, places),
        lambda: kernels.distinct_windows(np.zeros((2, 2)), 0, 0, 3, 3, 1 << 40, 5, corners, places),
        lambda: kernels.window_histograms(image, table[:9], corners, flat, four, none),
        lambda: kernels.window_histograms(image, table, corners + 9, flat, four, none),
        lambda: kernels.window_histograms(image, table, corners, np.zeros((0, 3)), four, none),
        lambda: kernels.window_histograms(image, table, corners, flat.ravel(), four, none),
        lambda: kernels.window_histograms(image, table, corners, flat, three, none),
        lambda: kernels.window_histograms(image, table, corners, np.zeros((2, 3, 3)), four, three),
        lambda: kernels.bhattacharyya(np.zeros((2, 3)), np.zeros(4), two),
        lambda: kernels.scaled_log_weights(two, two, 1.0, three),
        lambda: kernels.scaled_log_weights(two, three, 1.0, two),
        lambda: kernels.normalise_product(two, three),
        lambda: kernels.pick(two[:0], two, places),
        lambda: kernels.pick(two, three, places),
        lambda: kernels.ar2(two, two, places, 1.0, two, three, three, three),
        lambda: kernels.trajectory_similarity(np.zeros((1, 2)), two, False, two),
        lambda: kernels.line_fit(two[:0], two, two),
        lambda: kernels.mean_shift(image, table, 2.0, 1e9, two, 9, 0.1, two, two, two[:1]),
        lambda: kernels.mean_shift(image, table, 2.0, 2.0, two, 9, 0.1, two, two, two),
        lambda: kernels.hog_windows(single[None], windows, bounds, 8, 8, 4, np.zeros((1, 36))),
        lambda: kernels.hog_windows(nothing, windows, bounds, 8, 8, 4, np.zeros((1, 35))),
        lambda: kernels.hog_windows(nothing, windows, bounds[1:], 8, 8, 4, np.zeros((1, 36))),
        lambda: kernels.hog_windows(nothing, windows, bounds, 8, 9, 4, np.zeros((1, 36))),
        lambda: kernels.hog_windows(nothing, windows, bounds, 1 << 40, 8, 4, np.zeros((1, 36))),
        lambda: kernels.hog_windows(nothing, windows[:, :3], bounds, 8, 8, 4, np.zeros((1, 36))),
    ]  # fmt: skip
    for call in wrong:
        with pytest.raises(ValueError, match=r"do not agree|out of range|without|beyond|away|bin for each|mismatch"):
            call()
    with pytest.raises(IndexError):
        kernels.ar2(two, two, places + 1, 1.0, two, np.zeros(4), np.zeros(4), np.zeros(4))
    with pytest.raises(TypeError):
        kernels.line_fit(two.astype(np.float32), two, two)
    with pytest.raises(ValueError, match="picture"):
        kernels.window_histograms(two, table, corners, flat, four, none)  # type: ignore[arg-type]  # what is wrong is the test
