"""Sums along paths through the air, by places on them that stand close together near the camera."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from irsim.types import Floats


@lru_cache
def shares(steps: int) -> Floats:
    """Places along a path of length 1, close together near the camera. Read only."""
    places = np.linspace(0, 1, steps + 1) ** 2
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
