"""Addressed randomness: the same numbers anywhere, normal out to the tails."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import special, stats

from irsim import rng
from irsim.rng import (
    CELLS,
    REFINED,
    bit_generator,
    cell_means,
    deep_quantile,
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


def int_of_numpy(value: int) -> Any:
    return np.int64(value)


def test_a_numpy_integer_is_the_address_of_its_value() -> None:
    np.testing.assert_array_equal(normals((4,), 1, "a", 3), normals((4,), int_of_numpy(1), "a", int_of_numpy(3)))


@pytest.mark.parametrize("count", [0, 1, 5000])
def test_uniforms_are_those_of_the_stream(count: int) -> None:
    np.testing.assert_array_equal(uniforms(count, 3, "blinking", 7), stream(3, "blinking", 7).random(count))


def test_a_float_is_no_address() -> None:
    with pytest.raises(TypeError):
        bit_generator(1, "a", 0.5)  # type: ignore[arg-type]  # what is wrong is the test


@pytest.mark.parametrize(
    "other",
    [(1, "a", 3), (0, "a", 4), (0, "b", 3), (0, "a", "3"), (0, "a3"), (0, 3, "a"), (0, "a"), (-1, "a", 3)],
)
def test_addresses_are_independent(other: tuple[int, str, int]) -> None:
    n = 200_000
    first, second = normals((n,), 0, "a", 3), normals((n,), *other)
    assert abs(np.corrcoef(first, second)[0, 1]) < 4 / np.sqrt(n)


def test_deep_quantiles_are_the_inverse_normal() -> None:
    p = np.exp(np.random.default_rng(0).uniform(-82 * np.log(2), np.log(REFINED / CELLS), 10_000))
    p[:3] = 2.0**-82, np.nextafter(REFINED / CELLS, 0), REFINED / CELLS
    np.testing.assert_allclose(deep_quantile(p), special.ndtri(p), atol=6e-7, rtol=0)
    assert deep_quantile(p[0]).shape == ()


def test_quantile_is_the_inverse_normal() -> None:
    p = np.concatenate([np.geomspace(1e-30, 0.5, 3001), 1 - np.geomspace(1e-12, 0.4, 1001)])
    np.testing.assert_allclose(normal_quantile(p), special.ndtri(p), rtol=2e-15, atol=1e-16)


def test_the_table_with_its_true_tails_has_variance_one() -> None:
    edge = stats.norm.isf(REFINED / CELLS)
    tails = 2 * (REFINED / CELLS) * (1 + edge * stats.norm.pdf(edge) / stats.norm.sf(edge))
    means = cell_means().astype(np.float64)
    assert np.sum(means[REFINED:-REFINED] ** 2) / CELLS + tails == pytest.approx(1, abs=5e-7)  # words are rounded
    assert np.sum(means) == 0
    assert np.all(np.diff(means) >= 0)


def test_a_cell_is_represented_by_its_mean() -> None:
    for cell in (REFINED, 1000, 40_000, CELLS - 1 - REFINED):
        mean = stats.norm.expect(lambda x: x, lb=stats.norm.ppf(cell / CELLS), ub=stats.norm.ppf((cell + 1) / CELLS))
        assert cell_means()[cell] == pytest.approx(mean * CELLS, abs=2**-14 + 1e-5)  # half a unit, and polynomials


def test_moments_and_tails() -> None:
    """50 million draws; every figure within 4.5 standard errors of the normal law's."""
    frames, shape = 100, (500, 1000)
    n = frames * shape[0] * shape[1]
    levels = (3.0, 4.0, 4.5, 5.0)
    powers, above, below = np.zeros(4), np.zeros(len(levels)), np.zeros(len(levels))
    values = np.empty(shape, np.float32)
    for frame in range(frames):
        normals(shape, 11, "moments", frame, out=values)
        square = values * values
        powers += [x.sum(dtype=np.float64) for x in (values, square, square * values, square * square)]
        outer = values[square > 9]
        above += [np.count_nonzero(outer > level) for level in levels]
        below += [np.count_nonzero(outer < -level) for level in levels]
    # Standard errors from the normal's moments: Var x = 1, Var x^2 = 2, Var x^3 = 15, Var x^4 = 96.
    off = (powers / n - [0, 1, 0, 3]) / np.sqrt(np.array([1, 2, 15, 96]) / n)
    assert np.all(np.abs(off) < 4.5), off
    expected = n * stats.norm.sf(levels)  # 67495, 1584, 170 and 14 on either side
    for found in (above, below):
        assert np.all(np.abs(found - expected) < 4.5 * np.sqrt(expected)), (found, expected)


def test_distribution_is_normal() -> None:
    assert stats.kstest(normals((1_000_000,), 3, "ks"), "norm").pvalue > 0.001


def test_neighbouring_pixels_are_independent() -> None:
    values = normals((512, 640), 4, "neighbours").astype(np.float64)
    for rows, columns in ((0, 1), (0, 2), (0, 3), (0, 4), (1, 0), (1, 1), (2, 0)):
        a = values[rows:, columns:]
        b = values[: values.shape[0] - rows, : values.shape[1] - columns]
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 4.5 / np.sqrt(a.size)


@pytest.mark.parametrize("shape", [(5, 7), (11,), (2, 3, 4), (1, 1), (0,), (3, 0)])
def test_shapes_and_out(shape: tuple[int, ...]) -> None:
    values = normals(shape, 9, "out")
    assert values.shape == shape
    assert values.dtype == np.float32
    out = np.empty(shape, np.float32)
    assert normals(shape, 9, "out", out=out) is out
    np.testing.assert_array_equal(out, values)
    np.testing.assert_array_equal(values.ravel(), normals((values.size,), 9, "out"))


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_opencv_and_numpy_look_up_alike(kind: type, monkeypatch: pytest.MonkeyPatch) -> None:
    words = bit_generator(1, "words").random_raw(1000).view(np.uint16).reshape(40, 100)
    table: npt.NDArray[Any] = (np.arange(65_536) % 251).astype(kind)
    found = []
    for cv2_takes_16_bits in {rng._CV2_TAKES_16_BITS, False}:
        monkeypatch.setattr(rng, "_CV2_TAKES_16_BITS", cv2_takes_16_bits)
        found.append(rng.lookup(table, words))
    for values in found:
        assert values.dtype == kind
        np.testing.assert_array_equal(values, table[words])
