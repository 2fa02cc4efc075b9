"""What a carried camera sees of that which stands all around its first place, painted as it is seen from there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from irsim.backgrounds.base import Gaze, Place
from irsim.types import Floats

Shell = Callable[[Floats, Floats, Place, float], tuple[Floats, Floats]]
"""Azimuth and elevation, rad, at which a camera looks; its place, m; the shell's radius, m -> how much farther to the
right, and at which elevation, the first place sees the same point of the shell, rad."""


def cylinder(azimuth: Floats, elevation: Floats, place: Place, range_m: float) -> tuple[Floats, Floats]:
    """An upright wall all around, as trees and buildings stand: a `Shell`.

    A camera at (x, y, z) m right, below and ahead of the first place, within the cylinder, looks along azimuth a and
    elevation e. Its ray passes the first place's axis at p = x cos a - z sin a and meets the cylinder
    after rho = sqrt(R^2 - p^2) - x sin a - z cos a, on the level. So the first place sees that point at
    the azimuth a + asin(p/R) and at the elevation whose tangent is (rho tan e - y) / R.
    """
    x, y, z = place
    off = np.clip((x * np.cos(azimuth) - z * np.sin(azimuth)) / range_m, -1, 1)
    along = range_m * np.sqrt(1 - off**2) - x * np.sin(azimuth) - z * np.cos(azimuth)
    return np.arcsin(off), np.arctan((along * np.tan(elevation) - y) / range_m)


def sphere(azimuth: Floats, elevation: Floats, place: Place, range_m: float) -> tuple[Floats, Floats]:
    """What is as far off in all directions, as clouds are: a `Shell`.

    A camera at c, within the sphere, looks along the unit vector r, which leaves the sphere after
    t = sqrt((c r)^2 + R^2 - c^2) - c r. The first place sees that point in the direction of c + t r. Here c and r are
    taken apart to the right of the azimuth looked along, along it, and down.
    """
    x, y, z = place
    right, along = x * np.cos(azimuth) - z * np.sin(azimuth), x * np.sin(azimuth) + z * np.cos(azimuth)
    gone = along * np.cos(elevation) - y * np.sin(elevation)
    left = np.sqrt(np.maximum(gone**2 + range_m**2 - (x**2 + y**2 + z**2), 0)) - gone
    ahead, up = along + left * np.cos(elevation), left * np.sin(elevation) - y
    return np.arctan2(right, ahead), np.arctan2(up, np.hypot(right, ahead))


def seen_from(gaze: Gaze, range_m: float, shell: Shell) -> Gaze:
    """The pointing from the first place that sees what this one sees of a shell; the same where nothing has moved."""
    key = None if gaze.key is None else seen_from(gaze.key, range_m, shell)
    if not any(gaze.place):
        return gaze if key is gaze.key else replace(gaze, key=key)
    chart = gaze.chart
    unit = chart.geometry.ifov_rad
    squeeze = np.cos(chart.geometry.elevation_rad)
    azimuth, elevation = chart.u * unit / squeeze, chart.elevation_rad(chart.v)
    turn, first_elevation = shell(azimuth, elevation, gaze.place, range_m)
    u = (azimuth + turn) * squeeze / unit
    v = (chart.geometry.elevation_rad - first_elevation) / unit
    return replace(gaze, chart=replace(chart, uv=np.stack([u, v])), key=key)


def is_left_behind(gaze: Gaze, range_m: float, shell: Shell) -> bool:
    """Whether a camera has gone through a shell: from without it is not drawn."""
    places = [gaze.place] if gaze.key is None else [gaze.place, gaze.key.place]
    return any(_gone(place, shell) >= range_m for place in places)


def _gone(place: Place, shell: Shell) -> float:
    """How far from the first place a place is, m, as a shell counts it."""
    right, _, ahead = place
    return math.hypot(right, ahead) if shell is cylinder else math.hypot(*place)


def unhidden(gaze: Gaze) -> tuple[Floats, Floats]:
    """Transmittance and emission, (rows, cols) float32, of what is not there."""
    columns, rows = gaze.chart.geometry.size
    return np.ones((rows, columns), np.float32), np.zeros((rows, columns), np.float32)
