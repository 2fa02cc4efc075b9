"""A least-squares fit to noisy frames reaches the Cramér-Rao bound of their moments."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from quiet_scenes import small as scene

from irsim.render.frame import Renderer
from irsim.render.moments import Exact, Moments

DRAWS = 2000


@pytest.mark.parametrize(
    ("shape", "optics"),
    [({"kind": "point", "area_m2": 0.5, "temperature_k": 400.0}, {"f_number": 4.0}), ({"kind": "fighter"}, None)],
)
def test_a_least_squares_fit_reaches_the_cramer_rao_bound(shape: dict[str, Any], optics: Any) -> None:
    """Least squares for place and amplitude of the rendered target, 20 times the noise, in 2,000 noisy frames.

    The Fisher information of independent Gaussian pixels is J^T diag(1/variance) J, J the derivatives of
    the mean (Kay, Fundamentals of Statistical Signal Processing, vol. 1, ch. 3). A standard deviation of
    2,000 draws is known to 1.6 %.
    """
    target = dict(shape)
    camera = {"optics": optics, "psf_px": 0.6 if optics is None else 0.3, "range_k": (200.0, 900.0)}
    peak = np.abs(Moments(scene(target, camera=camera)).contribution(0, "one")).max()
    response = scene(target, camera=camera).camera.response()
    # The camera's noise is set so that the target's peak is 20 times as high.
    netd = scene(target).camera.netd_mk * peak / 20 / response.noise
    scenario = scene(target, DRAWS, camera={**camera, "netd_mk": float(netd)})
    moments = Moments(scenario)
    variance, mean = moments.variance(0), moments.mean(0)
    assert np.abs(moments.contribution(0, "one")).max() / np.sqrt(np.median(variance)) == pytest.approx(20, rel=0.03)

    def drawn(x: float, y: float) -> Exact:
        return moments.contribution(0, "one", (x, y)).ravel()

    step, own = 0.01, drawn(0, 0)
    along, down = ((drawn(*at) - drawn(*(-a for a in at))) / (2 * step) for at in ((step, 0.0), (0.0, step)))
    second = [
        (drawn(step, 0) + drawn(-step, 0) - 2 * own) / step**2,
        (drawn(step, step) + drawn(-step, -step) - drawn(step, -step) - drawn(-step, step)) / (4 * step**2),
        (drawn(0, step) + drawn(0, -step) - 2 * own) / step**2,
    ]
    weight = 1 / variance.ravel()
    jacobian = np.stack([along, down, own], axis=1)
    bound = np.sqrt(np.diag(np.linalg.inv((jacobian.T * weight) @ jacobian)))

    renderer = Renderer(scenario)
    light = renderer.light(0)  # of all frames: the target stands
    images = np.stack([renderer.sensor.expose(light, index).ravel() for index in range(DRAWS)])
    residuals: Exact = images.astype(np.float64) - mean.ravel()
    found = np.zeros((DRAWS, 3))  # x, y, amplitude less one
    for _ in range(4):  # Gauss-Newton; within a few hundredths of a pixel the second order is exact enough
        x, y, more = found.T[:, :, None]
        shape_ = own + x * along + y * down + x**2 / 2 * second[0] + x * y * second[1] + y**2 / 2 * second[2]
        left = residuals - ((1 + more) * shape_ - own)
        across = along + x * second[0] + y * second[1]
        upright = down + x * second[1] + y * second[2]
        slopes = np.stack([(1 + more) * across, (1 + more) * upright, shape_], axis=1)
        normal = np.einsum("dip,djp,p->dij", slopes, slopes, weight, optimize=True)
        right = np.einsum("dip,dp,p->di", slopes, left, weight, optimize=True)
        found += np.linalg.solve(normal, right[..., None])[..., 0]
    np.testing.assert_allclose(found.std(axis=0, ddof=1), bound, rtol=0.05)
    assert np.all(np.abs(found.mean(axis=0)) < 4 * bound / np.sqrt(DRAWS))
