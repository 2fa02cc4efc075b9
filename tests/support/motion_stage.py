"""Scene context with another target, and paths in it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion import PATHS, Path, SceneMotion
from irsim.types import Floats

GEOMETRY = Geometry((160, 120), 5e-4, 0.1)
RATE = 30.0
"""Frames per second."""
LEADER: dict[str, Any] = {"kind": "weave", "start": [20, 40], "speed": 1.0, "amplitude_px": 5.0, "heading_deg": 20.0}


def context(seed: int = 0) -> SceneContext:
    """Return a context with one target, `leader`, to which paths may refer."""
    return SceneContext(seed, GEOMETRY, RATE, "mwir", 0.6, SceneMotion({"leader": path(**LEADER)}, ()))


def path(**keys: Any) -> Path:
    value = PATHS.parse(keys)
    assert isinstance(value, Path)
    return value


def world(value: Path, frames: npt.ArrayLike, scene: SceneContext) -> Floats:
    """Return positions (n, 3) m: east, north, up."""
    found = value.positions(np.asarray(frames, dtype=float), scene, "jet")
    return np.asarray(found @ np.stack(level_axes(), axis=-1))


def level_axes() -> tuple[Floats, Floats, Floats]:
    """Return east, north and up in the first camera frame, which is lifted by 0.1 rad."""
    c, s = np.cos(0.1), np.sin(0.1)
    return np.array([1.0, 0, 0]), np.array([0, s, c]), np.array([0, -c, s])
