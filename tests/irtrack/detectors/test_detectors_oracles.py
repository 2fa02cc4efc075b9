"""The filters of detectors against other programs and against their definitions."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from detector_frames import LEVEL, NOISE, last, noise_frame, offsets
from scipy import ndimage
from skimage.morphology import white_tophat
from tracker_loops import plain

from irsim.types import Frame
from irtrack._native import COMPILED
from irtrack.detectors import make_detector
from irtrack.detectors.frame_difference import reduced, registered
from irtrack.detectors.matched_filter import clutter_covariance, point_image, whitened
from irtrack.features.frequency import CUTOFFS

IMAGE = np.random.default_rng(5).integers(900, 1100, (40, 47)).astype(np.float32)


def response(name: str, picture: Any = IMAGE, **parameters: Any) -> Any:
    detector: Any = make_detector(name, parameters)
    return detector.respond(None, picture)[1]


def at(picture: Any, row: int, column: int) -> float:
    """The pixel of a picture that is mirrored at its edges."""
    return float(np.pad(picture, 20, mode="reflect")[row + 20, column + 20])


def patch(row: int, column: int, side: int) -> Any:
    half = side // 2
    wide = np.pad(IMAGE.astype(np.float64), 20, mode="reflect")
    return wide[row + 20 - half : row + 21 + half, column + 20 - half : column + 21 + half]


LINES = [np.eye(5), np.eye(5)[::-1], np.ones((1, 5)), np.ones((5, 1))]
"""The four lines of five pixels."""


def test_tophat_is_that_of_scikit_image() -> None:
    expected = white_tophat(IMAGE, np.ones((7, 7)))
    assert np.array_equal(response("tophat")[6:-6, 6:-6], expected[6:-6, 6:-6])


def test_max_mean_and_max_median_are_those_of_scipy() -> None:
    means = [ndimage.correlate(IMAGE.astype(float), line / 5, mode="mirror") for line in LINES]
    assert response("max_mean", radius=2) == pytest.approx(IMAGE - np.max(means, axis=0), abs=1e-3)
    medians = [ndimage.median_filter(IMAGE, footprint=line > 0, mode="mirror") for line in LINES]
    assert np.array_equal(response("max_median", radius=2), IMAGE - np.max(medians, axis=0))


def test_max_median_of_a_large_frame() -> None:
    """Strips of rows join without a seam."""
    image = np.random.default_rng(1).integers(0, 4000, (200, 321)).astype(np.float32)
    lines = [np.eye(7), np.eye(7)[::-1], np.ones((7, 1)), np.ones((1, 7))]
    medians = [ndimage.median_filter(image, footprint=line > 0, mode="mirror") for line in lines]
    assert np.array_equal(response("max_median", image, radius=3), image - np.max(medians, axis=0))


def test_dog_is_that_of_scipy() -> None:
    inner, outer = (ndimage.gaussian_filter(IMAGE.astype(float), s, mode="mirror", truncate=5) for s in (1.0, 1.6))
    assert response("dog") == pytest.approx(inner - outer, abs=0.05)


def test_ring_is_equation_1() -> None:
    places = [(0, 0)] + [(r * cos(2 * pi * j / 8), r * sin(2 * pi * j / 8)) for r in range(1, 5) for j in range(8)]
    for row, column in ((20, 20), (0, 3), (39, 46)):
        nearest = np.floor(np.array(places) + 0.5 + 1e-9).astype(int)
        samples = [at(IMAGE, row + y, column + x) for x, y in nearest]
        assert response("ring")[row, column] == pytest.approx(IMAGE[row, column] - np.mean(samples), abs=1e-2)


def test_butterworth_is_that_of_a_mirrored_transform() -> None:
    twice = np.pad(IMAGE, ((0, 40), (0, 47)), mode="symmetric")
    v, u = (np.fft.fftfreq(count) for count in twice.shape)
    D = np.hypot(v[:, None], u)
    H = 1 / (1 + (0.1 / np.maximum(D, 1e-12)) ** 4)
    expected = np.fft.ifft2(np.fft.fft2(twice) * H).real[:40, :47]
    assert response("butterworth", cutoff=0.1) == pytest.approx(expected, abs=1e-2)


def test_butterworth_keeps_the_cutoff_of_the_first_frame() -> None:
    detector: Any = make_detector("butterworth")
    state, _ = detector.step(None, noise_frame(1, scr=20))
    assert state in CUTOFFS
    assert detector.step(state, noise_frame(2))[0] == state


def test_lcm_by_its_definition() -> None:
    found = response("lcm", sides=[3, 5])
    for row, column in ((20, 20), (0, 0), (39, 5)):
        measures = []
        for side in (3, 5):
            around = [(dy, dx) for dy in (-side, 0, side) for dx in (-side, 0, side) if dx or dy]
            means = [patch(row + dy, column + dx, side).mean() for dy, dx in around]
            half = side // 2
            inside = IMAGE[max(row - half, 0) : row + half + 1, max(column - half, 0) : column + half + 1]
            measures.append(inside.max().astype(float) ** 2 / max(means))
        assert found[row, column] == pytest.approx(max(measures), rel=1e-5)


def test_mpcm_by_its_definition() -> None:
    found = response("mpcm", sides=[3, 5])
    mean = ndimage.uniform_filter(IMAGE.astype(float), 3, mode="mirror")
    differences = mean - (np.roll(mean, 3, 1) + np.roll(mean, -3, 1)) / 2
    scale = 1.4826 * np.median(np.abs(differences - np.median(differences)))
    positive = 0
    for row in range(0, 40, 3):
        for column in range(0, 47, 3):
            measures = [0.0]
            for side in (3, 5):
                half = [(0, side), (side, side), (side, 0), (side, -side)]
                T = patch(row, column, side).mean()
                pairs = [
                    (T - patch(row + y, column + x, side).mean(), T - patch(row - y, column - x, side).mean())
                    for y, x in half
                ]
                if min(min(pair) for pair in pairs) > 0:
                    measures.append(min(a * b for a, b in pairs) ** 0.5)
            positive += max(measures) > 0
            assert found[row, column] * scale == pytest.approx(max(measures), rel=0.1, abs=0.02)
    assert positive > 5


@pytest.mark.skipif(not COMPILED, reason="no compiler was at hand")
@pytest.mark.parametrize("name", ["lcm", "mpcm"])
def test_compiled_and_plain_contrasts_are_equal(name: str) -> None:
    compiled = response(name)
    with plain():
        assert np.array_equal(response(name), compiled)


def test_svd_is_that_of_numpy() -> None:
    """Of a background of rank 3 above noise the random projection is exact to rounding of 32 bits."""
    rng = np.random.default_rng(3)
    background = rng.standard_normal((60, 3)) @ np.diag([9000.0, 3000, 1000]) @ rng.standard_normal((3, 80))
    picture = (background + 2e4 + rng.standard_normal((60, 80))).astype(np.float32)
    u, s, v = np.linalg.svd(picture.astype(float), full_matrices=False)
    residual = picture - (u[:, :4] * s[:4]) @ v[:4]
    expected = ndimage.uniform_filter(residual, 3, mode="mirror")
    assert response("svd", picture, components=4) == pytest.approx(expected, abs=0.02)


def test_matched_filter_in_white_and_in_coloured_noise() -> None:
    s = point_image(1.0, 7)
    white = whitened(np.eye(49), s)
    assert white == pytest.approx((s - s.mean()) / np.linalg.norm(s - s.mean()))
    rng = np.random.default_rng(0)
    clutter = ndimage.gaussian_filter(rng.standard_normal((240, 320)), 1.5) * 200 + rng.standard_normal((240, 320))
    picture = (1000 + 10 * clutter).astype(np.float32)
    kernel = whitened(clutter_covariance(picture, 7), s)
    assert kernel.sum() == pytest.approx(0, abs=1e-4)
    filtered = ndimage.correlate(picture.astype(float), kernel)
    assert filtered[8:-8, 8:-8].std() == pytest.approx(1, rel=0.05)
    dog = point_image(1.0, 7) - point_image(1.6, 7)
    other = ndimage.correlate(picture.astype(float), dog)[8:-8, 8:-8].std()
    assert (kernel * s).sum() > 1.3 * (dog * s).sum() / other


@pytest.mark.parametrize("step", [(0.0, 0.0), (1.0, -2.0), (1.4, 0.7)])
def test_frame_difference_registers_a_panning_camera(step: tuple[float, float]) -> None:
    """Structure moves by `step` px a frame under a gain and an offset; a target moves on it."""
    rng = np.random.default_rng(2)
    texture = 400 * ndimage.gaussian_filter(rng.standard_normal((200, 220)), 2.5)
    y, x = np.mgrid[:140, :160]
    frames = []
    for k in range(4):
        moved = ndimage.shift(texture, (k * step[1], k * step[0]), order=3, mode="reflect")[30:170, 30:190]
        target = 120 * np.exp(-((x - 70 - 4 * k) ** 2 + (y - 60) ** 2) / 2)
        image = (1 + 0.02 * k) * (LEVEL + moved + target + 5 * rng.standard_normal(x.shape)) + 30 * k
        frames.append(Frame(np.rint(image).astype(np.uint16), k, k / 30, 14))
    found = last(make_detector("frame_difference"), *frames)
    assert np.abs(offsets(found, [(82, 60)])).max() < 1
    assert found.scores[0] > 2 * (found.scores[1] if len(found) > 1 else 0)
    pictures = [frame.image.astype(np.float32) for frame in (frames[0], frames[3])]
    still = registered(*pictures, *map(reduced, pictures))
    residual = (frames[3].image - still)[20:-20, 20:-20]
    assert np.median(np.abs(residual)) < 10  # of noise alone 5


def test_frame_difference_needs_frames_of_one_size() -> None:
    detector: Any = make_detector("frame_difference")
    state, found = detector.step(None, noise_frame(1))
    assert len(found) == 0
    with pytest.raises(Exception, match="allowed: 96x80, as before"):
        detector.step(state, noise_frame(1, shape=(40, 40)))


def test_z_is_in_deviations_of_the_noise() -> None:
    found = make_detector("threshold", {"threshold": 3.0}).step(None, noise_frame(4, 12, ((50.0, 40.0),)))[1]
    k = int(np.abs(offsets(found, [(50, 40)])).max() < 1 and ((found.centers - (50, 40)) ** 2).sum(axis=1).argmin())
    row, column = np.rint(found.centers[k]).astype(int)[::-1]
    image = noise_frame(4, 12, ((50.0, 40.0),)).image
    assert found.scores[k] == pytest.approx((image[row, column] - LEVEL) / NOISE, rel=0.06)
