"""Sprites over an exposure: means, overlaps, and occlusion at each instant."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.geometry.sprite import FULL_PATCH, ExposureSamples, OccludedBlur, Sprite, exposure_mean, overlap
from irsim.types import Box, Floats


def sprite(x0: int, light: float = 2.0) -> Sprite:
    """Return a sprite of 2 x 3 pixels."""
    cells, center = np.ones((2, 3)), (x0 + 1.0, 0.5)
    return Sprite(x0, 0, cells, 0.5 * cells, light * cells, center, center, Box(*center, 3, 2), 100.0, 6.0)


def test_an_exposure_is_the_mean_of_its_instants() -> None:
    instants = [sprite(0), sprite(1), None, sprite(4, 6.0)]
    mean = exposure_mean(instants[1], instants)
    assert mean is not None
    assert mean.samples is not None
    assert (mean.x0, mean.cover.shape, mean.samples.cover.shape) == (0, (2, 7), (4, 2, 7))
    np.testing.assert_allclose(mean.cover, mean.samples.cover.mean(axis=0))
    np.testing.assert_allclose(mean.cover[0], np.array([1, 2, 2, 1, 1, 1, 1]) / 4)
    assert mean.area == pytest.approx(18 / 4)
    # Light 12, 12 and 36 at centroids 1, 2 and 5.
    assert mean.signal_center == pytest.approx((3.6, 0.5))
    assert not mean.whole
    still = sprite(0)
    assert exposure_mean(still, [still, still]) is still
    assert exposure_mean(None, [None, None]) is None


def test_occlusion_at_each_instant_differs_from_that_of_means() -> None:
    """A moving object behind a moving occluder: the light is the mean of the pictures at all instants."""
    rng = np.random.default_rng(0)
    background = rng.uniform(1, 2, (6, 8))
    cover, alpha, emission = rng.uniform(0, 1, (3, 5, 6, 8))
    hidden: Floats = rng.uniform(0, 1, (5, 6, 8))
    samples = ExposureSamples(cover, alpha, emission, whole=True)
    whole = (FULL_PATCH, FULL_PATCH)
    moving = OccludedBlur.of(samples, background, whole)
    light = background * (1 - alpha.mean(axis=0)) + emission.mean(axis=0)
    light = light * (1 - hidden.mean(axis=0))
    moving.hide(light, FULL_PATCH, hidden)
    exact = ((background * (1 - alpha) + emission) * (1 - hidden)).mean(axis=0)
    np.testing.assert_allclose(light, exact, rtol=1e-12)


@pytest.mark.parametrize(
    ("other", "slices"),
    [
        ((2, 1), ((slice(1, 3), slice(2, 4)), (slice(0, 2), slice(0, 2)))),
        ((-1, -1), ((slice(0, 2), slice(0, 2)), (slice(1, 3), slice(1, 3)))),
        ((4, 0), None),
    ],
)
def test_overlap_of_two_patches(other: tuple[int, int], slices: object) -> None:
    assert overlap((0, 0), (3, 4), other, (3, 3)) == slices
