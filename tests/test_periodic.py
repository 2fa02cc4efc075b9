"""Periodic pictures as wholes."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.backgrounds import sky
from irsim.backgrounds.fields import spectral
from irsim.backgrounds.periodic import FINE, coarseness, enlarged, shrunk, wrapped_blur
from irsim.geometry import Geometry
from irsim.stage import Stage


@pytest.mark.parametrize(("sigma_px", "coarse"), [(0.5, 1), (9.9, 1), (10.0, 2), (19.9, 2), (20.0, 4), (160.0, 32)])
def test_what_is_blurred_is_kept_on_no_coarser_pixels_than_tell_it(sigma_px: float, coarse: int) -> None:
    assert coarseness(sigma_px, 1024) == coarse
    assert sigma_px / coarse >= FINE or coarse == 1


@pytest.mark.parametrize("sigma_px", [5.0, 10.0, 23.0, 60.0])
def test_a_blurred_picture_made_smaller_and_larger_is_the_same(sigma_px: float) -> None:
    """Across its edges, too: it is rolled by an odd number of pixels first."""
    picture = np.roll(spectral(256, 3.0, None, 60.0, 1.0, 4, "t"), (37, 91), axis=(0, 1))
    wanted, coarse = wrapped_blur(picture, sigma_px), coarseness(sigma_px, 256)
    found = enlarged(wrapped_blur(shrunk(picture, coarse), sigma_px / coarse), coarse)
    assert found.shape == picture.shape
    assert np.abs(found - wanted).max() < 0.01 * np.ptp(wanted)
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.015 * wanted.std()


def test_a_picture_as_it_is_needs_no_change() -> None:
    picture = np.random.default_rng(0).random((64, 64)).astype(np.float32)
    np.testing.assert_array_equal(enlarged(shrunk(picture, 1), 1), picture)


@pytest.mark.parametrize(("correlation_mrad", "coarse"), [(60.0, 2), (120.0, 4), (600.0, 16)])
def test_lit_edges_are_those_of_all_pixels(
    correlation_mrad: float, coarse: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The sun's light worked out coarser, beside all pixels: within a fiftieth of its greatest."""
    stage = Stage(1, Geometry((160, 120), 1.5e-4, 0.2), 30.0, "mwir", 0.6)
    thickness = spectral(512, 3.3, None, 400.0, 2.0, 7, "t")
    clouds = sky.Clouds(sunlit_k=8.0, correlation_mrad=correlation_mrad)
    above = np.maximum(thickness - clouds._edge, 0)
    assert coarseness(correlation_mrad / 6, 512) == coarse
    found = clouds._sunlight(thickness, above, stage)
    monkeypatch.setattr(sky, "coarseness", lambda *_: 1)
    wanted = clouds._sunlight(thickness, above, stage)
    assert wanted.max() > 2 * wanted.mean()
    assert found.min() >= 0
    assert np.abs(found - wanted).max() < wanted.max() / 50


@pytest.mark.parametrize("correlation_mrad", [3e4, 1e7])
def test_clouds_larger_than_the_sky_are_lit_too(correlation_mrad: float) -> None:
    stage = Stage(1, Geometry((160, 120), 1.5e-4, 0.2), 30.0, "mwir", 0.6)
    thickness = spectral(512, 3.3, None, 400.0, 2.0, 7, "t")
    clouds = sky.Clouds(sunlit_k=8.0, correlation_mrad=correlation_mrad)
    lit = clouds._sunlight(thickness, np.zeros_like(thickness), stage)
    assert np.isfinite(lit).all()
    assert lit.min() >= 0
