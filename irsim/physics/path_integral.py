"""Integrals along paths through the air, at stations that are dense near both ends."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from irsim.types import Floats, read_only

_THIN = 1e-6
"""Optical depth of a step below which its mean transmittance is computed as the mean of the values at its ends: the
exact quotient would lose its digits."""


@lru_cache
def relative_stations(steps: int) -> Floats:
    """Return stations along a path of length 1, dense near both ends, with `steps` steps from each end. Read only."""
    near = np.linspace(0, 1, steps + 1) ** 2
    return read_only(np.unique(np.round([near, 1 - near], 12)))  # 0.6^2 and 1 - 0.8^2 differ by rounding only


def _running_sums(steps: Floats) -> Floats:
    """Return running sums along the last axis, from 0 on."""
    sums = np.zeros((*steps.shape[:-1], steps.shape[-1] + 1))
    np.cumsum(steps, axis=-1, out=sums[..., 1:])
    return sums


def equivalent_path(places: Floats, density: Floats) -> Floats:
    """Return the column of an absorber up to each station as the length of a path of density 1, km, (..., n)."""
    return _running_sums((density[..., 1:] + density[..., :-1]) * (places[..., 1:] - places[..., :-1]) / 2)


def length_below(places: Floats, heights: Floats, top_km: float) -> Floats:
    """Return the length of the path below height `top_km` up to each station, km, (..., n); heights are linear between
    stations."""
    low = np.minimum(heights[..., 1:], heights[..., :-1])
    rise = np.abs(np.diff(heights))
    share = np.where(rise > 0, (top_km - low) / np.where(rise > 0, rise, 1.0), low < top_km)
    return _running_sums(np.clip(share, 0, 1) * np.diff(places))


def sphere_crossings(base: float, rise: Floats, radius: float) -> tuple[Floats, Floats]:
    """Return distances, negative behind the camera, at which lines enter and leave a sphere about the Earth's centre.

    The lines start at a distance `base` from the centre, `rise` is the sine of their elevation. A line that misses the
    sphere gets its closest point twice.
    """
    half = np.sqrt(np.maximum(radius**2 - base**2 * (1 - rise**2), 0.0))
    return -base * rise - half, -base * rise + half


def path_radiance(transmittance: Floats, depth: Floats, blackbody: Floats) -> Floats:
    """Return the path radiance at the camera, W/m2/sr, (...).

    Arrays hold the values at the stations: transmittance and optical depth from the camera, and the black-body
    radiance of the air, linear in the optical depth between stations.
    """
    before, after = transmittance[..., :-1], transmittance[..., 1:]
    deep = depth[..., 1:] - depth[..., :-1]
    thin = deep < _THIN
    between = np.where(thin, (before + after) / 2, (before - after) / np.where(thin, 1.0, deep))
    return np.asarray(
        np.sum(blackbody[..., :-1] * (before - between) + blackbody[..., 1:] * (between - after), axis=-1)
    )
