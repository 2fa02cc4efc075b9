"""Posterior Cramér-Rao bound of the place of a target that one sensor sees."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats
from irtrack.errors import InputError
from irtrack.filters.multiple_model import Model
from irtrack.points.world import World


def posterior_bound(world: World, model: Model) -> Floats:
    """Return the least root mean square error of place (K,) px that any filter can have, over runs drawn from a model.

        J_{k+1} = (Q + F J_k^-1 F')^-1 + E[H' R^-1 H] I

    with I the Fisher information of the glint noise over that of N(0, R) (P. Tichavsky, C. Muravchik, A. Nehorai,
    "Posterior Cramer-Rao bounds for discrete-time nonlinear filtering", IEEE Trans. Signal Processing 46(5), 1998,
    eq. 36 to 38). The expectation is the mean over the runs. InputError for a sensor that misses or has false plots.
    """
    sensor = world.sensor
    if sensor.detection_probability < 1 or sensor.false_plots > 0:
        raise InputError("posterior bound: a sensor with missed or false plots; allowed: neither")
    H = sensor.jacobian(world.states[..., :2] - world.observer)
    gained = np.einsum("rkmi,m,rkmj->kij", H, 1 / sensor.variances, H) / len(H) * sensor.glint_information
    J: Floats = np.diag(1 / world.start_sd**2)
    least = []
    for k in range(world.states.shape[1]):
        if k:
            J = np.linalg.inv(model.Q + model.F @ np.linalg.inv(J) @ model.F.T)
            J[:2, :2] += gained[k]
        least.append(np.sqrt(np.trace(np.linalg.inv(J)[:2, :2])))
    return np.array(least)
