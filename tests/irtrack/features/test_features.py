"""Windows, histograms, correlation and centroids against values worked by hand."""

from __future__ import annotations

from math import exp, log, sqrt

import numpy as np
import pytest

from irsim.types import Box, Frame, Image
from irtrack.features.centroid import centroid, contrast
from irtrack.features.correlation import best_distractor, ncc, peak
from irtrack.features.histogram import (
    LocalBackground,
    bhattacharyya,
    bhattacharyya_distance,
    gaussian_kernel,
    histogram,
    kullback_leibler,
    similarity,
    variance_ratio,
)
from irtrack.features.quantiser import Quantiser, first_quantiser, fitted_range, full_range
from irtrack.features.window import Window, region


def test_window_of_whole_pixels_is_the_box() -> None:
    window = Window.of(Box.from_pixels(20, 30, 14, 9))
    assert (window.columns, window.rows, window.phase) == (14, 9, (0.0, 0.0))
    assert window.corner((26.5, 34.0)) == (20, 30)
    assert window.center((20, 30)) == (26.5, 34.0)


@pytest.mark.parametrize("dx", [-0.5, 0.0, 0.2])
def test_window_returns_to_the_start_box(dx: float) -> None:
    box = Box(10 + dx, 8 - dx, 5.3, 6.8)
    window = Window.of(box)
    corner = window.corner((box.cx, box.cy))
    assert window.center(corner) == pytest.approx((box.cx, box.cy))
    assert abs(window.phase[0]) <= 0.5
    assert window.corner((box.cx + 3.4, box.cy - 2.4)) == (corner[0] + 3, corner[1] - 2)


def test_window_inside_keeps_the_centre() -> None:
    window = Window.of(Box.from_pixels(-2, 3, 6, 4))
    part, corner = window.inside((-2, 3), (5, 20))
    assert (part.columns, part.rows, corner) == (4, 2, (0, 3))
    assert part.center(corner) == (0.5, 4.5)


def test_region_holds_the_window_inside_the_frame() -> None:
    image = np.arange(20 * 30, dtype=np.uint16).reshape(20, 30)
    window = Window.of(Box.from_pixels(0, 0, 6, 4))
    for corner in [(-50, -50), (0, 0), (12, 7), (24, 16), (99, 99)]:
        left, top, pixels = region(image, window, corner, (3, 2))
        assert pixels.shape[0] >= 4
        assert pixels.shape[1] >= 6
        assert np.array_equal(pixels, image[top : top + pixels.shape[0], left : left + pixels.shape[1]])
    assert region(image, window, (12, 7), 2)[:2] == (10, 5)
    assert region(image, window, (12, 7), 2)[2].shape == (8, 10)
    assert region(image, window, (12, 7), None)[2].shape == (20, 30)


def test_full_range_is_the_floor_of_the_sources() -> None:
    levels = np.arange(256, dtype=np.uint8)[None]
    for bins in (16, 24, 32):
        expected = [int(i // (256 / bins)) for i in range(256)]
        assert full_range(8, bins)(levels)[0].tolist() == expected
    assert full_range(14, 32)(np.array([[0, 511, 512, 16383]], np.uint16))[0].tolist() == [0, 0, 1, 31]


def test_fitted_range_splits_a_low_contrast_target() -> None:
    image = np.full((100, 100), 5000, np.uint16)
    image[40:50, 40:50] = 5040
    image[0, 0], image[1, 1] = 0, 65535
    fitted = fitted_range(image, image[40:50, 40:50], 32)
    assert (fitted.low, fitted.high) == (5000 - 4, 5040 + 4)
    assert fitted(image[45:46, 39:41])[0].tolist() == [int(4 / 48 * 32), int(44 / 48 * 32)]
    frame = Frame(image, 0, 0.0, 16)
    whole = first_quantiser(frame, image[40:50, 40:50], 32, "full")
    assert len(set(whole(image[45:46, 39:41])[0].tolist())) == 1
    constant = np.full((9, 9), 7, np.uint8)
    assert fitted_range(constant, constant, 8)(constant).tolist() == [[4] * 9] * 9


def test_histogram_of_three_by_three_pixels_by_hand() -> None:
    """k = 1 in the middle, exp(-1/2 . 1/4.5) on the edges, exp(-1/2 . 2/4.5) in the corners; h^2 = 4.5."""
    image = np.array([[10, 10, 200], [10, 200, 200], [10, 10, 200]], np.uint8)
    window = Window.of(Box.from_pixels(0, 0, 3, 3))
    kernel = gaussian_kernel(window, sqrt(1.5**2 + 1.5**2))
    edge, corner = exp(-1 / 9), exp(-2 / 9)
    total = 1 + 4 * edge + 4 * corner  # 1 + 3.579357 + 3.202948
    low = (2 * edge + 2 * corner + edge) / total
    p, visible = histogram(image, (1, 1), window, kernel, full_range(8, 2))
    # 10: top-left, top, left, bottom-left, bottom; 200: top-right, middle, right, bottom-right.
    assert p == pytest.approx([low, (1 + edge + 2 * corner) / total])
    assert p == pytest.approx([4.285992 / 7.782305, 3.496313 / 7.782305], abs=1e-6)
    assert visible == pytest.approx(1)
    # Half outside, and outside.
    flat = np.full((3, 3), 1 / 9)
    p, visible = histogram(image, (3, 1), window, flat, full_range(8, 2))
    assert visible == pytest.approx(3 / 9)
    assert p == pytest.approx([0, 1])
    p, visible = histogram(image, (30, 1), window, flat, full_range(8, 2))
    assert visible == 0
    assert p.tolist() == [0, 0]


def test_bhattacharyya_by_hand() -> None:
    p, q = np.array([0.25, 0.75, 0.0]), np.array([0.25, 0.25, 0.5])
    assert bhattacharyya(p, q) == pytest.approx(0.25 + sqrt(0.1875))
    assert bhattacharyya(q, q) == pytest.approx(1)
    assert bhattacharyya(np.array([1.0, 0, 0]), np.array([0, 0, 1.0])) == 0
    assert bhattacharyya(np.append(p, 0.5), q) == bhattacharyya(p, q)
    with pytest.raises(ValueError, match="mismatch"):
        bhattacharyya(p[:2], q)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_similarity_of_many_windows_by_loops(dtype: type) -> None:
    rng = np.random.default_rng(4)
    image: Image = rng.integers(0, 256, (40, 50)).astype(dtype)
    window = Window.of(Box(20.3, 11.8, 7, 6))
    kernel = gaussian_kernel(window, 4.0)
    levels = Quantiser(20.0, 230.0, 12)
    centers = rng.uniform((-15, -15), (65, 55), (150, 2))
    reference = rng.dirichlet(np.ones(12))
    rho, visible = similarity(image, centers, window, kernel, levels, reference)
    for i, (x, y) in enumerate(centers.tolist()):
        mass = np.zeros(12)
        left, top = window.corner((x, y))
        for row in range(6):
            for column in range(7):
                if 0 <= top + row < 40 and 0 <= left + column < 50:
                    level = (int(image[top + row, left + column]) - 20) * 12 // 210
                    mass[min(max(level, 0), 11)] += kernel[row, column]
        share = mass.sum()
        assert visible[i] == pytest.approx(share)
        expected = np.sqrt(mass / share * reference).sum() * share if share else 0
        assert rho[i] == pytest.approx(expected)
    assert (visible == 0).any()
    assert ((visible > 0) & (visible < 0.99)).any()


def test_local_background_by_hand() -> None:
    image = np.zeros((20, 20), np.uint8)
    image[8:12, 7:13] = 255
    window = Window.of(Box.from_pixels(7, 8, 6, 4))
    kernel = gaussian_kernel(window, 3.0)
    background = LocalBackground.of(window, kernel, (3, 2), full_range(8, 2))
    center = window.center((7, 8))
    both, visible = background.histograms(image, center)
    assert both == pytest.approx(np.array([[0, 1], [1, 0]]))
    assert visible == pytest.approx([1, 1])
    shifted, _ = background.histograms(image, (center[0] + 3, center[1]))
    # Three of the target's six columns are in the window, three in the ring of 12 x 8 - 6 x 4 pixels.
    assert shifted[1] == pytest.approx([60 / 72, 12 / 72])
    assert shifted[0] == pytest.approx(
        histogram(image, (center[0] + 3, center[1]), window, kernel, full_range(8, 2))[0]
    )


@pytest.mark.parametrize("offset", [0, 40000])
def test_ncc_is_the_correlation_coefficient(offset: int) -> None:
    rng = np.random.default_rng(1)
    image = (offset + rng.integers(0, 200, (14, 17))).astype(np.uint16)
    template = image[3:9, 5:12].astype(np.float64)
    scores = ncc(image, template)
    assert scores.shape == (9, 11)
    for y in range(9):
        for x in range(11):
            r = np.corrcoef(image[y : y + 6, x : x + 7].ravel().astype(float), template.ravel())[0, 1]
            assert scores[y, x] == pytest.approx(r, abs=2e-5)
    # Of a constant it is 0.
    assert not ncc(np.full((10, 12), 77, np.uint8), np.arange(12.0).reshape(3, 4)).any()
    assert not ncc(np.arange(120, dtype=np.uint8).reshape(10, 12), np.full((3, 4), 9.0)).any()


def test_peak_is_the_top_of_a_parabola() -> None:
    y, x = np.mgrid[:7, :9].astype(float)
    scores = 0.9 - 0.02 * (x - 4.3) ** 2 - 0.03 * (y - 2.8) ** 2
    place, score = peak(scores)
    assert place == pytest.approx((4.3, 2.8))
    assert score == scores[3, 4]
    # On the edge or a plateau it is a whole pixel.
    y, x = np.mgrid[:5, :5].astype(float)
    assert peak(-((x + 0.4) ** 2) - (y - 4.4) ** 2)[0] == (0, 4)
    assert peak(np.zeros((4, 4)))[0] == (0, 0)


def test_best_distractor_does_not_overlap_the_target() -> None:
    scores = np.zeros((20, 30))
    scores[10, 12] = 1.0
    scores[11, 16] = 0.8  # overlaps a window of 6 x 4 px
    scores[10, 18] = 0.6  # just apart in x
    scores[14, 12] = 0.7  # just apart in y
    window = Window.of(Box.from_pixels(0, 0, 6, 4))
    assert best_distractor(scores, (12, 10), window) == 0.7
    assert best_distractor(scores[8:13, 10:15], (2, 2), window) == 0


@pytest.mark.parametrize("contrast_sign", [1, -1])
def test_centroid_by_hand(contrast_sign: int) -> None:
    region = np.full((7, 9), 100.0)
    region[2, 3], region[2, 4], region[3, 4] = 140, 160, 120
    region = 100 + contrast_sign * (region - 100)
    # Threshold .5 . 40 = 20 over the level of 100: excesses of 20, 40 and 0.
    found = centroid(region.astype(np.uint8), contrast_sign * 40.0, 0.5)
    assert found == pytest.approx(((3 * 20 + 4 * 40) / 60, 2))
    # Without a pixel above it, or contrast, there is none.
    region = np.full((7, 9), 100, np.uint8)
    assert centroid(region, 40.0, 0.5) is None
    assert centroid(region, 0.0, 0.5) is None
    region[3, 3] = 60
    assert centroid(region, 40.0, 0.5) is None


def test_contrast_in_tight_and_loose_boxes() -> None:
    image = np.full((30, 30), 100, np.uint16)
    image[10:14, 10:16] = 180
    assert contrast(image[10:14, 10:16][:, :5], image) == 0  # constant: nothing to split
    assert contrast(image[9:15, 9:17], image) == 80
    assert contrast(image[4:20, 3:24], image) == 80
    image[10:14, 10:16] = 30
    assert contrast(image[4:20, 3:24], image) == -70


def test_distances_of_histograms_by_hand() -> None:
    """q = (1/2, 1/2, 0), b = (0, 1/2, 1/2): rho = 1/2. With delta = .001: KL = 1/2 ln 500; L = ln 500 (1, 0, -1);
    var(L; q) = (1/2 - 1/4) ln^2 = var(L; b), var(L; (q + b) / 2) = 1/2 ln^2: ratio 1."""
    q, b = np.array([0.5, 0.5, 0]), np.array([0, 0.5, 0.5])
    assert bhattacharyya_distance(q, b) == pytest.approx(sqrt(0.5))
    assert kullback_leibler(q, b) == pytest.approx(0.5 * log(500))
    assert variance_ratio(q, b) == pytest.approx(1)
    for measure in (bhattacharyya_distance, kullback_leibler, variance_ratio):
        assert measure(q, q) == pytest.approx(0, abs=1e-7)
