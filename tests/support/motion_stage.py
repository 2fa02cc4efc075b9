"""A stage with another target, and paths on it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion import PATHS, Path, SceneMotion
from irsim.types import Floats

GEOMETRY = Geometry((160, 120), 5e-4, 0.1)
LEADER: dict[str, Any] = {"kind": "weave", "start": [20, 40], "speed": 1.0, "amplitude_px": 5.0, "heading_deg": 20.0}


def context(seed: int = 0) -> SceneContext:
    """With one other target, `leader`, that the paths under test may refer to."""
    return SceneContext(seed, GEOMETRY, 30.0, "mwir", 0.6, SceneMotion({"leader": path(**LEADER)}, ()))


def path(**keys: Any) -> Path:
    value = PATHS.parse(keys)
    assert isinstance(value, Path)
    return value


def pixels(value: Path, frames: npt.ArrayLike, seed: int = 0) -> Floats:
    return GEOMETRY.project(value.positions(np.asarray(frames, dtype=float), context(seed), "jet"))


def level_axes() -> tuple[Floats, Floats, Floats]:
    """East, north and up in the first camera frame: it is lifted by 0.1 rad about the axis to its right."""
    c, s = np.cos(0.1), np.sin(0.1)
    return np.array([1.0, 0, 0]), np.array([0, s, c]), np.array([0, -c, s])
