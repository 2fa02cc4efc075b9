"""Plateau equalisation, CLAHE and unsharp masking beside their formulas."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pydantic import ValidationError

from irsim.camera import AGCS
from irsim.camera.agc import MID_GREY, Agc, Fixed, Linear, Plateau
from irsim.camera.agc_local import Clahe, Unsharp

Counts = npt.NDArray[np.uint16]


def noisy(seed: int = 1, spread: float = 40.0, shape: tuple[int, int] = (96, 128)) -> Counts:
    """A slope of 400 counts, noise, and one spot 3000 counts above."""
    rng = np.random.default_rng(seed)
    counts = rng.normal(np.linspace(5000, 5400, shape[1]), spread, shape)
    counts[20:24, 30:34] += 3000
    return np.clip(np.rint(counts), 0, 16_383).astype(np.uint16)


# Plateau


def test_plateau_curve_by_hand() -> None:
    # 6 pixels of count 10, 3 of 12, 1 of 20; a plateau of 2: they weigh 2, 2, 1. The darkest begins the
    # curve, so the others share 255 as 2 : 1.
    counts = np.array([[10] * 6 + [12] * 3 + [20]], np.uint16)
    picture = Plateau(plateau=0.2, gain_limit=None).display(counts, 8)
    np.testing.assert_array_equal(picture, [[0] * 6 + [170] * 3 + [255]])


def test_plateau_gain_limit_by_hand() -> None:
    # The same, no step above 100: 0, 100, 185; what is missing to 255 is left half dark, half bright.
    counts = np.array([[10] * 6 + [12] * 3 + [20]], np.uint16)
    picture = Plateau(plateau=0.2, gain_limit=100).display(counts, 8)
    np.testing.assert_array_equal(picture, [[35] * 6 + [135] * 3 + [220]])


def test_plateau_of_one_is_histogram_equalisation() -> None:
    counts = noisy()
    eight = (counts >> 6).astype(np.uint8)
    picture = Plateau(plateau=1, gain_limit=None).display(eight, 8)
    # OpenCV's equalizeHist has the same formula, from the darkest count that there is.
    np.testing.assert_allclose(picture.astype(int), cv2.equalizeHist(eight).astype(int), atol=1)


def test_a_low_plateau_keeps_greys_for_the_few() -> None:
    """A spot of 16 pixels among 12,288 stands out against its surroundings more, the lower the plateau is."""
    counts = noisy()
    spot = [
        float(np.ptp(Plateau(plateau=plateau, gain_limit=None).display(counts, 14)[20:24, 30:34]))
        for plateau in (1.0, 0.001, 1e-6)
    ]
    assert spot[0] < spot[1] < spot[2]


def test_plateau_shows_a_constant_frame_mid_grey_and_an_even_one_evenly() -> None:
    assert (Plateau().display(np.full((20, 30), 777, np.uint16), 14) == MID_GREY).all()
    rng = np.random.default_rng(2)
    counts = np.rint(rng.normal(5000, 3, (96, 128))).astype(np.uint16)
    limited = Plateau(gain_limit=1).display(counts, 14).astype(float)
    assert limited.std() == pytest.approx(counts.std(), rel=0.05)  # a grey per count
    assert Plateau(gain_limit=None).display(counts, 14).std() > 10 * counts.std()


@given(
    arrays(np.uint16, (6, 7), elements=st.integers(0, 4095)),
    st.floats(1e-6, 1),
    st.one_of(st.none(), st.floats(0.001, 255)),
)
def test_plateau_never_falls_and_keeps_to_its_gain(counts: Counts, plateau: float, gain: float | None) -> None:
    agc = Plateau(plateau=plateau, gain_limit=gain)
    greys = agc.greys(agc.look(counts, 12), 12)[:4096].astype(int)
    steps = np.diff(greys)
    assert (steps >= 0).all()
    assert (steps <= (255 if gain is None else gain) + 1).all()  # 1: greys are whole


# CLAHE and unsharp masking


@pytest.mark.parametrize("base", [Linear(), Plateau(), Fixed(low=4800, high=8500)])
def test_off_they_are_their_base(base: Agc) -> None:
    counts = noisy()
    expected = base.display(counts, 14)
    np.testing.assert_array_equal(Clahe(base=base, clip_limit=0).display(counts, 14), expected)
    np.testing.assert_array_equal(Unsharp(base=base, amount=0).display(counts, 14), expected)


def test_clahe_of_one_tile_without_a_limit_is_histogram_equalisation() -> None:
    counts = noisy()
    base = Linear()
    found = Clahe(base=base, clip_limit=256, tiles=(1, 1)).display(counts, 14)
    flat = base.display(counts, 14)
    shares = np.cumsum(np.bincount(flat.ravel(), minlength=256)) / flat.size
    np.testing.assert_allclose(found, 255 * shares[flat], atol=1)


def test_clahe_raises_contrast_within_its_limit() -> None:
    """On a slow slope neighbours differ more, but no more than the limit times as much."""
    counts = np.repeat(np.linspace(4000, 8000, 512)[np.newaxis], 128, axis=0).astype(np.uint16)
    counts[:, ::2] += 60
    base = Fixed(low=0, high=16_383)
    before = np.diff(base.display(counts, 14).astype(float), axis=1)
    previous = np.abs(before).mean()
    for limit in (1.5, 3.0, 6.0):
        after = np.abs(np.diff(Clahe(base=base, clip_limit=limit).display(counts, 14).astype(float), axis=1)).mean()
        assert previous < after < (limit + 1) * np.abs(before).mean()
        previous = after


@pytest.mark.parametrize(("amount", "sigma_px"), [(0.5, 1.0), (2.0, 3.0)])
def test_unsharp_enlarges_a_wave_as_its_formula_says(amount: float, sigma_px: float) -> None:
    """A Gaussian passes exp(-(sigma k)^2 / 2) of a wave of k rad/px, so 1 + amount (1 - that) of it is left."""
    k = 2 * np.pi / 16
    x = np.arange(256)
    counts = np.repeat(np.rint(8000 + 1000 * np.sin(k * x))[np.newaxis], 64, axis=0).astype(np.uint16)
    sharp = Unsharp(amount=amount, sigma_px=sigma_px).before(counts, 14)
    found = sharp[32, 64:192] - 8000.0  # whole waves, far from the edges
    height = 2 * np.mean(found * np.sin(k * x[64:192]))
    assert height / 1000 == pytest.approx(1 + amount * (1 - np.exp(-((sigma_px * k) ** 2) / 2)), rel=0.01)


def test_unsharp_brings_out_detail_that_eight_bits_do_not_hold() -> None:
    """A pattern of 6 counts on a span of 8000 is under a fifth of a grey, until it is enlarged."""
    counts = np.full((64, 64), 5000, np.uint16)
    counts[::2] += 6
    counts[:, 40:] += 8000
    base = Fixed(low=5000, high=13_000)
    assert np.ptp(base.display(counts, 14)[:, :30]) == 0
    assert np.ptp(Unsharp(base=base, amount=20).display(counts, 14)[8:56, :20]) >= 2


@pytest.mark.parametrize("word", AGCS.kinds)
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (7, 3)])
def test_the_smallest_pictures(word: str, shape: tuple[int, int]) -> None:
    counts = np.arange(np.prod(shape), dtype=np.uint16).reshape(shape)
    agc = AGCS.parse({"kind": word})
    assert isinstance(agc, Agc)
    assert agc.display(counts, 8).shape == shape


def test_detail_stands_around_curves_and_nothing_stands_around_itself() -> None:
    nested = AGCS.parse({"kind": "unsharp", "base": {"kind": "clahe", "base": {"kind": "plateau"}}})
    assert isinstance(nested, Unsharp)
    with pytest.raises(ValidationError):
        Clahe.model_validate({"base": {"kind": "unsharp"}})
