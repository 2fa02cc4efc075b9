"""A camera that follows a target."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from irsim.config.base import Name
from irsim.config.quantities import NotNegative, Pair
from irsim.errors import InputError
from irsim.geometry.context import SceneContext
from irsim.motion.base import Pointing
from irsim.types import Floats


class Tracks(Pointing):
    """Turns so that a target stays at a place in the picture, a while behind it; other motions come on top.

    It looks where the target was `lag_s` ago, from where the camera is: a target at a steady angular
    rate is seen that much ahead of its place.
    """

    target: Name
    """Id of the target; switched off with --without it is followed all the same."""
    place_px: Pair | None = None
    """[x, y] where it is kept, px; the middle of the picture where not given."""
    lag_s: NotNegative = 0.0
    """How far the camera is behind, s."""

    def refers(self) -> Mapping[str, str]:
        return {"target": self.target}

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        if context.cast is None:
            raise InputError(f"there is no target '{self.target}' to look at; allowed: a target of the scenario")
        frames = np.asarray(frames, dtype=np.float64)
        seen = context.cast.way(self.target, frames - self.lag_s * context.rate_hz, context)
        seen = seen - context.cast.standpoints(frames, context)
        geometry = context.geometry
        world = seen @ geometry.rotation(np.zeros(3)).T @ geometry.world_rotation(np.zeros(3))
        azimuth, elevation = _angles(world)
        place = geometry.principal if self.place_px is None else np.asarray(self.place_px)
        # Where the first lens would see what the zoomed one of each frame sees at the place.
        nearer = 1 - 1 / context.cast.zooms(frames, context)
        directions = geometry.directions(place + nearer[:, None] * (geometry.principal - place))
        aside, above = _angles(directions)
        # The place's own direction from the axis: exact at the axis, and off it within a level camera's
        # second order; three rounds of what is left over make it exact anywhere in the picture.
        turns = np.stack([azimuth - aside, elevation - above - geometry.elevation_rad, np.zeros(len(frames))], axis=-1)
        turns[:, 0] = np.unwrap(turns[:, 0])
        for _ in range(3):
            rotations = np.stack([geometry.world_rotation(turn) for turn in turns])
            now = _angles(np.einsum("nji,nj->ni", rotations, directions))
            turns[:, 0] += _near(azimuth - now[0])
            turns[:, 1] += elevation - now[1]
        return turns


def _angles(vectors: Floats) -> tuple[Floats, Floats]:
    """Azimuth to the right and elevation upwards, rad, of vectors (n, 3) x right, y down, z ahead."""
    x, y, z = vectors.T
    return np.arctan2(x, z), np.arctan2(-y, np.hypot(x, z))


def _near(angles: Floats) -> Floats:
    """The same angles within half a turn of 0."""
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)
