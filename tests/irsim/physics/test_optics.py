"""The point spread against its integrals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from irsim.physics.psf import gaussian_fwhm_px, gaussian_integral, gaussian_kernels, gaussian_support_px


@pytest.mark.parametrize("sigma", [0.3, 0.6, 1.5])
def test_shares_are_the_integral_of_a_gaussian(sigma: float) -> None:
    from scipy.integrate import quad

    def density(x: float) -> float:
        return math.exp(-0.5 * (x / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))

    for offset in (0.0, 0.3, -1.2, 2.0):
        expected = quad(density, offset - 0.5, offset + 0.5)[0]
        assert gaussian_integral(np.array([offset]), sigma)[0] == pytest.approx(expected, abs=1e-12)


def test_energy_on_a_centred_pixel() -> None:
    # 4.2 um at F/4: sigma = 0.42 * 4.2 * 4 = 7.056 um on a 15-um pixel, .507 of the light (the design's figure).
    assert gaussian_integral(np.array([0.0]), 7.056 / 15)[0] ** 2 == pytest.approx(0.507, abs=0.002)


@pytest.mark.parametrize("sigma", [0.0, 0.25, 0.6, 2.0])
@pytest.mark.parametrize("shift", [0.0, 0.21, -0.47])
def test_all_light_falls_within_reach(sigma: float, shift: float) -> None:
    pixels = np.arange(-gaussian_support_px(sigma), gaussian_support_px(sigma) + 1)
    assert gaussian_integral(pixels - shift, sigma).sum() == pytest.approx(1.0, abs=1e-8)


def test_full_width_of_wide_and_no_blur() -> None:
    assert gaussian_fwhm_px(0.0) == pytest.approx(1.0)
    # Far wider than a pixel it is the Gaussian's own 2 sqrt(2 ln 2) sigma.
    assert gaussian_fwhm_px(8.0) == pytest.approx(2 * math.sqrt(2 * math.log(2)) * 8, rel=1e-3)


def test_the_full_width_is_where_the_light_is_half() -> None:
    half = gaussian_integral(np.array([gaussian_fwhm_px(0.6) / 2]), 0.6)[0]
    assert half == pytest.approx(gaussian_integral(np.array([0.0]), 0.6)[0] / 2)


@pytest.mark.parametrize("fine", [1, 3])
@pytest.mark.parametrize("sigma", [0.0, 0.1, 0.6, 1.4])
def test_spreading_keeps_light_and_mirrors(fine: int, sigma: float) -> None:
    even, slope = gaussian_kernels(gaussian_support_px(sigma), fine, sigma)
    np.testing.assert_allclose(even.sum(axis=1), 1.0)
    np.testing.assert_allclose(slope.sum(axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(even, even[::-1, ::-1], atol=1e-12)
    np.testing.assert_allclose(slope, -slope[::-1, ::-1], atol=1e-10)


def test_without_blur_cells_are_only_binned() -> None:
    even, _ = gaussian_kernels(1, 3, 0.0)
    np.testing.assert_array_equal(even, [[0, 1, 0]] * 3)


def test_the_spread_of_a_step_is_the_gaussian_s() -> None:
    # A half-plane that ends at a pixel's edge: pixel i gets the mean over it of Phi(x / sigma).
    sigma = 0.6
    even, _ = gaussian_kernels(6, 3, sigma)
    edge = np.sum([np.pad(even.sum(axis=0) / 3, (pixel, 19 - pixel)) for pixel in range(10, 20)], axis=0)
    x = np.arange(-6, 26)

    def integral(u: np.ndarray) -> np.ndarray:
        phi = np.array([math.erf(v / sigma / math.sqrt(2)) for v in u])
        density = np.exp(-0.5 * (u / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))
        return np.asarray(u * (1 + phi) / 2 + sigma**2 * density)

    expected = integral(x + 0.5 - 9.5) - integral(x - 0.5 - 9.5)
    np.testing.assert_allclose(edge[:20], expected[:20], atol=1e-8)


@pytest.mark.parametrize("fine", [1, 3])
def test_a_first_moment_spreads_as_light_that_rises_through_the_cell(fine: int) -> None:
    # A cell with density 1 + 12 m t, t = -1/2 .. 1/2 across it, has mass 1 and first moment m.
    cell, sigma, moment = fine // 3, 0.6, 0.05
    even, slope = gaussian_kernels(6, fine, sigma)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    t = nodes / 2
    middle = (cell + 0.5) / fine - 0.5
    spread = gaussian_integral(np.arange(-6, 7)[:, None] - (middle + t / fine), sigma) @ (
        weights / 2 * (1 + 12 * moment * t)
    )
    np.testing.assert_allclose(even[cell] + moment * slope[cell], spread, atol=1e-7)
