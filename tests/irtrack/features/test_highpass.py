"""Background prediction against rings worked by hand."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from irsim.types import MEDIAN_TO_SIGMA, Image
from irtrack.detectors.bandpass import Butterworth
from irtrack.features.frequency import FrequencyHighPass
from irtrack.features.highpass import ROUNDING, HighPass, full_kernel, predicted_background, ring_kernel


def test_rings_by_hand() -> None:
    """Radius 1, m = 4: the centre and its four neighbours; m = 8: cos 45 deg = .71 rounds to the diagonals."""
    assert ring_kernel(1, 4).tolist() == [[0, 1, 0], [1, 1, 1], [0, 1, 0]]
    assert ring_kernel(1, 8).tolist() == [[1, 1, 1]] * 3
    # m = 8, radius 2: (2, 0), and (1.41, 1.41), which rounds to (1, 1), as of radius 1.
    expected = [[0, 0, 1, 0, 0], [0, 2, 1, 2, 0], [1, 1, 1, 1, 1], [0, 2, 1, 2, 0], [0, 0, 1, 0, 0]]
    assert ring_kernel(2, 8).tolist() == expected
    without = [[0, 0, 1, 0, 0], [0, 1, 0, 1, 0], [1, 0, 0, 0, 1], [0, 1, 0, 1, 0], [0, 0, 1, 0, 0]]
    assert ring_kernel(2, 8, inner=2).tolist() == without


@pytest.mark.parametrize(("grid", "shape"), [(2, (13, 17)), (7, (12, 20)), (20, (5, 1))])
def test_pixels_take_the_nearest_prediction(grid: int, shape: tuple[int, int]) -> None:
    pixels = np.random.default_rng(1).uniform(0, 50, shape).astype(np.float32)
    every = predicted_background(pixels, ring_kernel(3, 8), 1)
    coarse = predicted_background(pixels, ring_kernel(3, 8), grid)

    def places(n: int) -> np.ndarray:
        predicted = np.arange(min((grid - 1) // 2, n - 1), n, grid)
        blocks = np.arange(n) // grid
        return predicted[np.minimum(blocks, len(predicted) - 1)]

    assert coarse.tolist() == every[np.ix_(places(shape[0]), places(shape[1]))].tolist()


def test_full_neighbourhood_is_the_mean() -> None:
    pixels = np.random.default_rng(1).uniform(0, 50, (9, 9)).astype(np.float32)
    assert predicted_background(pixels, full_kernel(2), 1)[4, 4] == pytest.approx(pixels[2:7, 2:7].mean(), rel=1e-6)


def test_high_pass_by_hand() -> None:
    """A point 30 above its ring of four, the residual's deviation 3: 128 + 128 / (8 . 3) . 24."""
    image = np.full((9, 9), 100, np.uint8)
    image[4, 4] = 130
    picture = HighPass(ring_kernel(1, 4), 1, 128 / (8 * 3))(image)
    assert picture[4, 4] == 128 + 128 / 24 * 24 - 1  # 256 is clipped to 255
    assert picture[4, 3] == 128 - 128 / 24 * 6
    assert picture[0, 0] == 128


def test_the_gain_follows_the_noise_and_not_the_target() -> None:
    rng = np.random.default_rng(2)
    noise = 5000 + 20 * rng.standard_normal((120, 160))
    kernel = ring_kernel(5, 8, inner=5)  # eight samples: the residual's deviation is 20 sqrt(1 + 1/8)
    plain: Image = noise.astype(np.uint16)
    gain = HighPass.fitted(plain, kernel, 1).gain
    assert gain == pytest.approx(128 / (8 * 20 * sqrt(1 + 1 / 8)), rel=0.03)
    with_target = plain.copy()
    with_target[50:60, 60:74] += 3000
    assert HighPass.fitted(with_target, kernel, 1).gain == pytest.approx(gain, rel=0.05)


@pytest.mark.parametrize(("dtype", "level"), [(np.uint8, 0), (np.uint8, 255), (np.uint16, 65535)])
def test_a_constant_frame_is_grey(dtype: type, level: int) -> None:
    image: Image = np.full((20, 30), level, dtype)
    high_pass = HighPass.fitted(image, ring_kernel(3, 8), 2)
    assert high_pass.gain == pytest.approx(16 / ROUNDING)
    assert (high_pass(image) == 128).all()


@pytest.mark.parametrize(("L", "grid"), [(1, 1), (8, 1), (5, 3)])
def test_a_part_is_that_of_the_whole_picture(L: int, grid: int) -> None:
    """Within the frame, at its edges, and none of it."""
    image = np.random.default_rng(4).normal(120, 6, (24, 31)).astype(np.uint8)
    high_pass = HighPass.fitted(image, ring_kernel(L, 8), grid)
    whole, view = high_pass(image), high_pass.view(image)
    assert view.shape == (24, 31)
    for part in (np.s_[0:24, 0:31], np.s_[0:1, 0:1], np.s_[23:24, 30:31], np.s_[9:14, 3:29], np.s_[0:0, 3:9]):
        assert view[part].tolist() == whole[part].tolist()


@pytest.mark.parametrize(("L", "most"), [(3, 65535), (12, 16383)])
def test_sums_are_exact_however_many_there_are(L: int, most: int) -> None:
    """Counts near the greatest there are, and a gain that shows single ones."""
    image: Image = np.random.default_rng(5).integers(most - 1, most + 1, (70, 80)).astype(np.uint16)
    high_pass = HighPass(full_kernel(L), 1, (2 * L + 1) ** 2)
    padded = np.pad(image.astype(np.int64), L, mode="reflect")
    sums = np.lib.stride_tricks.sliding_window_view(padded, (2 * L + 1, 2 * L + 1)).sum(axis=(2, 3))
    levels = 128 + (2 * L + 1) ** 2 * image.astype(np.int64) - sums
    assert high_pass.full_picture(image).tolist() == np.clip(levels, 0, 255).tolist()
    assert high_pass.view(image)[20:41, 7:50].tolist() == np.clip(levels, 0, 255)[20:41, 7:50].tolist()


def test_frequency_high_pass_shows_the_butterworth_response() -> None:
    """Its picture is the detector's response, 128 + gain z, with the cut-off of the first frame."""
    rng = np.random.default_rng(4)
    y, x = np.mgrid[:60, :80]
    image = np.rint(900 + 3 * x + 20 * np.sin(y / 9) + rng.normal(0, 4, x.shape)).astype(np.uint16)
    image[30, 40] += 60
    first = FrequencyHighPass.fitted(image)
    cutoff, response = Butterworth().respond(None, image.astype(np.float32))
    assert first.cutoff == cutoff
    spread = np.median(np.abs(response)) * MEDIAN_TO_SIGMA
    assert first.gain == pytest.approx(16 / spread, rel=1e-5)
    assert np.abs(first(image) - np.clip(128 + first.gain * response, 0, 255)).max() <= 0.51
    assert first(image).argmax() == 30 * 80 + 40
