"""Detectors' C kernels against their plain twins: exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracker_loops import plain, seeds

from irsim.types import Frame
from irtrack._native import COMPILED, kernels
from irtrack.detectors import make_detector
from irtrack.detectors import peaks as chain

pytestmark = pytest.mark.skipif(not COMPILED, reason="nothing is compiled")


@st.composite
def heights(draw: st.DrawFn) -> np.ndarray:
    """Pictures of noise, or of few levels, so that maxima are tied and touch the edges."""
    shape = draw(st.tuples(st.integers(1, 40), st.integers(1, 40)))
    rng = np.random.default_rng(draw(seeds))
    levels = draw(st.sampled_from([2, 4, 10_000]))
    return rng.integers(0, levels, shape).astype(np.float32)


@settings(max_examples=80)
@given(heights(), st.integers(1, 6), st.floats(0, 3), st.integers(1, 8))
def test_maxima_centres_and_sizes(picture: np.ndarray, separation: int, least: float, reach: int) -> None:
    rows, columns = chain.maxima(picture, separation, least, 50)
    centers, sizes = chain.vertices(picture, rows, columns), chain.measured(picture, rows, columns, reach)
    with plain():
        expected = chain.maxima(picture, separation, least, 50)
        np.testing.assert_array_equal((rows, columns), expected)
        np.testing.assert_array_equal(centers, chain.vertices(picture, rows, columns))
        for own, other in zip(sizes, chain.measured(picture, rows, columns, reach), strict=True):
            np.testing.assert_array_equal(own, other)


@settings(max_examples=40)
@given(heights(), st.integers(1, 4))
def test_places_of_a_plateau(picture: np.ndarray, separation: int) -> None:
    places = np.flatnonzero(picture == picture.max())
    found = chain.merged(picture, places, separation)
    with plain():
        np.testing.assert_array_equal(found, chain.merged(picture, places, separation))


@pytest.mark.parametrize("radius", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("shape", [(7, 9), (60, 75), (40, 200)])
def test_medians_along_lines(radius: int, shape: tuple[int, int]) -> None:
    image = np.random.default_rng(radius).integers(0, 16_000, shape).astype(np.uint16)
    detector: Any = make_detector("max_median", {"radius": radius})
    found = detector.response(image.astype(np.float32))
    with plain():
        np.testing.assert_array_equal(found, detector.response(image.astype(np.float32)))


def test_detections_are_the_same() -> None:
    image = np.random.default_rng(1).normal(500, 20, (70, 90))
    image[20:23, 30:33] += 300
    frame = Frame(np.rint(image).astype(np.uint16), 0, 0.0, 14)
    for name in ("tophat", "max_median", "mpcm", "ring"):
        detector: Any = make_detector(name, {"threshold": 2.0})
        found = detector.detect(frame)
        with plain():
            expected = detector.detect(frame)
        assert len(found) > 2
        for own, other in zip(found, expected, strict=True):
            assert (own.box, own.score) == (other.box, other.score)
            np.testing.assert_array_equal(own.covariance, other.covariance)


@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("highest", [np.ones((5, 6), np.float32), np.array([0, 29]), 2, np.zeros(2, np.uint8)], {0: 30, 1: 1, 2: 0}),
        ("merge_places", [np.ones((5, 6), np.float32), np.array([0, 29]), 2, np.zeros(2, np.uint8)], {1: 1, 2: 2**40}),
        ("vertices", [np.ones((5, 6), np.float32), np.array([0, 29]), np.zeros((2, 2))], {1: 1, 2: 3}),
        (
            "peak_sizes",
            [np.ones((5, 6), np.float32), np.array([29]), 2, np.zeros((1, 16), np.float32), np.zeros(2), np.zeros(1)],
            {2: 3, 3: 8, 4: 1, 5: 2},
        ),
        ("line_medians", [np.ones((9, 10), np.uint16), 2, np.ones((5, 6), np.uint16)], {0: 5, 1: 6, 2: 4}),
    ],
)
def test_each_wrong_argument_is_an_error(name: str, right: list[Any], wrong: dict[int, int]) -> None:
    """An array of another length, a number out of range, a place outside the picture."""
    call: Any = getattr(kernels, name)
    call(*right)
    for at, value in wrong.items():
        other = value if isinstance(right[at], int) else np.ones(value, right[at].dtype)
        with pytest.raises((TypeError, ValueError, BufferError, OverflowError)):
            call(*right[:at], other, *right[at + 1 :])
    if name != "line_medians":
        with pytest.raises(ValueError, match="outside"):
            call(right[0], right[1] + 30, *right[2:])
