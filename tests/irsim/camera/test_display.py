"""Counts to 8 bits."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from pydantic import ValidationError

from irsim.camera import AGCS, CURVES
from irsim.camera.agc import MID_GREY, Agc, Fixed, Linear, Plain


def scene(bits: int = 14, shape: tuple[int, int] = (120, 160)) -> npt.NDArray[np.uint16]:
    """A slope, noise and one hot spot."""
    rng = np.random.default_rng(1)
    full = 2**bits - 1
    counts = rng.normal(np.linspace(0.3, 0.5, shape[1]) * full, 0.01 * full, shape)
    counts[50:53, 70:73] = 0.97 * full
    return np.clip(np.rint(counts), 0, full).astype(np.uint16)


def build(word: str) -> Agc:
    found = AGCS.parse({"kind": word})
    assert isinstance(found, Agc)
    return found


# Every kind of AGC


@pytest.mark.parametrize("word", AGCS.kinds)
@pytest.mark.parametrize("bits", [8, 12, 14, 16])
def test_a_picture_is_eight_bits_of_the_same_shape_and_pure(word: str, bits: int) -> None:
    counts = scene(bits)
    counts.flags.writeable = False
    before = counts.copy()
    picture = build(word).display(counts, bits)
    assert picture.dtype == np.uint8
    assert picture.shape == counts.shape
    np.testing.assert_array_equal(counts, before)
    np.testing.assert_array_equal(picture, build(word).display(counts, bits))


@pytest.mark.parametrize("word", AGCS.kinds)
def test_eight_bit_counts_may_be_uint8_or_uint16(word: str) -> None:
    counts = scene(8)
    picture = build(word).display(counts.astype(np.uint8), 8)
    assert picture.dtype == np.uint8
    np.testing.assert_array_equal(picture, build(word).display(counts, 8))


@pytest.mark.parametrize("word", AGCS.kinds)
def test_a_picture_is_not_its_counts(word: str) -> None:
    counts = scene(8).astype(np.uint8)
    assert not np.shares_memory(build(word).display(counts, 8), counts)


@pytest.mark.parametrize("word", AGCS.kinds)
@pytest.mark.parametrize("bits", [8, 14, 16])
@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_constant_frame_is_one_grey(word: str, bits: int, share: float) -> None:
    counts = np.full((20, 30), round(share * (2**bits - 1)), np.uint16)
    picture = build(word).display(counts, bits)
    assert np.ptp(picture) == 0


@pytest.mark.parametrize("word", CURVES.kinds)
def test_brighter_is_never_darker(word: str) -> None:
    counts = scene()
    order = np.argsort(counts, axis=None)
    assert (np.diff(build(word).display(counts, 14).ravel()[order].astype(int)) >= 0).all()


# Linear


@pytest.mark.parametrize("tails", [(0.005, 0.005), (0.0, 0.0), (0.1, 0.02), (0.0, 0.3)])
@pytest.mark.parametrize("bits", [8, 14, 16])
def test_linear_stretches_between_quantiles(tails: tuple[float, float], bits: int) -> None:
    counts = scene(bits, (97, 131))  # shares of 12,707 pixels are no whole numbers
    low, high = np.quantile(counts, [tails[0], 1 - tails[1]], method="inverted_cdf").astype(float)
    expected = np.clip((counts - low) / (high - low) * 255, 0, 255)
    np.testing.assert_allclose(Linear(tails=tails).display(counts, bits), expected, atol=0.5 + 1e-9)


def test_linear_rejects_at_most_its_tails() -> None:
    counts = np.arange(1000, dtype=np.uint16).reshape(20, 50)
    picture = Linear(tails=(0.01, 0.02)).display(counts, 14)
    # 10 pixels below count 10 and 20 above count 979.
    assert np.flatnonzero(picture.ravel() == 0).max() == 11  # 10, and 11 by rounding: 1/969 of 255 is 0.26
    assert picture.ravel()[[10, 979]].tolist() == [0, 255]
    assert picture.ravel()[12] == 1
    assert picture.ravel()[977] == 254


def test_linear_shows_a_constant_frame_mid_grey() -> None:
    assert (Linear().display(np.full((20, 30), 777, np.uint16), 14) == MID_GREY).all()


def test_linear_keeps_few_odd_pixels_of_a_flat_frame_apart() -> None:
    counts = np.full((100, 100), 500, np.uint16)
    counts[3, 4], counts[5, 6] = 510, 490  # fewer than the tails
    picture = Linear().display(counts, 14)
    assert (picture[3, 4], picture[5, 6], picture[0, 0]) == (255, 0, MID_GREY)


def test_linear_is_blind_to_gain_and_offset() -> None:
    counts = scene(12)
    np.testing.assert_array_equal(Linear().display(counts, 12), Linear().display(3 * counts + 1000, 14))


@pytest.mark.parametrize("tails", [(-0.1, 0.0), (0.0, 0.5), (0.1,)])
def test_linear_refuses_bad_tails(tails: tuple[float, ...]) -> None:
    with pytest.raises(ValidationError):
        Linear.model_validate({"tails": tails})


# Fixed and none


def test_fixed_maps_its_two_counts_to_black_and_white() -> None:
    counts = np.array([[0, 999, 1000, 1500, 2000, 2001, 16383]], np.uint16)
    found = Fixed(low=1000, high=2000).display(counts, 14)
    np.testing.assert_array_equal(found, [[0, 0, 0, 128, 255, 255, 255]])  # 127.5 rounds to even


def test_fixed_takes_the_full_depth_by_default() -> None:
    for bits in (8, 14, 16):
        full = 2**bits - 1
        counts = np.array([[0, full // 5, full]], np.uint16)
        np.testing.assert_array_equal(Fixed().display(counts, bits), [[0, 51, 255]])


def test_fixed_from_beyond_the_depth_is_black() -> None:
    assert not Fixed(low=300).display(scene(8), 8).any()


@pytest.mark.parametrize("fields", [{"low": 5, "high": 5}, {"low": -1}, {"high": 70_000}])
def test_fixed_refuses_counts_that_do_not_rise(fields: dict[str, int]) -> None:
    with pytest.raises(ValidationError):
        Fixed.model_validate(fields)


def test_none_shows_eight_bits_as_they_are_and_the_top_of_more() -> None:
    counts = np.arange(256, dtype=np.uint8).reshape(16, 16)
    np.testing.assert_array_equal(Plain().display(counts, 8), counts)
    deep = np.array([[0, 63, 64, 16383]], np.uint16)
    np.testing.assert_array_equal(Plain().display(deep, 14), [[0, 0, 1, 255]])


@pytest.mark.parametrize("word", AGCS.kinds)
def test_counts_beyond_their_depth_are_white(word: str) -> None:
    counts = scene(8)
    counts[0, 0] = 5000
    assert build(word).display(counts, 8)[0, 0] == 255
