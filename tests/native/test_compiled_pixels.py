"""Compiled loops over pixels give what the plain ones give."""

from __future__ import annotations

import math
from dataclasses import replace

import even_noise
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from irsim import rng
from irsim._native import COMPILED, kernels
from irsim.backgrounds import ViewDirection, blend_over, cloud_evolution, clouds
from irsim.backgrounds.base import apply_air
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.cloud_drift import EvolvingCloud, integer_weights
from irsim.backgrounds.cloud_evolution import CloudState
from irsim.backgrounds.clouds import CloudShading
from irsim.camera import agc, ar1, response
from irsim.camera import noise as noise_module
from irsim.camera.ar1 import Ar1
from irsim.camera.buffers import Int16Image, int16_image
from irsim.camera.noise import Noise3d, Shot, White
from irsim.camera.noise_base import FrameContext, Noise
from irsim.camera.response import MAX_ADDED
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.geometry.projection import Geometry

FIELDS = cloud_evolution.EvolvingFields(64, 3.0, None, 20.0, 1.0, 1, "fields")

pytestmark = pytest.mark.skipif(not COMPILED, reason="there is no compiler here")


@settings(max_examples=30)
@given(length=st.integers(0, 10_000), seed=st.integers(-(2**70), 2**70))
@example(length=1_000_001, seed=1)
def test_drawn_normals_equal_the_plain_ones(length: int, seed: int) -> None:
    """The example has each of the 65,536 words."""
    found = np.zeros(length, np.float32)
    kernels.add_normals(*rng.kernel_arguments(seed, "a", 3), found, 1.0)
    np.testing.assert_array_equal(found, rng.normals((length,), seed, "a", 3), strict=True)


RESPONSE = ElectronSensor().response(SensorSettings("mwir", 14, 20.0, (250.0, 350.0)))
NOISES = [
    White(ratio=2.5),
    Shot(),
    Ar1(rho=0.9),
    Ar1(rho=0.5, over="row"),
    Noise3d(t=0.2, tv=0.3, th=0.1, tvh=0.7),
    Noise3d(th=0.5),
    Noise3d(),
]


@settings(max_examples=60)
@given(rows=st.integers(1, 90), columns=st.integers(1, 90), index=st.integers(0, 10**6), noise=st.sampled_from(NOISES))
@example(rows=120, columns=160, index=77, noise=NOISES[1])
@example(rows=120, columns=160, index=76, noise=NOISES[2])
def test_noise_added_while_drawn_is_that_of_passes(rows: int, columns: int, index: int, noise: Noise) -> None:
    """To an ulp of what is added up."""
    light = np.random.default_rng(index).uniform(-1e3, 1.1 * RESPONSE.well, (rows, columns)).astype(np.float32)
    light.reshape(-1)[index % 7 :: 1501] = 150.0  # electrons, as in the dark
    found = []
    for compiled in (True, False):
        ar1._process.cache_clear()
        with pytest.MonkeyPatch.context() as patch:
            for module in (ar1, noise_module):
                patch.setattr(module, "COMPILED", compiled)
            found.append(np.minimum(light, np.float32(RESPONSE.well)))
            frame_context = FrameContext(index, (rows, columns), 50.0, 1)
            even_noise.add(noise, found[-1], frame_context, RESPONSE)
    np.testing.assert_allclose(found[0], found[1], rtol=3e-7, atol=2e-3)


def test_states_are_clipped_to_16_bits() -> None:
    far, spread = np.full((3, 1000), 32_700, np.int16), 64.0  # beyond it in one number of seven
    drawn = rng.normals(far.shape, 1, "far")
    found = np.empty_like(far)
    kernels.bridge(*rng.kernel_arguments(1, "far"), far, far, 0.5, spread, found)
    np.testing.assert_array_equal(found, np.clip(np.rint(32_700 + spread * drawn), -(2**15), 2**15 - 1))
    assert (found == 2**15 - 1).any()
    kernels.bridge(*rng.kernel_arguments(1, "far"), -far, -far, 0.5, spread, found)
    np.testing.assert_array_equal(found, np.clip(np.rint(-32_700 + spread * drawn), -(2**15), 2**15 - 1))


def drifting(side: int, seed: int) -> EvolvingCloud:
    def state_at(place: float) -> CloudState:
        drawn = rng.stream(seed, round(place * 1000)).random((2, side, side)).astype(np.float32)
        return CloudState(side, 1.0, lambda rows, columns: (drawn[0, rows, columns], drawn[1, rows, columns]))

    return EvolvingCloud("cloud", 1000.0, state_at, 5.0, (3.3, -0.7))


@settings(max_examples=12)
@given(
    size=st.tuples(st.integers(2, 90), st.integers(2, 90)),
    seed=st.integers(0, 5),
    times=st.lists(st.floats(0, 1e4), min_size=1, max_size=4),
)
@example(size=(640, 512), seed=1, times=[3.77])
def test_a_veil_is_laid_as_by_passes(size: tuple[int, int], seed: int, times: list[float]) -> None:
    side = 1024 if max(size) > 128 else 128
    layer, plain = drifting(side, seed), drifting(side, seed)
    geometry = Geometry(size, 1e-4, 0.3)
    for time in times:
        view_direction = ViewDirection(
            time, Chart.at(geometry, geometry.world_rotation(np.array([time * 1e-6, 0.0, 0.0])))
        )
        under, wanted = (np.full(size[::-1], 2.5, np.float32) for _ in range(2))
        found = np.empty_like(under)
        patch = slice(size[1] // 3, size[1]), slice(size[0] // 2, size[0] - 1)
        passed, (transmittance, emission) = (
            layer.blend(under, found, view_direction, [patch]),
            plain.light(view_direction),
        )
        layer.blend(under, under, view_direction, [])
        np.testing.assert_array_equal(under, found)
        blend_over(wanted, wanted, transmittance, emission, [])
        np.testing.assert_allclose(passed[0], transmittance[patch], rtol=0, atol=1e-6)
        np.testing.assert_allclose(found, wanted, rtol=0, atol=4e-6)
        tau, path = rng.stream(seed, 7).random((2, *size[::-1])).astype(np.float32)
        layer.blend(under := np.full_like(wanted, 2.5), under, view_direction, [], (tau, path))
        blend_over(
            np.full_like(wanted, 2.5), wanted, transmittance, apply_air(transmittance, emission, (tau, path)), []
        )
        np.testing.assert_allclose(under, wanted, rtol=0, atol=6e-6)


@pytest.mark.parametrize("time", [0.0, 3.77])
def test_a_changing_layer_is_between_its_states(time: float) -> None:
    """Against plain sums in float64. Shares are rounded to 1/32768: what states differ by, here by all that they may,
    is off by as much at most, and by half a unit of words."""
    layer, (columns, rows) = drifting(128, 1), (90, 61)
    geometry = Geometry((columns, rows), 1e-4, 0.3)
    view_direction = ViewDirection(time, Chart.at(geometry, geometry.world_rotation(np.zeros(3))))
    step, share = divmod(time / 5.0 * cloud_evolution.STEPS, 1)
    x, y = -(columns - 1) / 2 - 3.3 * time, -(rows - 1) / 2 + 0.7 * time
    early, late = (
        layer.state_at((step + k) / cloud_evolution.STEPS).paint(slice(0, 128), slice(0, 128)) for k in (0, 1)
    )
    for seen, before, after in zip(layer.light(view_direction), early, late, strict=True):
        mixed = (1 - share) * before.astype(float) + share * after.astype(float)
        (left, right), (top, down) = (divmod(place, 1) for place in (x, y))
        at = np.ix_((int(top) + np.arange(rows + 1)) % 128, (int(left) + np.arange(columns + 1)) % 128)
        across = (1 - right) * mixed[at][:, :-1] + right * mixed[at][:, 1:]
        np.testing.assert_allclose(seen, (1 - down) * across[:-1] + down * across[1:], rtol=0, atol=2 / 32768)


@settings(max_examples=30)
@given(
    place=st.floats(0, 9),
    rows=st.tuples(st.integers(-70, 70), st.integers(1, 150)),
    columns=st.tuples(st.integers(-70, 70), st.integers(1, 150)),
)
def test_fields_are_mixed_as_by_passes(place: float, rows: tuple[int, int], columns: tuple[int, int]) -> None:
    """Also where a part reaches over all of the period."""
    mixture = FIELDS.at(place)
    part = [slice(first, first + length) for first, length in (rows, columns)]
    found = mixture.over(*part)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(cloud_evolution, "COMPILED", False)
        for field, plain in zip(found, mixture.over(*part), strict=True):
            np.testing.assert_array_equal(field, plain, strict=True)


@settings(max_examples=30)
@given(
    size=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    seed=st.integers(0, 2**32 - 1),
    edge=st.floats(-3, 3),
    depth=st.sampled_from([0.0, 1e-3, 3.0, 1e6]),
    sunlit_k=st.sampled_from([None, 0.0, 8.0]),
)
@example((30, 40), 0, 0.3, 3.0, 8.0)
def test_clouds_are_painted_as_by_passes(
    size: tuple[int, int], seed: int, edge: float, depth: float, sunlit_k: float | None
) -> None:
    """The exponential's own error is 2e-7; warmth is beyond the table now and then."""
    look = CloudShading.of(edge, depth, (268.0, 2.0, sunlit_k or 0.0), "mwir")
    draws = np.random.default_rng(seed)
    thickness, warmth = (3 * draws.standard_normal((2, *size))).astype(np.float32)
    lit = None if sunlit_k is None else draws.random(size).astype(np.float32)
    painted = look.paint(thickness, warmth, lit)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(clouds, "COMPILED", False)
        for field, plain in zip(painted, look.paint(thickness, warmth, lit), strict=True):
            np.testing.assert_allclose(field, plain, rtol=0, atol=5e-7 * max(look.brightest, 1.0), strict=True)


@pytest.mark.parametrize("word", [-32768, -1, 32767])
def test_an_even_veil_is_its_words_at_any_place(word: int) -> None:
    """To the last digit but one, and where nothing passes nothing does."""
    state, under = np.full((4, 30), word, np.int16), np.ones((3, 29), np.float32)
    for late, right, down in rng.stream(3, 1).random((50, 3)):
        shares = integer_weights(late, right)
        assert sum(shares) == 32768
        assert min(shares) >= 0
        kernels.veil(under, *shares, down, 1 / 65535, 0.0, light := np.empty_like(under), state, state, state, state)
        assert np.ptp(light) == 0
        assert light[0, 0] == pytest.approx((word + 32768) / 65535, rel=3e-7, abs=0)


@settings(max_examples=60)
@given(
    values=st.lists(
        st.floats(-1e9, 1e9, width=32, allow_subnormal=False) | st.sampled_from([0.0, 214.0, 642.0]),
        min_size=1,
        max_size=99,
    ),
    gain=st.sampled_from([428.0, 0.5, 1.0]),
    bits=st.sampled_from([8, 14, 16]),
    offset=st.sampled_from([0.0, 100.0]),
    added=st.integers(0, MAX_ADDED + 2),
    rows=st.integers(0, 3),
)
def test_counts_are_those_of_passes(
    values: list[float], gain: float, bits: int, offset: float, added: int, rows: int
) -> None:
    """Of any number of patterns, and of as many rows with lines' own noise, or of one without."""
    detector = replace(RESPONSE, gain=gain, full=2**bits - 1, offset=offset)
    signal = np.array([values] * max(rows, 1), np.float32)
    patterns = [Int16Image(int16_image(np.roll(signal, k)).values, 0.3 * k) for k in range(added)]
    lines = (7 * gain * np.arange(rows, dtype=np.float32), signal[0] / np.float32(3e3)) if rows else None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(response, "COMPILED", False)
        wanted = detector.counts(signal.copy(), None, patterns, lines)
    np.testing.assert_array_equal(detector.counts(signal.copy(), None, patterns, lines), wanted, strict=True)
    for odd in (0, 1):  # of memory where sixteen counts begin, and where they do not
        out = np.empty(wanted.size + odd, np.uint16)[odd:].reshape(wanted.shape)
        assert detector.counts(signal.copy(), out, patterns, lines) is out
        np.testing.assert_array_equal(out, wanted, strict=True)


def test_a_signal_of_nan_is_count_0() -> None:
    assert RESPONSE.counts(np.full((2, 20), np.nan, np.float32)).max() == 0


@settings(max_examples=60)
@given(
    values=st.lists(st.floats(-0.125, 1e6, width=32, allow_subnormal=False), min_size=1, max_size=99),
    root=st.sampled_from([0.0, RESPONSE.root]),
    zero=st.sampled_from([0.0, 1e4]),
    gaining=st.booleans(),
    most=st.sampled_from([math.inf, 1e6]),
)
def test_the_signal_is_that_of_passes(
    values: list[float], root: float, zero: float, gaining: bool, most: float
) -> None:
    light = np.array([values], np.float32)
    detector, gain = replace(RESPONSE, root=root, zero=zero), int16_image(np.cos(light) / 10) if gaining else None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(response, "COMPILED", False)
        wanted = detector.signal(light, None, gain, most)
    found = detector.signal(light, None, gain, most)
    np.testing.assert_allclose(found, wanted, rtol=4.8e-7, atol=1e-3 if zero else 0)
    assert found.max() <= most
    if gain is not None and most == math.inf and zero == 0:
        plain = detector.signal(light)
        np.testing.assert_allclose(found, plain * (1 + gain.to_float()), rtol=4.8e-7)


def test_dark_signal_has_no_gain_and_the_well_limits() -> None:
    detector = replace(RESPONSE, root=0.0, linear=2.0, zero=100.0)
    light, gain = np.array([[0.0, 50.0, 500.0]], np.float32), Int16Image(np.full((1, 3), 2, np.int16), 0.25)
    np.testing.assert_array_equal(detector.signal(light, gain=gain), [[100, 250, 1600]])
    np.testing.assert_array_equal(detector.signal(light, gain=gain, most=300.0), [[100, 250, 300]])


@settings(max_examples=40)
@given(
    rows=st.integers(0, 40),
    columns=st.integers(0, 40),
    bits=st.sampled_from([8, 14, 16]),
    deepest=st.integers(0, 2**16 - 1),
    seed=st.integers(0, 99),
)
@example(rows=99, columns=333, bits=14, deepest=0, seed=1)
def test_a_histogram_is_that_of_numpy(rows: int, columns: int, bits: int, deepest: int, seed: int) -> None:
    """Of counts within their depth and beyond it, and of every other column of a picture."""
    counts = np.random.default_rng(seed).integers(0, deepest, (rows, columns), np.uint16, endpoint=True)
    for each in (counts, counts[:, ::2]):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(agc, "COMPILED", False)
            wanted = agc.histogram(each, bits)
        np.testing.assert_array_equal(agc.histogram(each, bits), wanted, strict=True)
