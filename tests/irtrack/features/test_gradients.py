"""Grey levels and gradient orientations of windows, by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from irsim.types import Box
from irtrack.features.gradients import CueImage, Pattern, orientations, sobel
from irtrack.features.quantiser import full_range
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


@pytest.mark.parametrize("angle", [0, 45, 135, 315])
def test_an_orientation_falls_into_the_nearest_bin(angle: int) -> None:
    gx, gy = (np.full((1, 1), 5 * f(np.radians(angle + 1)), np.float32) for f in (np.cos, np.sin))
    cells, magnitude = orientations(gx, gy, 8)
    assert cells[0, 0] == round((angle + 1) / 45) % 8
    assert magnitude[0, 0] == pytest.approx(5)


def test_windows_of_several_sizes_by_hand() -> None:
    """A target of 4 x 2 px at level 200 in one of 20; a window of twice the size covers as many places, at twice
    the distance: of its 4 x 2 places the inner 2 x 2 see the target's columns, one row each misses it."""
    image = np.full((20, 20), 20, np.uint8)
    image[9:11, 8:12] = 200
    window = Window.of(Box(9.5, 9.5, 4, 2))
    pattern = Pattern.of(window, 400)
    field = CueImage(image, LEVELS, 8)
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


def test_the_map_is_the_similarity_of_each_window() -> None:
    image = np.random.default_rng(1).integers(0, 255, (24, 30), np.uint8)
    window = Window.of(Box(10.2, 8.7, 6, 5))
    pattern = Pattern.of(window, 400)
    field = CueImage(image, LEVELS, 8)
    model, _ = field.windows(pattern, np.array([[10.2, 8.7]]), np.ones((1, 2)))
    model = model.of(0)
    grey, gradient = field.similarity_map(window, pattern, model)
    assert grey.shape == (20, 25)
    corners = [(0, 0), (7, 6), (24, 19), (13, 4)]
    cues, _ = field.windows(pattern, np.array([window.center(c) for c in corners]), np.ones((4, 2)))
    for corner, rho, edge in zip(corners, *cues.similarity(model), strict=True):
        assert grey[corner[1], corner[0]] == pytest.approx(rho, abs=1e-4)
        assert gradient[corner[1], corner[0]] == pytest.approx(edge, abs=1e-4)
    assert grey[window.corner((10.2, 8.7))[::-1]] == pytest.approx(1, abs=1e-4)
    assert field.similarity_map(Window(40, 5, (0, 0)), pattern, model)[0].size == 0
