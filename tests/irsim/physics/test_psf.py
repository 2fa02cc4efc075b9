"""Point spread functions against integrals: Gaussian, diffraction, defocus and far wings."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import dblquad
from scipy.special import j0, j1

from irsim.geometry.silhouette import Grid, blur_to_pixels
from irsim.physics.diffraction import LensPSF, WingedLensPSF, with_wings
from irsim.physics.lens import Lens
from irsim.physics.psf import GaussianPSF, gaussian_integral, gaussian_kernels
from irsim.physics.radiometry import radiance
from irsim.render.frame import Renderer
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario
from irsim.types import Box, Floats


@pytest.mark.parametrize("sigma", [0.3, 0.6, 1.5])
def test_pixel_integrals_of_a_gaussian(sigma: float) -> None:
    from scipy.integrate import quad

    def density(x: float) -> float:
        return math.exp(-0.5 * (x / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))

    for offset in (0.0, 0.3, -1.2, 2.0):
        expected = quad(density, offset - 0.5, offset + 0.5)[0]
        assert gaussian_integral(np.array([offset]), sigma)[0] == pytest.approx(expected, abs=1e-12)


def test_full_width_of_wide_and_no_blur() -> None:
    """Far wider than a pixel it is the Gaussian's own 2 sqrt(2 ln 2) sigma."""
    assert GaussianPSF(0.0).fwhm_px == pytest.approx(1.0)
    assert GaussianPSF(8.0).fwhm_px == pytest.approx(2 * math.sqrt(2 * math.log(2)) * 8, rel=1e-3)
    at_half = MONO.pixel_integral(np.zeros(1), np.array([MONO.fwhm_px / 2]))[0, 0]
    assert at_half == pytest.approx(MONO.pixel_integral(np.zeros(1), np.zeros(1))[0, 0] / 2)


@pytest.mark.parametrize(("fine", "sigma"), [(1, 0.0), (3, 0.1), (3, 1.4)])
def test_kernels_conserve_light_and_mirror(fine: int, sigma: float) -> None:
    even, slope = gaussian_kernels(GaussianPSF(sigma).support_px, fine, sigma)
    np.testing.assert_allclose(even.sum(axis=1), 1.0)
    np.testing.assert_allclose(slope.sum(axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(even, even[::-1, ::-1], atol=1e-12)
    np.testing.assert_allclose(slope, -slope[::-1, ::-1], atol=1e-10)


WIDTH = 4.2 * 4 / 15
"""Wavelength times F-number over the pitch: 4.2 um, F/4, 15 um."""
MONO = LensPSF(((WIDTH, 1.0),))


def airy(width: float, x: float, y: float, sides: float = 0.5) -> float:
    """Share of an Airy pattern's light, centred at the origin, on the square pixel at (x, y) px.

    Irradiance pi / (4 w^2) (2 J1(v) / v)^2, v = pi r / w (Goodman; its integral over the plane is 1).
    """

    def density(b: float, a: float) -> float:
        v = math.pi * math.hypot(a, b) / width
        return math.pi / (4 * width**2) * (2 * j1(v) / v) ** 2 if v > 1e-9 else math.pi / (4 * width**2)

    return float(dblquad(density, x - sides, x + sides, y - sides, y + sides, epsabs=1e-7)[0])


def test_energy_on_a_centred_pixel() -> None:
    # The design's figures for 4.2 um at F/4 on 15 um: .455, and .507 for the Gaussian of 0.42 lambda F.
    share = MONO.pixel_integral(np.zeros(1), np.zeros(1))[0, 0]
    assert share == pytest.approx(0.455, abs=0.0015)
    assert share == pytest.approx(airy(WIDTH, 0.0, 0.0), rel=0.002)
    assert GaussianPSF(0.42 * WIDTH).pixel_integral(np.zeros(1), np.zeros(1))[0, 0] == pytest.approx(0.507, abs=0.002)


@pytest.mark.parametrize(("width", "x", "y"), [(0.4, 0.37, -0.21), (WIDTH, 1.5, 0.25), (2.5, 3.0, 2.0)])
def test_pixel_integrals_of_the_airy_pattern(width: float, x: float, y: float) -> None:
    found = LensPSF(((width, 1.0),)).pixel_integral(np.array([y]), np.array([x]))[0, 0]
    # What lies out of reach, 0.8 % of the light, is laid over the rest.
    assert found == pytest.approx(airy(width, x, y), rel=0.01, abs=3e-5)


SHARP = LensPSF(((0.5, 1.0),))
SPREADS = [
    GaussianPSF(0.6),
    SHARP,
    LensPSF(((WIDTH, 1.0),), 3.0, 0.4),
    Lens().psf("mwir", 0.3),
]


@pytest.mark.parametrize("psf", SPREADS)
@pytest.mark.parametrize("shift", [0.0, -0.47])
def test_light_and_centroid_are_conserved(psf: Any, shift: float) -> None:
    places = np.arange(-psf.support_px, psf.support_px + 1.0)
    light = psf.pixel_integral(places - 0.1, places - shift)
    assert light.sum() == pytest.approx(1.0, abs=1e-4)
    assert light.min() > -1e-6
    if psf != SHARP:  # far sharper than a pixel: its place within the pixel has little effect
        assert light.sum(axis=0) @ places == pytest.approx(shift, abs=2e-3)


@pytest.mark.parametrize("psf", SPREADS)
@pytest.mark.parametrize("fine", [1, 2])
def test_kernels_equal_summed_points(psf: Any, fine: int) -> None:
    """A square of one cell, its light even or rising, by terms and by summing points over it."""
    grid = Grid(0, 0, 5, 4, fine)
    fields = np.zeros((3, 1, 4 * fine, 5 * fine))
    row, column, moment = 2 * fine, 3 * fine, 0.05
    fields[0, 0, row, column : column + 2] = 1.0, -1.0  # what changes from cell to cell
    fields[2, 0, row, column] = moment
    both = np.concatenate([fields, fields], axis=1)
    center = np.zeros(2)
    drawn = blur_to_pixels(grid, both, (center, center), 1.0, Box(0, 0, 1, 1), psf, 100.0).alpha
    nodes, weights = np.polynomial.legendre.leggauss(8)
    x0, y0 = ((cell + 0.5) / fine - 0.5 for cell in (column, row))
    rows, columns = (np.arange(-psf.support_px, size + psf.support_px) for size in (4, 5))
    expected = np.zeros_like(drawn)
    for t, wt in zip(nodes / 2, weights / 2, strict=True):
        for u, wu in zip(nodes / 2, weights / 2, strict=True):
            expected += (
                wt * wu * (1 + 12 * moment * u) * psf.pixel_integral(rows - (y0 + t / fine), columns - (x0 + u / fine))
            ) / fine**2
    np.testing.assert_allclose(drawn, expected, atol=1.3e-4 / fine**2 if isinstance(psf, LensPSF) else 1e-7)


def scene(
    shape: dict[str, Any], x: float = 60.3, range_m: float = 1500.0, behind_k: float = 250.0, **camera: Any
) -> Scenario:
    return Scenario.model_validate(
        {
            "frames": 3,
            "camera": {"size": (128, 128), "netd_mk": 0.0, "psf_px": 0.2, **camera},
            "background": {"kind": "sky", "horizon_k": behind_k, "zenith_k": behind_k},
            "targets": [
                {
                    "id": "one",
                    "shape": shape,
                    "path": {"kind": "straight", "start": (x, 63.8), "speed": 0.0, "range_m": range_m},
                }
            ],
        }
    )


LENS = {"f_number": 4.0, "pitch_um": 15.0, "defocus_px": 0.8}


def added(scenario: Scenario) -> Floats:
    """Return the light of the target above that of the uniform background, (rows, columns)."""
    whole = Renderer(scenario).scene(0)[0].astype(np.float64)
    empty = Renderer(scenario.model_copy(update={"without": ("one",)})).scene(0)[0]
    return np.asarray(whole - empty)


@pytest.mark.parametrize(("optics", "psf_px"), [(None, 0.0), (None, 0.6), (LENS, 0.2)])
def test_flux_is_conserved_from_point_to_disc(optics: Any, psf_px: float) -> None:
    """It nears from where it fills a thousandth of a pixel to where it is 8 px wide: its flux goes with 1/range^2."""
    camera = {"psf_px": psf_px} if optics is None else {"psf_px": psf_px, "optics": optics}
    shape = {"kind": "point", "area_m2": 2.0, "temperature_k": 330.0, "emissivity": 1.0}
    gain = float(radiance("mwir", 330.0) - radiance("mwir", 250.0))
    for width in (0.03, 0.999, 1.001, 8.0):
        phi = math.pi / 4 * width**2
        range_m = math.sqrt(2.0 / phi) / 0.5e-3
        found = added(scene(shape, 60.3, range_m, **camera)).sum()
        # Light of the wings that falls outside the frame is lost: under 1 % of it.
        assert found == pytest.approx(phi * gain, rel=0.01)


@pytest.mark.parametrize(("kind", "x"), [("point", 60.01), ("fighter", 60.37), ("hot_spot", 60.5)])
def test_truth_is_the_centroid_under_diffraction(kind: str, x: float) -> None:
    scenario = scene({"kind": kind}, x, behind_k=20.0, optics=LENS)
    light = added(scenario)
    (target,) = Renderer(scenario).scene(0)[1].targets
    assert target.signal_center is not None
    rows, columns = np.indices(light.shape)
    assert (columns * light).sum() / light.sum() == pytest.approx(target.signal_center[0], abs=0.01)
    assert (rows * light).sum() / light.sum() == pytest.approx(target.signal_center[1], abs=0.01)


def test_optics_are_switched_off() -> None:
    given = scene({"kind": "fighter"}, optics=LENS)
    off = given.model_copy(update={"without": ("optics",)})
    none = scene({"kind": "fighter"})
    assert np.array_equal(Rendering(off).frame(1).image, Rendering(none).frame(1).image)
    assert not np.array_equal(Rendering(given).frame(1).image, Rendering(none).frame(1).image)


def test_a_lens_that_cannot_be_drawn_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"wavelength times F-number is .* pixels; allowed: 0.1 to 10"):
        scene({"kind": "point"}, optics={"f_number": 100.0, "pitch_um": 5.0})


LENSES = [Lens(f_number=4.0), Lens(f_number=1.5, defocus_px=3.0)]


def winged(lens: Lens) -> tuple[LensPSF, WingedLensPSF]:
    near = lens.psf("mwir", 0.3)
    far = with_wings(near, 1e-9)
    assert isinstance(far, WingedLensPSF)
    return near, far


@pytest.mark.parametrize("lens", LENSES)
def test_far_rings_have_rayleigh_s_energy(lens: Lens) -> None:
    """J0^2 + J1^2 of pi r / w of an Airy pattern's light falls outside r, of each colour."""
    near, far = winged(lens)
    pixels = np.arange(-far.support_px, far.support_px + 1.0)
    share, radius = far.pixel_integral(pixels, pixels), np.hypot(pixels[:, None], pixels)

    def outside(r: float) -> float:
        found = (
            weight * (j0(v) ** 2 + j1(v) ** 2) for w, weight in lens.airy_widths("mwir") for v in [math.pi * r / w]
        )
        return float(sum(found))

    for inner, outer in ((0.6, 1.2), (1.0, 2.0), (1.5, 3.0)):
        ends = inner * near.support_px, outer * near.support_px
        ring = (radius > ends[0]) & (radius <= ends[1])
        assert share[ring].sum() == pytest.approx(outside(ends[0]) - outside(ends[1]), rel=0.05)


@pytest.mark.parametrize(("lens", "shift"), list(zip(LENSES, (0.31, -0.5), strict=True)))
def test_wings_are_smooth_and_conserve_light(lens: Lens, shift: float) -> None:
    """By r^-3 a step of 1 px changes the light by a share of 3 / r, beside remaining rings."""
    near, far = winged(lens)
    pixels = np.arange(-far.support_px, far.support_px + 1.0) + shift
    share = far.pixel_integral(pixels, pixels - 0.2)
    assert share.sum() == pytest.approx(1, abs=2e-4)
    assert share.min() >= 0
    middle, reach = far.support_px, near.support_px
    steps = np.arange(round(0.8 * reach), 3 * reach)
    for line in (share[middle, middle:], share[middle:, middle], np.diag(share)[middle:]):
        fall = line[steps + 1] / line[steps]
        assert 0.7 < fall.min() <= fall.max() < 1.15


@pytest.mark.parametrize(("area_m2", "wide"), [(0.15, True), (1e-4, False)])
def test_bright_points_have_wings(area_m2: float, wide: bool) -> None:
    camera = {"preset": "cooled_mwir", "size": (161, 33), "optics": {"f_number": 4}, "psf_px": 0.2}
    path = {"kind": "straight", "start": (80, 16), "speed": 0, "range_m": 4000}
    motor = {"id": "motor", "shape": {"kind": "point", "temperature_k": 1800, "area_m2": area_m2}, "path": path}
    scene = Scenario.model_validate(
        {"camera": camera, "background": {"kind": "ground", "spread_k": 0}, "targets": [motor]}
    )
    light = Renderer(scene).scene(0)[0]
    reach = scene.context.psf.support_px
    assert (light[16, 80 + reach + 4] > light[0, 0]) == wide
