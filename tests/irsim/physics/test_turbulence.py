"""Turbulence: Fried's r0, tilt, blur and scintillation against their integrals; processes; pictures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import integrate, optimize, special, stats

from irsim.physics.turbulence import (
    TILT_KNEE,
    Turbulence,
    fried_m,
    long_exposure_rad,
    scintillation_index,
    tilt_hertz,
    tilt_rad,
)
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.types import Floats


def test_r0_of_an_example() -> None:
    """Cn2 1e-14, 1 km, 1.55 um, by hand: k = 4.0537e6; 0.158625 * 1.64322e13 * 1e-11 = 26.0657; ^-0.6 = 0.14137 m."""
    assert fried_m(1e-14, 1000.0, 1.55e-6) == pytest.approx(0.14137, rel=1e-4)


def test_long_exposure_width_follows_from_its_otf() -> None:
    """The Hankel transform of exp(-3.44 (lambda f / r0)^(5/3)) (Fried 1966), in units of lambda / r0."""

    def brightness(angle: float) -> float:
        found, _ = integrate.quad(
            lambda f: f * np.exp(-3.44 * f ** (5 / 3)) * special.j0(2 * np.pi * f * angle), 0, 4, limit=200
        )
        return float(found)

    half = optimize.brentq(lambda angle: brightness(angle) - brightness(0) / 2, 0.1, 2)
    assert long_exposure_rad(1.0, 1.0) * math.sqrt(8 * math.log(2)) == pytest.approx(2 * half, rel=0.01)


def test_tilt_is_the_first_zernike_mode_of_kolmogorov_phase() -> None:
    """Phase spectrum 0.0229 r0^(-5/3) f^(-11/3), filter 4 cos^2 (J2(2 pi R f) / (pi R f))^2 (Noll 1976)."""
    aperture, r0, wavelength = 0.3, 0.1, 4e-6
    radius = aperture / 2
    spectral, _ = integrate.quad(
        lambda f: f ** (-8 / 3) * (special.jv(2, 2 * np.pi * radius * f) / (np.pi * radius * f)) ** 2,
        1e-6,
        400,
        limit=2000,
    )
    radians = 0.0229 * r0 ** (-5 / 3) * 4 * np.pi * spectral
    # The mode is 2 x / R on the aperture: a slope of 2 a / R rad/m, which is lambda / (2 pi) times that in angle.
    angle = math.sqrt(radians) * 2 / radius * wavelength / (2 * math.pi)
    assert tilt_rad(r0, aperture, wavelength) == pytest.approx(angle, rel=0.01)


def test_blur_and_tilt_together_are_the_long_exposure() -> None:
    strong = Turbulence(cn2=1e-12, path_m=3000, aperture_m=0.3)
    r0 = fried_m(1e-12, 3000, 4e-6)
    total = math.hypot(strong.blur_rms("mwir"), strong.tilt_rms("mwir"))
    assert total == pytest.approx(long_exposure_rad(r0, 4e-6))
    small = Turbulence(cn2=1e-14, aperture_m=0.02)
    assert small.blur_rms("mwir") == 0
    assert small.tilt_rms("mwir") > 0


def rytov(aperture: float) -> float:
    """Scintillation of a spherical wave, over Cn2 k^(7/6) L^(11/6), by Rytov's double integral.

    16 pi^2 k^2 int dz int kappa 0.033 Cn2 kappa^(-11/3) sin^2(kappa^2 z (L - z) / (2 k L)) (2 J1(x) / x)^2, with
    x = kappa D z / (2 L); lengths in units of sqrt(L / k). Fast oscillations count as their mean.
    """
    kappa = np.geomspace(1e-4, 1000, 20_001)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    total = 0.0
    for s, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
        phase = kappa**2 * s * (1 - s) / 2
        waves = np.where(phase < 100, np.sin(np.minimum(phase, 100)) ** 2, 0.5)
        x = kappa * aperture * s / 2
        filtered = (2 * special.j1(x) / x) ** 2 if aperture else 1.0
        total += weight * np.trapezoid(kappa ** (-8 / 3) * waves * filtered, kappa)
    return float(16 * math.pi**2 * 0.033 * total)


def test_weak_scintillation_is_rytovs() -> None:
    cn2, distance, wavelength = 1e-16, 1500.0, 4e-6
    k = 2 * math.pi / wavelength
    expected = rytov(0.0) * cn2 * k ** (7 / 6) * distance ** (11 / 6)
    assert scintillation_index(cn2, distance, wavelength) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("widths", [0.3, 3.0, 40.0])
def test_wide_apertures_average_scintillation(widths: float) -> None:
    """Aperture in units of sqrt(L / k), against Rytov's integral."""
    cn2, distance, wavelength = 1e-17, 2000.0, 4e-6
    unit = math.sqrt(distance * wavelength / (2 * math.pi))
    share = scintillation_index(cn2, distance, wavelength, widths * unit) / scintillation_index(
        cn2, distance, wavelength
    )
    assert share == pytest.approx(rytov(widths) / rytov(0.0), rel=0.02)


def test_scintillation_saturates_and_averages_over_targets() -> None:
    found = [scintillation_index(cn2, 20e3, 1e-6) for cn2 in (1e-15, 1e-13, 1e-9, 1e-3)]
    assert max(found) < 2
    assert found[-1] == pytest.approx(1, abs=0.02)
    assert scintillation_index(1e-13, 2000.0, 4e-6, size_m=10.0) < 1e-3 * scintillation_index(1e-13, 2000.0, 4e-6)


def test_tilt_has_its_strength_and_correlation() -> None:
    """rho(t) is the mean of cos(2 pi f t) over the spectrum: slow drift and quick shaking."""
    air = Turbulence(cn2=1e-13, aperture_m=0.1, wind_m_s=2.0)
    draws = np.stack([air.tilt_angles(np.array([0.0, 1.0, 6.0]), "mwir", 60.0, seed) for seed in range(1200)])
    for axis in (0, 1):
        share = np.sum(draws[:, 0, axis] ** 2) / air.tilt_rms("mwir") ** 2
        assert stats.chi2(1200).ppf(1e-4) < share < stats.chi2(1200).ppf(1 - 1e-4)
    assert not draws[..., 2].any()
    assert abs(stats.pearsonr(draws[:, 0, 0], draws[:, 0, 1])[0]) < 0.12
    hertz = tilt_hertz((np.arange(200_000) + 0.5) / 200_000, TILT_KNEE * 2.0 / 0.1)
    for k, seconds in ((1, 1 / 60), (2, 0.1)):
        expected = np.cos(2 * np.pi * hertz * seconds).mean()
        found = stats.pearsonr(draws[:, 0, 0], draws[:, k, 0])[0]
        assert abs(np.arctanh(found) - np.arctanh(expected)) < 4 / math.sqrt(1200)


def test_a_frame_of_tilt_alone_is_that_in_sequence() -> None:
    air = Turbulence(cn2=1e-13)
    ordered = air.tilt_angles(np.arange(50.0), "lwir", 25.0, 7)
    assert np.array_equal(air.tilt_angles(np.array([31.0]), "lwir", 25.0, 7)[0], ordered[31])
    still = Turbulence(cn2=1e-13, wind_m_s=0).tilt_angles(np.arange(5.0), "lwir", 25.0, 7)
    assert np.ptp(still, axis=0).max() == 0


def test_scintillation_is_log_normal_and_follows_the_wind() -> None:
    """Correlation exp(-t^2 / (2 T^2)) of the logarithm, T = sqrt(lambda L) / v = 0.1095 m / 3 m/s."""
    air, n = Turbulence(cn2=2e-15, aperture_m=0.02), 1500
    seconds = 0.8 * math.sqrt(4e-6 * 3000) / 3.0
    factors = np.array(
        [[air.scintillation(f"t{k}", t, 3000.0, 0.05, "mwir", 1) for t in (1.0, 1.0 + seconds)] for k in range(n)]
    )
    index, logs = scintillation_index(2e-15, 3000.0, 4e-6, 0.02, 0.05), np.log(factors)
    assert 0.02 < index < 0.2
    assert abs(factors[:, 0].mean() - 1) < 4 * math.sqrt(index / n)
    assert logs[:, 0].std() / math.sqrt(math.log1p(index)) == pytest.approx(1, abs=4 / math.sqrt(2 * n))
    assert logs[:, 0].mean() == pytest.approx(-math.log1p(index) / 2, abs=4 * math.sqrt(index / n))
    found = stats.pearsonr(logs[:, 0], logs[:, 1])[0]
    assert abs(np.arctanh(found) - np.arctanh(math.exp(-0.32))) < 4 / math.sqrt(n)


def scene(turbulence: dict[str, Any], shape: str = "point", **other: Any) -> Scenario:
    value: dict[str, Any] = {
        "frames": 30,
        "camera": {"size": (96, 64), "netd_mk": 0.0, "ifov_mrad": 0.1},
        "atmosphere": {"turbulence": turbulence},
        "background": {"kind": "sky", "horizon_k": 20.0, "zenith_k": 20.0},
        "targets": [
            {
                "id": "one",
                "shape": {"kind": shape, "temperature_k": 400.0},
                "path": {"kind": "straight", "start": (48.0, 32.0), "speed": 0.0, "range_m": 3000.0},
            }
        ],
        **other,
    }
    return Scenario.model_validate(value)


STRONG = {"cn2": 1e-13, "path_m": 5000.0, "aperture_m": 0.1}


def centroid(light: Floats) -> Floats:
    y, x = np.indices(light.shape)
    total = light.sum(dtype=np.float64)
    return np.asarray(np.array([(x * light).sum(dtype=np.float64), (y * light).sum(dtype=np.float64)]) / total)


def test_truth_follows_the_wandering_picture() -> None:
    renderer = Renderer(scene(STRONG))
    centers = []
    for index in (0, 9, 21):
        light, truth = renderer.scene(index)
        assert truth.targets[0].center == pytest.approx(centroid(light), abs=0.01)
        centers.append(truth.targets[0].center)
    tilts = renderer.context.air.turbulence.tilt_angles(np.arange(30.0), "mwir", 30.0, 0) / 1e-4
    for index, center in zip((0, 9, 21), centers, strict=True):
        assert center == pytest.approx((48 - tilts[index, 0], 32 + tilts[index, 1]), abs=1e-3)


def test_points_scintillate_and_bodies_do_not() -> None:
    spreads = {}
    for shape in ("point", "fighter"):
        renderer = Renderer(scene({**STRONG, "cn2": 1e-14}, shape))
        totals = [float(renderer.scene(index)[0].sum(dtype=np.float64)) for index in range(0, 30, 6)]
        spreads[shape] = np.std(totals) / np.mean(totals)
    assert spreads["point"] > 0.05
    assert spreads["fighter"] < 0.01


def test_still_air_and_switched_off_change_no_pixel() -> None:
    none = Renderer(scene({})).scene(3)[0]
    for still in (scene({"cn2": 0.0, "aperture_m": 0.3}), scene(STRONG, without=["turbulence"])):
        assert np.array_equal(Renderer(still).scene(3)[0], none)
