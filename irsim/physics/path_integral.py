"""Sums along paths through the air, by places on them that stand close together near both ends."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from irsim.types import Floats

_THIN = 1e-6
"""Optical depth of a step below which its mean transmittance is taken for that of its ends: the digits are lost."""


@lru_cache
def shares(steps: int) -> Floats:
    """Places along a path of length 1: as many steps from the camera as from the end, which may be near the ground,
    close together near each. Read only."""
    near = np.linspace(0, 1, steps + 1) ** 2
    places = np.unique(np.round([near, 1 - near], 12))  # 0.6^2 and 1 - 0.8^2 are one place
    places.setflags(write=False)
    return places


def _sums(steps: Floats) -> Floats:
    """Running sums along the last axis, from 0 on."""
    sums = np.zeros((*steps.shape[:-1], steps.shape[-1] + 1))
    np.cumsum(steps, axis=-1, out=sums[..., 1:])
    return sums


def amount(places: Floats, density: Floats) -> Floats:
    """(..., n) km: level path of density 1 that holds as much as each path up to its stations."""
    return _sums((density[..., 1:] + density[..., :-1]) * (places[..., 1:] - places[..., :-1]) / 2)


def below(places: Floats, heights: Floats, top_km: float) -> Floats:
    """(..., n) km: length of the path up to each station that lies below a height; heights run linearly between."""
    low = np.minimum(heights[..., 1:], heights[..., :-1])
    rise = np.abs(np.diff(heights))
    share = np.where(rise > 0, (top_km - low) / np.where(rise > 0, rise, 1.0), low < top_km)
    return _sums(np.clip(share, 0, 1) * np.diff(places))


def crossings(base: float, rise: Floats, radius: float) -> tuple[Floats, Floats]:
    """Places at which lines from a distance `base` of the Earth's middle, at a sine `rise` of their elevation, come
    within another distance and leave it; behind the camera below 0. Those that never do: where they come closest."""
    half = np.sqrt(np.maximum(radius**2 - base**2 * (1 - rise**2), 0.0))
    return -base * rise - half, -base * rise + half


def path_light(passed: Floats, depth: Floats, shining: Floats) -> Floats:
    """(...) what arrives of paths whose air shines as a black body does at each station, `shining`, linear in the
    optical depth between; up to each, `passed` is the transmittance and `depth` the optical depth."""
    before, after = passed[..., :-1], passed[..., 1:]
    deep = depth[..., 1:] - depth[..., :-1]
    thin = deep < _THIN
    between = np.where(thin, (before + after) / 2, (before - after) / np.where(thin, 1.0, deep))
    return np.asarray(np.sum(shining[..., :-1] * (before - between) + shining[..., 1:] * (between - after), axis=-1))
