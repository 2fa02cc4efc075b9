"""Addressed randomness: the same numbers anywhere, normal out to the tails."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import special, stats

from irsim.rng import (
    CELLS,
    REFINED,
    bit_generator,
    cell_means,
    deep_quantile,
    lookup,
    normal_quantile,
    normals,
    stream,
    uniforms,
)

GOLDEN_WORDS = [15876630395588759108, 1528180998070881078, 1679443906312003050]
GOLDEN_NORMALS = [0.86230469, -1.5588379, -1.1651611, 1.0833740, -0.5423584, -0.25219727]
"""Of the address (7, "noise", "white", 3). If a numpy release changes these, recordings no longer re-render."""


def test_raw_words_of_an_address_never_change() -> None:
    words = bit_generator(7, "noise", "white", 3).random_raw(3)
    assert [int(word) for word in words] == GOLDEN_WORDS


def test_normals_of_an_address_never_change() -> None:
    np.testing.assert_allclose(normals((6,), 7, "noise", "white", 3), GOLDEN_NORMALS, rtol=1e-6)


def test_an_address_gives_the_same_in_another_process() -> None:
    program = "from irsim.rng import *; print(stream(5, 'a', 1).random(), normals((3, 4), 5, 'a', 1).tobytes().hex())"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert found.split() == [str(stream(5, "a", 1).random()), normals((3, 4), 5, "a", 1).tobytes().hex()]


def test_integers_of_numpy_are_addresses_and_floats_are_not() -> None:
    one: Any = np.int64(1)
    np.testing.assert_array_equal(normals((4,), 1, "a", 3), normals((4,), one, "a", 3 * one))
    with pytest.raises(TypeError):
        bit_generator(1, "a", 0.5 * one)


def test_uniforms_are_those_of_the_stream() -> None:
    np.testing.assert_array_equal(uniforms(5000, 3, "blinking", 7), stream(3, "blinking", 7).random(5000))


@pytest.mark.parametrize(
    "other",
    [(1, "a", 3), (0, "a", 4), (0, "a", "3"), (0, "a3"), (0, 3, "a"), (-1, "a", 3)],
)
def test_addresses_are_independent(other: tuple[int, str, int]) -> None:
    n = 50_000
    first, second = normals((n,), 0, "a", 3), normals((n,), *other)
    assert abs(np.corrcoef(first, second)[0, 1]) < 4 / np.sqrt(n)


def test_quantiles_are_the_inverse_normal() -> None:
    p = np.concatenate([np.geomspace(1e-30, 0.5, 3001), 1 - np.geomspace(1e-12, 0.4, 1001)])
    np.testing.assert_allclose(normal_quantile(p), special.ndtri(p), rtol=2e-15, atol=1e-16)
    deep = np.geomspace(2.0**-82, REFINED / CELLS, 1001)
    np.testing.assert_allclose(deep_quantile(deep), special.ndtri(deep), atol=6e-7, rtol=0)


def test_the_table_with_its_true_tails_has_variance_one() -> None:
    edge = stats.norm.isf(REFINED / CELLS)
    tails = 2 * (REFINED / CELLS) * (1 + edge * stats.norm.pdf(edge) / stats.norm.sf(edge))
    means = cell_means().astype(np.float64)
    assert np.sum(means[REFINED:-REFINED] ** 2) / CELLS + tails == pytest.approx(1, abs=5e-7)  # words are rounded
    assert np.sum(means) == 0
    assert np.all(np.diff(means) >= 0)


def test_moments_and_tails() -> None:
    """5 million draws; every figure within 4.5 standard errors of the normal law's."""
    values = normals((5_000_000,), 11, "moments", 0).astype(np.float64)
    # Standard errors from the normal's moments: Var x = 1, Var x^2 = 2, Var x^3 = 15, Var x^4 = 96.
    off = (np.array([(values**k).mean() for k in (1, 2, 3, 4)]) - [0, 1, 0, 3]) / np.sqrt(
        np.array([1, 2, 15, 96]) / values.size
    )
    assert np.all(np.abs(off) < 4.5), off
    for level in (3.0, 4.0, 4.5):
        expected = values.size * stats.norm.sf(level)
        for found in ((values > level).sum(), (values < -level).sum()):
            assert abs(found - expected) < 4.5 * np.sqrt(expected), level


def test_distribution_is_normal() -> None:
    assert stats.kstest(normals((200_000,), 3, "ks"), "norm").pvalue > 0.001


def test_neighbouring_pixels_are_independent() -> None:
    values = normals((256, 320), 4, "neighbours").astype(np.float64)
    for rows, columns in ((0, 1), (0, 2), (0, 4), (1, 0), (1, 1)):
        a = values[rows:, columns:]
        b = values[: values.shape[0] - rows, : values.shape[1] - columns]
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 4.5 / np.sqrt(a.size)


@pytest.mark.parametrize("shape", [(5, 7), (2, 3, 4), (3, 0)])
def test_shapes_and_out(shape: tuple[int, ...]) -> None:
    values = normals(shape, 9, "out")
    assert values.shape == shape
    assert values.dtype == np.float32
    out = np.empty(shape, np.float32)
    assert normals(shape, 9, "out", out=out) is out
    np.testing.assert_array_equal(out, values)
    np.testing.assert_array_equal(values.ravel(), normals((values.size,), 9, "out"))


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_lookup_is_indexing(kind: type) -> None:
    words = bit_generator(1, "words").random_raw(1000).view(np.uint16).reshape(40, 100)
    table: npt.NDArray[Any] = (np.arange(65_536) % 251).astype(kind)
    for shape in ((40, 100), (4000,)):  # by OpenCV and by numpy
        found = lookup(table, words.reshape(shape))
        assert found.dtype == kind
        np.testing.assert_array_equal(found, table[words.reshape(shape)])
