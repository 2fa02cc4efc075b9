"""How a cloud's pixels are made: light of its warmth, the sun on its edges, and tiles that make up the whole."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.backgrounds.clouds import ENTRIES, EXTREME, CloudShading, Relief, slope_to_sun
from irsim.backgrounds.sky import Clouds
from irsim.backgrounds.texture import coarseness, shrunk
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.random_fields import spectral
from irsim.physics.radiometry import radiance, slope

STAGE = SceneContext(1, Geometry((160, 120), 1.5e-4, 0.2), 30.0, "mwir", 0.6)
WHOLE = slice(0, 512)


@pytest.mark.parametrize("spread_k", [0.0, 0.02, 2.0, 20.0])
def test_the_light_of_a_thick_cloud_is_that_of_its_warmth(spread_k: float) -> None:
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


def test_thin_cloud_lets_through_what_its_depth_says() -> None:
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


@pytest.mark.parametrize(("correlation_mrad", "coarse"), [(30.0, 2), (60.0, 4), (120.0, 8), (600.0, 32)])
def test_lit_edges_are_those_of_all_pixels(correlation_mrad: float, coarse: int) -> None:
    """The sun's light worked out coarser, beside all pixels: within a twentieth of its greatest, rms a hundredth."""
    thickness = spectral((512, 512), 3.3, None, 400.0, 2.0, 7, "t")
    sigma_px = correlation_mrad / 6
    assert coarseness(sigma_px, 512) == coarse
    found, wanted = (
        np.clip(
            Relief.of(slope_to_sun(shrunk(thickness, finer), sigma_px / finer, -45.0), finer).lit(WHOLE, WHOLE), 0, 1
        )
        for finer in (coarse, 1)
    )
    assert wanted.max() > 2 * wanted.mean()
    assert np.abs(found - wanted).max() < wanted.max() / 20
    assert np.sqrt(np.mean((found - wanted) ** 2)) < wanted.max() / 100


@pytest.mark.parametrize("correlation_mrad", [3e4, 1e7])
def test_clouds_larger_than_the_sky_are_lit_too(correlation_mrad: float) -> None:
    thickness = spectral((512, 512), 3.3, None, 400.0, 2.0, 7, "t")
    sigma_px = correlation_mrad / 6
    coarse = coarseness(sigma_px, 512)
    slope = slope_to_sun(shrunk(thickness, coarse), sigma_px / coarse, -45.0)
    assert np.isfinite(Relief.of(slope, coarse).lit(WHOLE, WHOLE)).all()


@pytest.mark.parametrize("histogram", [(), (0.0, 0.1, 1.0)])
def test_tiles_of_an_evolving_cloud_are_those_of_the_whole(histogram: tuple[float, ...]) -> None:
    """Side by side they have no seams, over the edges of the period neither."""
    clouds = Clouds(evolve_s=8.0, depth=2.0, sunlit_k=8.0, histogram=histogram)
    paint = clouds.evolving(STAGE)._state_at(0.375)._paint
    here, across = slice(0, 128), slice(-64, 64)
    for part in range(2):
        one = paint(here, here)[part]
        np.testing.assert_allclose(paint(across, here)[part][64:], one[:64], rtol=2e-6, atol=1e-6)
        np.testing.assert_allclose(paint(here, across)[part][:, 64:], one[:, :64], rtol=2e-6, atol=1e-6)
        np.testing.assert_allclose(paint(slice(1024, 1152), here)[part], one, rtol=2e-6, atol=1e-6)
