"""Trackers' inner loops in C against their plain twins: to the last bit, or to rounding where sums differ in order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from irtrack.features.quantise import Quantiser
from tracker_loops import pictures, plain, quantisers, seeds, windows
from tracker_scenes import blob, follow

import irtrack
from irsim.types import Box, Image
from irtrack._native import COMPILED, kernels
from irtrack.features import highpass, histogram, mean_shift, velocity
from irtrack.features.window import Window
from irtrack.filters import motion, resampling
from irtrack.registry.table import TRACKERS, grey
from irtrack.types import Estimate

pytestmark = pytest.mark.skipif(not COMPILED, reason="no compiler was at hand")

ROUNDING = 1e-12


@given(pictures(), windows(), quantisers(), st.integers(1, 60), seeds)
def test_likeness(image: Image, window: Window, levels: Quantiser, count: int, seed: int) -> None:
    """Windows on, across and off the frame's edge, in more than one go."""
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-20, 50, (count, 2))
    reference = rng.dirichlet(np.ones(levels.bins))
    kernel = np.repeat(histogram.gaussian_kernel(window, 3.0).reshape(1, -1), 7, axis=0)
    arguments = image, centers, window, kernel, levels, reference
    rho, visible = histogram.likeness(*arguments)
    with plain():
        expected_rho, expected_visible = histogram.likeness(*arguments)
    assert rho == pytest.approx(expected_rho, rel=ROUNDING)
    assert visible.tolist() == expected_visible.tolist()


@given(pictures(), windows(), quantisers(), st.tuples(st.floats(-40, 60), st.floats(-40, 60)))
def test_a_window_and_its_ring(image: Image, window: Window, levels: Quantiser, center: tuple[float, float]) -> None:
    kernel = histogram.epanechnikov_kernel(window)
    surround = histogram.Surround.of(window, kernel, (2, 3), levels)
    histograms, visible = surround.histograms(image, center)
    with plain():
        expected, expected_visible = surround.histograms(image, center)
    assert histograms.tolist() == expected.tolist()
    assert visible.tolist() == expected_visible.tolist()


def test_windows_at_no_place_are_off_the_frame() -> None:
    image, window = np.zeros((9, 9), np.uint8), Window(3, 3, (0.0, 0.0))
    centers = np.array([[np.nan, 4], [np.inf, 4], [-np.inf, np.nan], [1e300, -1e300], [4, 4]])
    kernel = histogram.repeated(np.full((3, 3), 1 / 9))
    rho, visible = histogram.likeness(image, centers, window, kernel, Quantiser(0, 256, 2), np.array([1.0, 0.0]))
    assert rho.tolist() == visible.tolist() == [0, 0, 0, 0, pytest.approx(1)]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=300), st.floats(0, 2000), seeds)
def test_weights(rho: list[float], sharpness: float, seed: int) -> None:
    visible = np.random.default_rng(seed).integers(0, 2, len(rho)).astype(float)
    weights, in_view = grey.weigh(np.array(rho), visible, sharpness)
    with plain():
        expected, expected_in_view = grey.weigh(np.array(rho), visible, sharpness)
    assert (weights.tolist(), in_view) == (expected.tolist(), expected_in_view)


@pytest.mark.parametrize("scheme", resampling.RESAMPLERS)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=300), st.integers(1, 300), seeds)
def test_drawing(scheme: resampling.Resampling, shares: list[float], count: int, seed: int) -> None:
    weights = np.array(shares)
    weights = weights / weights.sum() if weights.sum() > 0 else np.full(len(shares), 1 / len(shares))
    chosen = resampling.RESAMPLERS[scheme](weights, np.random.default_rng(seed), count)
    with plain():
        expected = resampling.RESAMPLERS[scheme](weights, np.random.default_rng(seed), count)
    assert chosen.tolist() == expected.tolist()


@given(st.integers(1, 20), st.integers(1, 40), st.floats(0, 1), seeds)
def test_second_order_motion(held: int, drawn: int, damping: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    positions, previous = rng.uniform(0, 99, (2, held, 2))
    arguments = positions, previous, rng.integers(0, held, drawn), damping, rng.uniform(0, 9, drawn)
    moved, origins = motion.ar2_drawn(*arguments, np.random.default_rng(seed))
    with plain():
        expected, expected_origins = motion.ar2_drawn(*arguments, np.random.default_rng(seed))
    assert moved.tolist() == expected.tolist()
    assert origins.tolist() == expected_origins.tolist()


@pytest.mark.parametrize("speed", ["lambda", "sqrt_lambda"])
@given(st.integers(2, 20), st.integers(0, 40), st.sampled_from([0.0, 3.0]), seeds)
def test_velocities(speed: velocity.Speed, k: int, count: int, spread: float, seed: int) -> None:
    """Trajectories that stand still, too."""
    rng = np.random.default_rng(seed)
    trajectory = 50 + spread * rng.standard_normal((k, 2)) + 2 * (spread > 0) * np.arange(k)[:, None]
    places = trajectory[-1] + spread * rng.standard_normal((count, 2))
    alike = velocity.velocity_likeness(trajectory, places, speed)
    ahead, pace = velocity.line(trajectory)
    with plain():
        assert alike == pytest.approx(velocity.velocity_likeness(trajectory, places, speed), rel=1e-9, abs=ROUNDING)
        expected_ahead, expected_pace = velocity.line(trajectory)
    assert ahead == pytest.approx(expected_ahead, rel=ROUNDING)
    assert pace == pytest.approx(expected_pace, rel=ROUNDING, abs=ROUNDING)


def test_the_line_of_one_place_stands() -> None:
    ahead, pace = velocity.line(np.array([[3.0, 4.0]]))
    assert (ahead.tolist(), pace.tolist()) == ([3, 4], [0, 0])


@settings(max_examples=40)
@given(
    pictures(), quantisers(), st.tuples(st.floats(1, 8), st.floats(1, 8)), st.integers(0, 20), st.integers(1, 9), seeds
)
def test_climbing(
    image: Image, levels: Quantiser, h: tuple[float, float], iterations: int, count: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-20, 50, (count, 2))
    reference = rng.dirichlet(np.ones(levels.bins))
    climbed = mean_shift.mean_shift(image, centers, h, levels, reference, iterations)
    with plain():
        expected = mean_shift.mean_shift(image, centers, h, levels, reference, iterations)
    assert climbed.centers.tolist() == expected.centers.tolist()
    assert climbed.visible.tolist() == expected.visible.tolist()
    assert climbed.rho == pytest.approx(expected.rho, rel=ROUNDING)


def test_a_climb_from_no_place_ends() -> None:
    centers = np.array([[np.nan, 4], [np.inf, 4], [1e300, -1e300], [4, 4]])
    levels = Quantiser(0, 256, 2)
    climbed = mean_shift.mean_shift(np.zeros((9, 9), np.uint8), centers, (2, 2), levels, np.array([1.0, 0.0]))
    assert climbed.centers[-1] == pytest.approx([4, 4])
    assert climbed.visible[-1] == pytest.approx(1)


@pytest.mark.parametrize("name", TRACKERS)
def test_tracks_are_the_same(name: str) -> None:
    """Of a target that hides for some frames, by every tracker."""

    def track() -> list[Estimate]:
        scene = blob(3, count=14, hidden=range(8, 11))
        return follow(irtrack.make(name), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10))

    ours = track()
    with plain():
        expected = track()
    for one, other in zip(ours, expected, strict=True):
        assert one.center == pytest.approx(other.center, rel=ROUNDING)
        assert one.status == other.status
        assert (one.score is None) == (other.score is None)
        assert one.score is None or one.score == pytest.approx(other.score, rel=1e-9, abs=ROUNDING)


@pytest.mark.parametrize("bits", [8, 16])
def test_an_image_that_is_not_in_one_piece(bits: int) -> None:
    frames = [frame for frame, _ in blob(5, count=4, bits=bits)]
    cut = [replace(frame, image=np.asfortranarray(frame.image)) for frame in frames]  # type: ignore[arg-type]  # numpy's stubs lose the element type
    box = Box(80, 60, 14, 10)
    for name in ("grey_pf", "mean_shift"):
        assert follow(irtrack.make(name), cut, box)[-1].center == follow(irtrack.make(name), frames, box)[-1].center


def test_wrong_calls_are_errors() -> None:
    """Lengths that do not agree, places beyond all, other types: none reads or writes elsewhere."""
    image, table = np.zeros((5, 5), np.uint8), np.zeros(256, np.uint16)
    two, three = np.zeros(2), np.zeros(3)
    places, corners = np.zeros(2, np.intp), np.zeros((2, 2), np.intp)
    single, box = np.zeros(4, np.float32), np.zeros((1, 2))
    sights = image, table, two, two, box, box
    ring, nothing, part = highpass.ring_kernel(1, 4), np.zeros((3, 3), np.float32), image.copy()
    wrong: list[Callable[[], object]] = [
        lambda: kernels.high_pass(image, ring, 1.0, 1, 0, part),
        lambda: kernels.high_pass(image, ring, 1.0, 0, -1, part),
        lambda: kernels.high_pass(image, ring[:2], 1.0, 0, 0, part),
        lambda: kernels.high_pass(image, nothing, 1.0, 0, 0, part),
        lambda: kernels.high_pass(image, -ring, 1.0, 0, 0, part),
        lambda: kernels.high_pass(image, nothing + np.float32(0.5), 1.0, 0, 0, part),
        lambda: kernels.window_gradients(*sights[:5], three, single, single),
        lambda: kernels.window_gradients(*sights[:2], two[:0], *sights[3:], single, single),
        lambda: kernels.window_gradients(*sights, single, single[:3]),
        lambda: kernels.window_cues(*sights, three, corners > 0, single, single, two, two, two[:1]),
        lambda: kernels.window_cues(*sights, box, corners > 0, single, single, two, two, two[:1]),
        lambda: kernels.window_cues(*sights, corners * 1.0, corners > 0, single[:3], single[:3], two, two, two[:1]),
        lambda: kernels.window_cues(*sights, corners * 1.0, corners > 0, single, single, two, two, two),
        lambda: kernels.distinct_windows(two, 0, 0, 3, 3, 5, 5, corners, places),
        lambda: kernels.distinct_windows(np.zeros((2, 2)), 0, 0, 0, 3, 5, 5, corners, places),
        lambda: kernels.distinct_windows(np.zeros((2, 2)), 0, 0, 3, 3, 1 << 40, 5, corners, places),
        lambda: kernels.window_masses(image, table[:9], corners, np.zeros((3, 3)), np.zeros((2, 4))),
        lambda: kernels.window_masses(image, table, corners + 9, np.zeros((3, 3)), np.zeros((2, 4))),
        lambda: kernels.window_masses(image, table, corners, np.zeros((0, 3)), np.zeros((2, 4))),
        lambda: kernels.window_masses(image, table, corners, np.zeros((3, 3)), three),
        lambda: kernels.surround_histograms(image, table + 9, 0, 0, corners, np.zeros((2, 2)), np.zeros((2, 4)), two),
        lambda: kernels.surround_histograms(image, table, 0, 0, corners - 1, np.zeros((2, 2)), np.zeros((2, 4)), two),
        lambda: kernels.bhattacharyya(np.zeros((2, 3)), np.zeros(4), two),
        lambda: kernels.below_best(two, two, 1.0, three),
        lambda: kernels.below_best(two, three, 1.0, two),
        lambda: kernels.weighted(two, three),
        lambda: kernels.pick(two[:0], two, places),
        lambda: kernels.pick(two, three, places),
        lambda: kernels.ar2_drawn(two, two, places, 1.0, two, three, three, three),
        lambda: kernels.velocity_likeness(np.zeros((1, 2)), two, False, two),
        lambda: kernels.line(two[:0], two, two),
        lambda: kernels.mean_shift(image, table, 2.0, 1e9, two, 9, 0.1, two, two, two[:1]),
        lambda: kernels.mean_shift(image, table, 2.0, 2.0, two, 9, 0.1, two, two, two),
    ]  # fmt: skip
    for call in wrong:
        with pytest.raises(ValueError, match=r"do not agree|out of range|without|beyond|away|bin for each|mismatch"):
            call()
    with pytest.raises(IndexError):
        kernels.ar2_drawn(two, two, places + 1, 1.0, two, np.zeros(4), np.zeros(4), np.zeros(4))
    with pytest.raises(TypeError):
        kernels.line(two.astype(np.float32), two, two)
    with pytest.raises(ValueError, match="picture"):
        kernels.window_masses(two, table, corners, np.zeros((3, 3)), np.zeros((2, 4)))  # type: ignore[arg-type]  # what is wrong is the test
