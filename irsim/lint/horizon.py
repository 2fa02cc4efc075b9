"""Targets that a round earth would hide: ground and sea are planes, on which everything is seen however far away."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from irsim.errors import Notice
from irsim.lint.looked import existing, watched
from irsim.physics.atmosphere import EARTH_KM
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import LOOKED
from irsim.types import Floats

BENT = 1 / 7
"""Curvature of a level ray in standard air, in that of the earth (A. T. Young, Distance to the Horizon, aty.sdsu.edu):
horizons are 3.86 km sqrt(height in m) away, 3.57 km without air."""


def horizon_km(height_m: Floats) -> Floats:
    """(n,) how far away the horizon is from heights (n,) above a round earth, in standard air."""
    return np.asarray(np.sqrt(2 * EARTH_KM / (1 - BENT) * np.maximum(height_m, 0.0) * 1e-3))


def beyond_horizon(scenario: Scenario) -> Iterator[Notice]:
    """Targets whose middle would be below the horizon, where the background says how high the camera is."""
    context, objects, level = scenario.context, scenario.context.objects, scenario.background.surface_m
    if level is None or objects is None:
        return
    looked = watched(scenario.frames, LOOKED)
    down = context.geometry.down
    for index, target in enumerate(scenario.targets):
        frames = existing(target, looked)
        if not len(frames):
            continue
        camera, places = objects.camera_positions(frames, context), target.path.positions(frames, context, target.id)
        eye_m, middle_m = np.maximum(level - camera @ down, 0.0), np.maximum(level - places @ down, 0.0)
        range_km = np.linalg.norm(places - camera, axis=1) * 1e-3
        seen_km = horizon_km(eye_m) + horizon_km(middle_m)
        if (range_km > seen_km).any():
            first = int(np.argmax(range_km > seen_km))
            yield Notice(
                ("targets", index, "path"),
                f"at frame {frames[first]:.0f} {target.id} is {range_km[first]:.3g} km away, and a round earth would "
                f"hide what is {middle_m[first]:.3g} m up beyond {seen_km[first]:.3g} km from a camera "
                f"{eye_m[first]:.3g} m up; the {scenario.background.surface} is flat and does not",
            )
