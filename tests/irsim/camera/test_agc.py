"""AGCs: the contract of every kind, linear and plateau curves beside their formulas, CLAHE and unsharp masking."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from pydantic import ValidationError

from irsim.camera import AGCS, CURVES
from irsim.camera.agc import MID_GREY, Agc, Fixed, Linear, Plain, Plateau
from irsim.camera.agc_local import Clahe, Unsharp

Counts = npt.NDArray[np.uint16]


def scene(bits: int = 14, shape: tuple[int, int] = (120, 160)) -> Counts:
    """Return a slope, noise and one hot spot."""
    rng = np.random.default_rng(1)
    full = 2**bits - 1
    counts = rng.normal(np.linspace(0.3, 0.5, shape[1]) * full, 0.01 * full, shape)
    counts[50:53, 70:73] = 0.97 * full
    return np.clip(np.rint(counts), 0, full).astype(np.uint16)


def noisy() -> Counts:
    """Return a slope of 400 counts, noise, and one spot 3000 counts above."""
    counts = np.random.default_rng(1).normal(np.linspace(5000, 5400, 128), 40.0, (96, 128))
    counts[20:24, 30:34] += 3000
    return np.clip(np.rint(counts), 0, 16_383).astype(np.uint16)


def build(word: str) -> Agc:
    found = AGCS.parse({"kind": word})
    assert isinstance(found, Agc)
    return found


# Every kind


@pytest.mark.parametrize("word", AGCS.kinds)
@pytest.mark.parametrize("bits", [8, 14, 16])
def test_a_picture_has_eight_bits_and_the_same_shape(word: str, bits: int) -> None:
    counts = scene(bits)
    counts.flags.writeable = False
    before = counts.copy()
    picture = build(word).display(counts, bits)
    assert picture.dtype == np.uint8
    assert picture.shape == counts.shape
    np.testing.assert_array_equal(counts, before)
    np.testing.assert_array_equal(picture, build(word).display(counts, bits))


@pytest.mark.parametrize("word", AGCS.kinds)
def test_odd_counts_and_small_pictures(word: str) -> None:
    """uint8 as uint16; counts beyond their depth are white; no memory shared with the counts; the smallest sizes."""
    agc, eight = build(word), scene(8)
    as_bytes = eight.astype(np.uint8)
    np.testing.assert_array_equal(agc.display(as_bytes, 8), agc.display(eight, 8))
    assert not np.shares_memory(agc.display(as_bytes, 8), as_bytes)
    eight[0, 0] = 5000
    assert agc.display(eight, 8)[0, 0] == 255
    for shape in ((1, 1), (1, 9), (7, 3)):
        assert agc.display(np.arange(np.prod(shape), dtype=np.uint16).reshape(shape), 8).shape == shape


@pytest.mark.parametrize("word", AGCS.kinds)
def test_a_constant_frame_has_one_grey_level(word: str) -> None:
    for count in (0, 6000, 16_383):
        assert np.ptp(build(word).display(np.full((20, 30), count, np.uint16), 14)) == 0


@pytest.mark.parametrize("word", CURVES.kinds)
def test_curves_are_monotonic(word: str) -> None:
    counts = scene()
    order = np.argsort(counts, axis=None)
    assert (np.diff(build(word).display(counts, 14).ravel()[order].astype(int)) >= 0).all()


# Linear, fixed and none


@pytest.mark.parametrize(("tails", "bits"), [((0.005, 0.005), 14), ((0.0, 0.0), 8), ((0.1, 0.02), 16)])
def test_linear_stretches_between_quantiles(tails: tuple[float, float], bits: int) -> None:
    counts = scene(bits, (97, 131))  # shares of 12,707 pixels are no whole numbers
    low, high = np.quantile(counts, [tails[0], 1 - tails[1]], method="inverted_cdf").astype(float)
    expected = np.clip((counts - low) / (high - low) * 255, 0, 255)
    np.testing.assert_allclose(Linear(tails=tails).display(counts, bits), expected, atol=0.5 + 1e-9)


def test_linear_of_flat_frames() -> None:
    """Constant frames are mid-grey; fewer outliers than the tails are black and white; gain and offset cancel."""
    assert (Linear().display(np.full((20, 30), 777, np.uint16), 14) == MID_GREY).all()
    counts = np.full((100, 100), 500, np.uint16)
    counts[3, 4], counts[5, 6] = 510, 490
    picture = Linear().display(counts, 14)
    assert (picture[3, 4], picture[5, 6], picture[0, 0]) == (255, 0, MID_GREY)
    twelve = scene(12)
    np.testing.assert_array_equal(Linear().display(twelve, 12), Linear().display(3 * twelve + 1000, 14))


def test_fixed_and_plain_curves() -> None:
    counts = np.array([[0, 999, 1000, 1500, 2000, 2001, 16383]], np.uint16)
    found = Fixed(low=1000, high=2000).display(counts, 14)
    np.testing.assert_array_equal(found, [[0, 0, 0, 128, 255, 255, 255]])  # 127.5 rounds to even
    for bits in (8, 14, 16):
        full = 2**bits - 1
        np.testing.assert_array_equal(
            Fixed().display(np.array([[0, full // 5, full]], np.uint16), bits), [[0, 51, 255]]
        )
    assert not Fixed(low=300).display(scene(8), 8).any()
    eight = np.arange(256, dtype=np.uint8).reshape(16, 16)
    np.testing.assert_array_equal(Plain().display(eight, 8), eight)
    np.testing.assert_array_equal(Plain().display(np.array([[0, 63, 64, 16383]], np.uint16), 14), [[0, 0, 1, 255]])


@pytest.mark.parametrize(
    ("kind", "keys"),
    [
        (Linear, {"tails": (-0.1, 0.0)}),
        (Linear, {"tails": (0.0, 0.5)}),
        (Linear, {"tails": (0.1,)}),
        (Fixed, {"low": 5, "high": 5}),
        (Fixed, {"low": -1}),
        (Fixed, {"high": 70_000}),
        (Clahe, {"base": {"kind": "unsharp"}}),
    ],
)
def test_wrong_keys_are_refused(kind: type[Agc], keys: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        kind.model_validate(keys)


# Plateau equalisation


def test_plateau_curve_by_hand() -> None:
    """6 pixels of count 10, 3 of 12, 1 of 20; a plateau of 2: they weigh 2, 2, 1, and 2 : 1 without the darkest.

    With no step above 100: 0, 100, 185, and of the 70 left half are dark.
    """
    counts = np.array([[10] * 6 + [12] * 3 + [20]], np.uint16)
    unlimited = Plateau(plateau=0.2, gain_limit=None).display(counts, 8)
    np.testing.assert_array_equal(unlimited, [[0] * 6 + [170] * 3 + [255]])
    limited = Plateau(plateau=0.2, gain_limit=100).display(counts, 8)
    np.testing.assert_array_equal(limited, [[35] * 6 + [135] * 3 + [220]])


def test_plateau_of_one_is_histogram_equalisation() -> None:
    """OpenCV's equalizeHist has the same formula, from the darkest count that occurs."""
    eight = (noisy() >> 6).astype(np.uint8)
    picture = Plateau(plateau=1, gain_limit=None).display(eight, 8)
    np.testing.assert_allclose(picture.astype(int), cv2.equalizeHist(eight).astype(int), atol=1)


def test_the_gain_limit_keeps_even_scenes_even() -> None:
    assert (Plateau().display(np.full((20, 30), 777, np.uint16), 14) == MID_GREY).all()
    counts = np.rint(np.random.default_rng(2).normal(5000, 3, (96, 128))).astype(np.uint16)
    limited = Plateau(gain_limit=1).display(counts, 14).astype(float)
    assert limited.std() == pytest.approx(counts.std(), rel=0.05)  # a grey level per count
    assert Plateau(gain_limit=None).display(counts, 14).std() > 10 * counts.std()


@pytest.mark.parametrize(("plateau", "gain"), [(1e-6, None), (0.01, 0.001), (0.3, 2.0), (1.0, 255.0)])
def test_plateau_curves_rise_within_their_gain(plateau: float, gain: float | None) -> None:
    agc = Plateau(plateau=plateau, gain_limit=gain)
    for counts in (scene(12), np.random.default_rng(3).integers(0, 4096, (6, 7)).astype(np.uint16)):
        steps = np.diff(agc.curve(agc.statistics(counts, 12), 12)[:4096].astype(int))
        assert (steps >= 0).all()
        assert (steps <= (255 if gain is None else gain) + 1).all()  # 1: grey levels are whole


# CLAHE and unsharp masking


@pytest.mark.parametrize("base", [Linear(), Plateau(), Fixed(low=4800, high=8500)])
def test_local_contrast_of_zero_is_the_base(base: Agc) -> None:
    counts = noisy()
    expected = base.display(counts, 14)
    np.testing.assert_array_equal(Clahe(base=base, clip_limit=0).display(counts, 14), expected)
    np.testing.assert_array_equal(Unsharp(base=base, amount=0).display(counts, 14), expected)
    assert Clahe(base=base).fixed_range(14) == Unsharp(base=base).fixed_range(14) == base.fixed_range(14)


@pytest.mark.parametrize(("amount", "sigma_px"), [(2.0, 3.0)])
def test_unsharp_amplifies_a_wave_by_its_formula(amount: float, sigma_px: float) -> None:
    """A Gaussian passes exp(-(sigma k)² / 2) of a wave of k rad/px: the wave is amplified by 1 + amount (1 - that)."""
    k, x = 2 * np.pi / 16, np.arange(256)
    counts = np.repeat(np.rint(8000 + 1000 * np.sin(k * x))[np.newaxis], 64, axis=0).astype(np.uint16)
    sharp = Unsharp(amount=amount, sigma_px=sigma_px).preprocess(counts, 14)
    found = sharp[32, 64:192] - 8000.0  # whole waves, far from the edges
    height = 2 * np.mean(found * np.sin(k * x[64:192]))
    assert height / 1000 == pytest.approx(1 + amount * (1 - np.exp(-((sigma_px * k) ** 2) / 2)), rel=0.01)
