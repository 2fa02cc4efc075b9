"""The far wings of diffraction about points that are far brighter than a full well."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import j0, j1

from irsim.physics.diffraction import LensPSF, WingedLensPSF, with_wings
from irsim.physics.lens import Lens
from irsim.physics.psf import GaussianPSF
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario

LENSES = [Lens(f_number=4.0), Lens(f_number=1.5, defocus_px=3.0), Lens(f_number=2.0, pitch_um=20.0)]


def winged(lens: Lens) -> tuple[LensPSF, WingedLensPSF]:
    near = lens.psf("mwir", 0.3)
    far = with_wings(near, 1e-9)
    assert isinstance(far, WingedLensPSF)
    return near, far


@pytest.mark.parametrize("lens", LENSES)
def test_light_in_a_ring_far_out_is_rayleigh_s(lens: Lens) -> None:
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


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("shift", [0.0, 0.31, -0.5])
def test_all_light_is_drawn_and_no_edge_is_seen(lens: Lens, shift: float) -> None:
    """By r^-3 a step of 1 px makes 3 / r of what is there; rings are left of the cosines. The spread without wings ends
    within three pixels."""
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
    ending = near.pixel_integral(np.zeros(1), np.arange(reach - 4.0, reach + 1))[0]
    assert ending[-1] < 1e-9 * ending[0]


def test_only_what_shows_them_has_them() -> None:
    near = LENSES[0].psf("mwir", 0.3)
    assert with_wings(near, 1e-3) is near
    gaussian = GaussianPSF(0.7)
    assert with_wings(gaussian, 1e-12) is gaussian


@pytest.mark.parametrize(("area_m2", "wide"), [(0.15, True), (1e-4, False)])
def test_a_rocket_s_motor_has_wings_where_a_spark_has_none(area_m2: float, wide: bool) -> None:
    camera = {"preset": "cooled_mwir", "size": (161, 161), "optics": {"f_number": 4}, "psf_px": 0.2}
    path = {"kind": "straight", "start": (80, 80), "speed": 0, "range_m": 4000}
    motor = {"id": "motor", "shape": {"kind": "point", "temperature_k": 1800, "area_m2": area_m2}, "path": path}
    scene = Scenario.model_validate(
        {"camera": camera, "background": {"kind": "ground", "spread_k": 0}, "targets": [motor]}
    )
    light = Renderer(scene).scene(0)[0]
    reach = scene.context.psf.support_px
    assert (light[80, 80 + reach + 4] > light[0, 0]) == wide
