"""Mean shift against steps worked by hand, and on pictures whose best place is known."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irsim.types import Box, Image
from irtrack.features.mean_shift import back_projection, bandwidth, kernel_histogram, mean_shift
from irtrack.features.quantiser import full_range

QUANTISER = full_range(8, 2)
"""Two bins: below 128, and from 128 on."""


def disc(cx: float, cy: float, radius: float = 6.0) -> Image:
    """A bright disc with soft edges on a dark field, 80x60."""
    y, x = np.mgrid[:60, :80]
    cover = np.clip(radius + 0.5 - np.hypot(x - cx, y - cy), 0, 1)
    image: Image = (40 + 180 * cover).astype(np.uint8)
    return image


def test_histogram_of_a_ring_of_pixels_by_hand() -> None:
    """h = 2: k is 1 at the centre, .75 at its four neighbours, .5 on the diagonals, 0 two px away."""
    image = np.zeros((9, 9), np.uint8)
    image[4, 4] = image[4, 5] = 200
    histogram, visible = kernel_histogram(image, (4.0, 4.0), (2.0, 2.0), QUANTISER)
    whole = 1 + 4 * 0.75 + 4 * 0.5
    assert histogram == pytest.approx([(whole - 1.75) / whole, 1.75 / whole])
    assert visible == pytest.approx(1)
    # On the frame's corner: the centre, two neighbours and a diagonal are left.
    histogram, visible = kernel_histogram(image, (8.0, 8.0), (2.0, 2.0), QUANTISER)
    assert histogram.tolist() == [1, 0]
    assert visible == pytest.approx((1 + 2 * 0.75 + 0.5) / whole)
    histogram, visible = kernel_histogram(image, (50.0, 4.0), (2.0, 2.0), QUANTISER)
    assert (histogram.tolist(), visible) == ([0, 0], 0)


def test_one_step_by_hand() -> None:
    """One bright pixel beside the centre, h = 2 (eq. 10 and 13).

    p(bright) = .75 / 6, p(dark) = 5.25 / 6; q = (.5, .5) gives w = 2 and sqrt(.5 / .875). The ramp of
    g is (1 - r) 2 + 1/2, clipped: 1 within r = .75 (the middle nine), .5 at the four with r = 1, and
    (1 - sqrt(5) / 2) 2 + 1/2 = .264 at the eight beside them.
    """
    image = np.zeros((9, 9), np.uint8)
    image[4, 5] = 200
    dark, bright = sqrt(0.5 / (5.25 / 6)), sqrt(0.5 / (0.75 / 6))
    total = bright + dark * (8 + 4 * 0.5 + 8 * (2.5 - sqrt(5)))
    modes = mean_shift(image, np.array([[4.0, 4.0]]), (2, 2), QUANTISER, np.array([0.5, 0.5]), iterations=1)
    assert modes.centers[0] == pytest.approx([4 + (bright - dark) / total, 4])


@settings(max_examples=12, deadline=None, derandomize=True)
@given(at=st.tuples(st.floats(20, 60), st.floats(20, 40)), off=st.tuples(st.floats(-4, 4), st.floats(-4, 4)))
def test_reaches_a_disc_between_pixels(at: tuple[float, float], off: tuple[float, float]) -> None:
    reference, _ = kernel_histogram(disc(40, 30), (40, 30), (6, 6), QUANTISER)
    start = np.array([at]) + off
    modes = mean_shift(disc(*at), start, (6, 6), QUANTISER, reference, eps=0.001, iterations=200)
    assert modes.centers[0] == pytest.approx(at, abs=0.15)
    assert modes.rho[0] > 0.995


def test_many_windows_move_as_each_alone() -> None:
    rng = np.random.default_rng(3)
    image = rng.integers(0, 256, (40, 50), dtype=np.uint8)
    quantiser = full_range(8, 16)
    reference, _ = kernel_histogram(image, (20, 20), (4, 3), quantiser)
    centers = rng.uniform(-8, 55, (10, 2))
    together = mean_shift(image, centers, (4, 3), quantiser, reference)
    for k, center in enumerate(centers):
        alone = mean_shift(image, center[None], (4, 3), quantiser, reference)
        assert together.centers[k] == pytest.approx(alone.centers[0])
        assert together.rho[k] == pytest.approx(alone.rho[0])


def test_a_window_without_levels_of_the_reference_stays() -> None:
    image = np.zeros((30, 30), np.uint8)
    for center in ((15.0, 15.0), (-20.0, 15.0), (29.4, 29.4)):
        modes = mean_shift(image, np.array([center]), (4, 4), QUANTISER, np.array([0.0, 1.0]))
        assert modes.centers[0].tolist() == list(center)
        assert modes.rho[0] == 0


def test_bandwidth_is_half_the_box_and_holds_a_pixel() -> None:
    assert bandwidth(Box(0, 0, 14, 10)) == (7, 5)
    assert bandwidth(Box(0, 0, 14, 10), 1.5) == (10.5, 7.5)
    h = bandwidth(Box(0, 0, 1, 0.2))
    for center in ((5.5, 5.5), (5.0, 5.0), (5.25, 5.49)):
        histogram, visible = kernel_histogram(np.full((12, 12), 9, np.uint8), center, h, QUANTISER)
        assert (histogram.tolist(), visible) == ([1, 0], 1)


def test_back_projection_by_hand() -> None:
    image = np.array([[0, 64], [128, 255]], np.uint8)
    shares = back_projection(image, full_range(8, 4), np.array([0.1, 0.0, 0.4, 0.2]))
    assert shares == pytest.approx(np.array([[0.25, 0], [1, 0.5]]))
    assert back_projection(image, QUANTISER, np.zeros(2)).tolist() == [[0, 0], [0, 0]]
