"""What a carried camera sees of that which stands all around its first place, painted as it is seen from there."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from irsim.backgrounds.base import Place, ViewDirection
from irsim.backgrounds.chart import unwrapped
from irsim.backgrounds.painting import Painting
from irsim.types import Floats


class Shell(Protocol):
    """What stands all around the first place, without a gap, and is seen from within only."""

    @property
    def range_m(self) -> float: ...

    def from_first(self, azimuth: Floats, elevation: Floats, place: Place) -> tuple[Floats, Floats]:
        """How much farther to the right, and at which elevation, the first place sees the point of the shell that a
        camera at a `place` within it sees at an azimuth and an elevation, rad."""
        ...

    def holds(self, place: Place) -> bool:
        """Is a camera at that place within it?"""
        ...


@dataclass(frozen=True)
class Cylinder:
    """An upright wall of radius `range_m`, as trees and buildings stand: a `Shell`.

    A camera at (x, y, z) m right, below and ahead of the first place, within the cylinder, looks along azimuth a and
    elevation e. Its ray passes the first place's axis at p = x cos a - z sin a and meets the cylinder
    after rho = sqrt(R^2 - p^2) - x sin a - z cos a, on the level. So the first place sees that point at
    the azimuth a + asin(p/R) and at the elevation whose tangent is (rho tan e - y) / R.
    """

    range_m: float

    def from_first(self, azimuth: Floats, elevation: Floats, place: Place) -> tuple[Floats, Floats]:
        (x, y, z), range_m = place, self.range_m
        off = np.clip((x * np.cos(azimuth) - z * np.sin(azimuth)) / range_m, -1, 1)
        along = range_m * np.sqrt(1 - off**2) - x * np.sin(azimuth) - z * np.cos(azimuth)
        return np.arcsin(off), np.arctan((along * np.tan(elevation) - y) / range_m)

    def holds(self, place: Place) -> bool:
        right, _, ahead = place
        return math.hypot(right, ahead) < self.range_m


@dataclass(frozen=True)
class Sphere:
    """What is `range_m` away in all directions, as clouds are: a `Shell`.

    A camera at c, within the sphere, looks along the unit vector r, which leaves the sphere after
    t = sqrt((c r)^2 + R^2 - c^2) - c r. The first place sees that point in the direction of c + t r. Here c and r are
    taken apart to the right of the azimuth looked along, along it, and down.
    """

    range_m: float

    def from_first(self, azimuth: Floats, elevation: Floats, place: Place) -> tuple[Floats, Floats]:
        (x, y, z), range_m = place, self.range_m
        right, along = x * np.cos(azimuth) - z * np.sin(azimuth), x * np.sin(azimuth) + z * np.cos(azimuth)
        gone = along * np.cos(elevation) - y * np.sin(elevation)
        left = np.sqrt(np.maximum(gone**2 + range_m**2 - (x**2 + y**2 + z**2), 0)) - gone
        ahead, up = along + left * np.cos(elevation), left * np.sin(elevation) - y
        return np.arctan2(right, ahead), np.arctan2(up, np.hypot(right, ahead))

    def holds(self, place: Place) -> bool:
        return math.hypot(*place) < self.range_m


def seen_from(view_direction: ViewDirection, shell: Shell) -> ViewDirection:
    """The pointing from the first place that sees what this one sees of a shell; the same where nothing has moved."""
    key = None if view_direction.key is None else seen_from(view_direction.key, shell)
    if not any(view_direction.place):
        return view_direction if key is view_direction.key else replace(view_direction, key=key)
    chart = view_direction.chart
    unit = chart.geometry.ifov_rad
    squeeze = np.cos(chart.geometry.elevation_rad)
    azimuth, elevation = chart.u * unit / squeeze, chart.elevation_rad(chart.v)
    turn, first_elevation = shell.from_first(azimuth, elevation, view_direction.place)
    u = unwrapped(azimuth + turn) * squeeze / unit
    v = (chart.geometry.elevation_rad - first_elevation) / unit
    return replace(view_direction, chart=replace(chart, uv=np.stack([u, v])), key=key)


def is_left_behind(view_direction: ViewDirection, shell: Shell) -> bool:
    """Whether a camera has gone through a shell: from without it is not drawn."""
    places = [view_direction.place] if view_direction.key is None else [view_direction.place, view_direction.key.place]
    return not all(map(shell.holds, places))


def unhidden(view_direction: ViewDirection) -> tuple[Floats, Floats]:
    """Transmittance and emission, (rows, cols) float32, of what is not there."""
    columns, rows = view_direction.chart.geometry.size
    return np.ones((rows, columns), np.float32), np.zeros((rows, columns), np.float32)


@dataclass(frozen=True, eq=False)
class Standing:
    """A layer that stands all around: transmittance and emission, and parallax where the camera has moved."""

    name: str
    shell: Shell
    painting: Painting

    @property
    def range_m(self) -> float:
        return self.shell.range_m

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        if is_left_behind(view_direction, self.shell):
            return unhidden(view_direction)
        transmittance, emission = self.painting.seen(seen_from(view_direction, self.shell))
        return transmittance, emission
