"""Features of recognition against scikit-image and Parseval's theorem; galleries against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from skimage.feature import graycomatrix, graycoprops
from skimage.measure import moments_central, moments_hu, moments_normalized

from irsim.types import Box
from irtrack.features import recognition
from irtrack.features.gallery import PRIOR, PRIOR_SD, Gallery, appearance_vector


@pytest.mark.parametrize("seed", range(4))
def test_moments_and_cooccurrence_equal_scikit_image(seed: int) -> None:
    rng = np.random.default_rng(seed)
    picture = rng.random((16, 16))
    theirs = moments_hu(moments_normalized(moments_central(picture)))  # type: ignore[no-untyped-call]
    ours = recognition.hu_moments(picture)
    np.testing.assert_allclose(np.abs(ours), np.abs(theirs), rtol=1e-6)
    levels = rng.integers(0, 8, (16, 16)).astype(np.uint8)
    both = graycomatrix(levels, [1], [0, np.pi / 2], 8, symmetric=True)  # type: ignore[no-untyped-call]
    pairs = both.sum(axis=(2, 3)) / both.sum()
    np.testing.assert_allclose(recognition.cooccurrence(levels), pairs)
    names = ("contrast", "homogeneity", "energy", "correlation")
    values = [graycoprops(pairs[:, :, None, None], name)[0, 0] for name in names]  # type: ignore[no-untyped-call]
    np.testing.assert_allclose(recognition.haralick(pairs), values)


def test_energies_obey_parseval() -> None:
    patch = np.random.default_rng(0).normal(0, 30, (16, 16))
    details, rest = recognition.haar_transform(patch)
    assert sum((each**2).sum() for each in details) + (rest**2).sum() == pytest.approx((patch**2).sum())
    shares = recognition.rings(patch)
    assert shares.sum() == pytest.approx(1)
    spectrum = np.abs(np.fft.fft2(patch - patch.mean())) ** 2
    assert spectrum.sum() == pytest.approx(patch.size * ((patch - patch.mean()) ** 2).sum())
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(16), np.fft.fftfreq(16)))
    lowest = spectrum[frequency < np.sqrt(0.5) / recognition.RINGS].sum() / spectrum.sum()
    assert shares[0] == pytest.approx(lowest)
    assert recognition.wavelet_energies(patch).sum() == pytest.approx(1)


def test_vectors_do_not_depend_on_gain_and_place() -> None:
    rng = np.random.default_rng(1)
    y, x = np.mgrid[:60, :80]
    blob = np.exp(-((x - 30) ** 2) / 40 - (y - 25) ** 2 / 12)
    image = np.clip(np.rint(60 + 80 * blob + rng.normal(0, 2, blob.shape)), 0, 255).astype(np.uint8)
    brighter = (image.astype(np.uint16) * 20 + 900).astype(np.uint16)
    box = Box(30.0, 25.0, 16, 9)
    vector = recognition.recognition_vector(image, box)
    assert vector.shape == (len(recognition.NAMES),)
    np.testing.assert_allclose(recognition.recognition_vector(brighter, box), vector, atol=0.05)
    shifted = recognition.recognition_vector(np.roll(image, (9, 11), (0, 1)), Box(41.0, 34.0, 16, 9))
    np.testing.assert_allclose(shifted, vector, atol=1e-9)
    flat = recognition.recognition_vector(np.full((60, 80), 7, np.uint8), box)
    assert np.isfinite(flat).all()


def test_gallery_is_a_running_mean_and_covariance() -> None:
    vectors = np.random.default_rng(2).normal(0, 1, (30, 4))
    gallery = Gallery.empty()
    for vector in vectors:
        gallery = gallery.learned(vector)
    np.testing.assert_allclose(gallery.mean, vectors.mean(axis=0))
    expected = (30 * np.cov(vectors.T, bias=True) + PRIOR * np.diag(PRIOR_SD**2)) / (30 + PRIOR)
    np.testing.assert_allclose(gallery.covariance, expected)
    apart = Gallery.empty().learned(gallery.mean + np.array([1, 0, 0, 0]))
    assert gallery.distance(apart) == pytest.approx(np.linalg.inv(expected)[0, 0] / 2)


def test_appearance_of_a_point_in_closed_form() -> None:
    """A Gaussian of amplitude 100 and deviations 1.5, 2: flux 2 pi 1.5 2 100, on a level of 50; a negative is alike."""
    y, x = np.mgrid[:41, :41]
    light = 100 * np.exp(-((x - 20) ** 2) / (2 * 1.5**2) - (y - 20) ** 2 / (2 * 2.0**2))
    image = np.rint((50 + light) * 100).astype(np.uint16)
    contrast, flux, *spreads = np.exp(np.asarray(appearance_vector(image, (20.0, 20.0))))
    assert contrast == pytest.approx(100 * 100 * 0.7992, rel=1e-3)
    assert flux == pytest.approx(2 * np.pi * 3 * 100 * 100, rel=0.25)  # the parts below a fifth are cut
    assert spreads[0] / spreads[1] == pytest.approx(1.5 / 2, rel=0.1)
    cold = appearance_vector((20_000 - image).astype(np.uint16), (20.0, 20.0))
    assert cold == pytest.approx(appearance_vector(image, (20.0, 20.0)))
    assert appearance_vector(image, (3.0, 20.0)) is None
