"""Clouds: spectra, histograms, evolution, shading and sunlit edges."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from country import view_at

from irsim.backgrounds import is_semi_transparent
from irsim.backgrounds.cloud_evolution import (
    STEPS,
    EvolvingFields,
    first_of,
    units_of,
)
from irsim.backgrounds.clouds import ENTRIES, EXTREME, Clouds, CloudShading, slope_to_sun, sunlit_share
from irsim.backgrounds.texture import coarseness, enlarged, shrunk
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.random_fields import spectral
from irsim.physics.radiometry import radiance, slope
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.types import Floats


def context(size: tuple[int, int] = (160, 120), ifov_mrad: float = 0.5) -> SceneContext:
    return SceneContext(1, Geometry(size, ifov_mrad * 1e-3, math.radians(12.0)), 30.0, "mwir", 0.6)


def test_spectra_have_their_slopes_along_both_axes() -> None:
    """The 2-D power on each axis, over 4/N .. 0.2 cycles a px, averaged over seeds."""
    side, betas = 512, (2.7, 3.6)
    fields = (spectral((side, side), 0.0, betas, 1e4, 1.0, seed, "t") for seed in range(8))
    power = np.mean([np.abs(np.fft.fft2(field)) ** 2 for field in fields], axis=0)
    frequency = np.arange(4, side // 5) / side
    for line, beta in zip((power[0], power[:, 0]), betas, strict=True):
        slope = np.polyfit(np.log(frequency), np.log(line[4 : side // 5]), 1)[0]
        assert slope == pytest.approx(-beta, abs=0.15)


def whole(fields: EvolvingFields, place: float) -> tuple[Floats, Floats]:
    return fields.at(place).over(slice(0, fields.side), slice(0, fields.side))


@pytest.mark.parametrize(
    ("beta", "betas", "correlation_px"), [(3.3, None, 200.0), (3.3, (6.0, 6.0), 1e10), (6.0, None, 1e-8)]
)
def test_an_evolving_field_has_variance_one(
    beta: float, betas: tuple[float, float] | None, correlation_px: float
) -> None:
    """Also if the independent fields are few features wide and so correlated by chance."""
    fields = EvolvingFields(256, beta, betas, correlation_px, 1.0, 1, "t", derived=lambda pair: first_of(pair, 4))
    for place in (0.0, 0.4, 3.7, 0.9):
        found = whole(fields, place)
        assert [field.std() for field in found] == pytest.approx([1, 1], abs=1e-5)
        assert fields.at(place).derived == pytest.approx(shrunk(found[0], 4), abs=1e-5)


def test_an_evolving_field_has_its_correlation() -> None:
    """Correlation over many independent tiles: 2/3 after a period, 0 after four, 0.9936 after a step."""
    found: dict[float, list[float]] = {1 / STEPS: [], 1.0: [], 4.0: []}
    for seed in range(30):
        fields = EvolvingFields(64, 2.0, None, 4.0, 1.0, seed, "t")
        start = whole(fields, 0.25)
        for lag, values in found.items():
            values += [float(np.mean(a * b)) for a, b in zip(start, whole(fields, 0.25 + lag), strict=True)]
    # The closed form at this phase: sum of h(x) h(x + lag) / 1.5 over the bumps h = cos^2(pi x / 4), |x| < 2.
    for lag, values in found.items():
        places = 0.25 - np.arange(-8, 8)
        bumps = [np.where(np.abs(x) < 2, np.cos(np.pi / 4 * x) ** 2, 0) for x in (places, places + lag)]
        assert np.mean(values) == pytest.approx(float(bumps[0] @ bumps[1]) / 1.5, abs=0.03)


def test_an_evolving_layer_drifts_and_changes_smoothly() -> None:
    """3 mrad/s over 1/3 s at 0.1 mrad a px are 10 px, in which the texture changes little."""
    scene = context(ifov_mrad=0.1)
    layer = Clouds(evolve_s=60.0, wind_mrad_s=(3.0, 0.0), depth=2.0, correlation_mrad=6).evolving(scene)
    before, after = layer.light(view_at(scene, 2.0))[0], layer.light(view_at(scene, 2.0 + 1 / 3))[0]
    assert np.corrcoef(after[:, 10:].ravel(), before[:, :-10].ravel())[0, 1] > 0.999
    frames = [layer.light(view_at(scene, 7.4 + k / 30))[0] for k in range(8)]  # across the state at 60/8 s
    steps = [float(np.abs(one - other).mean()) for one, other in pairwise(frames)]
    assert max(steps) < 1.5 * min(steps)


@pytest.mark.parametrize("ifov_mrad", [0.1, 3.0])
def test_an_evolving_layer_turns_and_rolls_with_the_camera(ifov_mrad: float) -> None:
    scene = context(size=(161, 121), ifov_mrad=ifov_mrad)
    layer = Clouds(evolve_s=60.0, correlation_mrad=60 * ifov_mrad, depth=2.0).evolving(scene)
    still = layer.light(view_at(scene))[0]
    up = layer.light(view_at(scene, turn=(0.0, 5 * ifov_mrad * 1e-3, 0.0)))[0]
    assert np.corrcoef(up[10:, 40:-40].ravel(), still[5:-5, 40:-40].ravel())[0, 1] > 0.995
    quarter = layer.light(view_at(scene, turn=(0.0, 0.0, math.pi / 2)))[0]
    # Rolled clockwise by a quarter, what was to the right of the middle is above it.
    around = np.s_[60 - 40 : 60 + 41, 80 - 40 : 80 + 41]
    assert quarter[around] == pytest.approx(np.rot90(still[around]), abs=0.05 if ifov_mrad < 1 else 0.2)


def test_sunlit_edges_are_brighter() -> None:
    """A round cloud: its edge towards the sun gains up to sunlit_k, the far edge nothing."""
    scene = context(ifov_mrad=0.5)
    y, x = np.mgrid[:256, :256] - 127.5
    bump = (3 * np.exp(-(x**2 + y**2) / (2 * 30**2))).astype(np.float32)
    flat = np.zeros_like(bump)
    plain = Clouds(coverage=0.3, texture_k=0, temperature_k=260)
    lit = plain.model_copy(update={"sunlit_k": 10.0, "sun_deg": 90.0})
    passed, dark = plain.paint(bump, flat, scene)
    same, bright = lit.paint(bump, flat, scene)
    assert np.array_equal(passed, same)
    gain = (bright - dark) / float(radiance("mwir", 270) - radiance("mwir", 260))
    assert gain[:, :126].max() < 0.02
    assert 0.1 < gain[:, 130:].max() <= 1


def test_cloud_states_are_exact_to_half_a_unit() -> None:
    """A unit is at most 1/65535 of the range of the emission."""
    layer = Clouds(evolve_s=8.0, depth=2.0, sunlit_k=8.0).evolving(context(ifov_mrad=3.0))
    state = layer.state_at(0.0)
    whole = slice(0, state.side)
    for unit, painted, words in zip(
        state.units, state.paint(whole, whole), state.window(0, 0, state.side, state.side), strict=True
    ):
        assert np.abs(units_of(words) * unit - painted).max() < 0.51 * unit
        assert 0.51 * unit < np.ptp(painted) / 65535


@pytest.mark.parametrize(("kind", "air"), [("sky", "us_standard"), ("landscape", "none"), ("sea", "us_standard")])
def test_blending_equals_transmittance_and_emission(kind: str, air: str) -> None:
    """Through air and behind ground."""
    cloud = {"id": "cloud", "coverage": 0.5, "evolve_s": 20.0, "range_m": 4000.0, "wind_mrad_s": (1.5, 0.1)}
    camera = {"size": (160, 128), "ifov_mrad": 0.15, "elevation_deg": 0.2, "band": "lwir"}
    scene = {"camera": camera, "background": {"kind": kind, "clouds": [cloud]}, "frames": 50}
    renderer = Renderer(Scenario.model_validate({**scene, "atmosphere": {"preset": air}}))
    sky, *_, layer = renderer.layers
    for index in (7, 49):
        view_direction = renderer.now(index).view_direction(index)
        (transmittance, emission), under = layer.light(view_direction), sky.light(view_direction)[1]
        assert transmittance is not None
        found, patch = np.empty_like(under), (slice(60, 99), slice(20, 50))
        assert is_semi_transparent(layer)
        (passed,) = layer.blend(under, found, view_direction, [patch])
        np.testing.assert_allclose(found, under * transmittance + emission, rtol=1e-6)
        np.testing.assert_allclose(passed, transmittance[patch], rtol=0, atol=1e-6)
        layer.blend(under, kept := under.copy(), view_direction, [])
        layer.blend(kept_under := under.copy(), kept_under, view_direction, [])
        np.testing.assert_array_equal(kept, kept_under)


WHOLE = slice(0, 512)


@pytest.mark.parametrize("spread_k", [0.0, 2.0, 20.0])
def test_thick_cloud_has_the_radiance_of_its_temperature(spread_k: float) -> None:
    warmth = np.random.default_rng(0).standard_normal((40, 50)).astype(np.float32)
    warmth[0, :2] = -3 * EXTREME, 3 * EXTREME
    look = CloudShading.of(0.0, 1e3, (270.0, spread_k, 0.0), "mwir")
    passed, found = look.paint(np.ones_like(warmth), warmth, None)
    kelvin = 270 + spread_k * np.clip(warmth.astype(np.float64), -EXTREME, EXTREME)
    wanted = radiance("mwir", kelvin)
    assert not passed.any()
    assert found.dtype == np.float32
    # Half of a step, where light grows most.
    half = EXTREME * spread_k / (ENTRIES - 1) * slope("mwir", float(kelvin.max()))
    assert np.abs(found - wanted).max() < 1.01 * half + 2e-6 * wanted.max()


def test_thin_cloud_has_the_transmittance_of_its_depth() -> None:
    thickness = np.linspace(-1, 2, 301, dtype=np.float32)[None, :]
    look = CloudShading.of(0.5, 2.0, (270.0, 0.0, 8.0), "mwir")
    lit = np.full_like(thickness, 0.75)
    passed, emitted = look.paint(thickness, np.zeros_like(thickness), lit)
    above = np.maximum(thickness.astype(np.float64) - 0.5, 0)
    dark, bright = radiance("mwir", np.array([270.0, 278.0]))
    light = dark + 0.75 * np.exp(-above) * (bright - dark)
    cover = 1 - np.exp(-2 * above)
    np.testing.assert_allclose(passed, 1 - cover, rtol=1e-5)
    np.testing.assert_allclose(emitted, cover * light, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize(("correlation_mrad", "coarse"), [(30.0, 2), (120.0, 8)])
def test_sunlight_on_a_reduced_relief_is_accurate(correlation_mrad: float, coarse: int) -> None:
    """Against the full resolution: within a twentieth of its maximum, rms a hundredth."""
    thickness = spectral((512, 512), 3.3, None, 400.0, 2.0, 7, "t")
    sigma_px = correlation_mrad / 6
    assert coarseness(sigma_px, 512) == coarse
    slopes = (slope_to_sun(shrunk(thickness, finer), sigma_px / finer, -45.0) for finer in (coarse, 1))
    found, wanted = (
        np.clip(enlarged(sunlit_share(each), finer, WHOLE, WHOLE), 0, 1)
        for each, finer in zip(slopes, (coarse, 1), strict=True)
    )
    assert wanted.max() > 2 * wanted.mean()
    assert np.abs(found - wanted).max() < wanted.max() / 20
    assert np.sqrt(np.mean((found - wanted) ** 2)) < wanted.max() / 100
