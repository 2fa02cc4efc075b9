"""Small scenes of one target before an even sky, for truth and for moments."""

from __future__ import annotations

from typing import Any

from mesh_files import GIVEN

from irsim.scenario.model import Scenario

DARK = 20.0
"""Temperature of a sky, K, so cold that it gives no light beside a target: all light is the target's own."""


def standing(frames: int = 4, shape: str = "fighter", x: float = 80.0, y: float = 60.0, **other: object) -> Scenario:
    """Return a scenario of a static target in a noiseless picture of 160x120 px."""
    path = {"kind": "straight", "start": (x, y), "speed": 0.0, "range_m": 1500.0}
    shape_keys = dict(GIVEN.get(shape, {}), kind=shape)
    value: dict[str, object] = {
        "frames": frames,
        "camera": {"size": (160, 120), "netd_mk": 0.0},
        "background": {"kind": "sky", "horizon_k": DARK, "zenith_k": DARK},
        "targets": [{"id": "one", "shape": shape_keys, "path": path, "attitude_deg": (30.0, 20.0, 40.0)}],
        **other,
    }
    return Scenario.model_validate(value)


SMALL_PATH = {"kind": "straight", "start": (15.3, 15.8), "speed": 0.0, "range_m": 3000.0}
"""Path of the target of `small`."""


def small(shape: dict[str, Any] | None = None, frames: int = 4, **other: Any) -> Scenario:
    """Return a scenario of a static point, or another shape, in a noisy picture of 32x32 px of 16 bits."""
    camera = {"size": (32, 32), "range_k": (280.0, 320.0), "bits": 16, **other.pop("camera", {})}
    return Scenario.model_validate(
        {
            "frames": frames,
            "camera": camera,
            "background": {"kind": "sky", "horizon_k": 290.0, "zenith_k": 285.0},
            "targets": [{"id": "one", "shape": shape or {"kind": "point", "area_m2": 0.3}, "path": SMALL_PATH}],
            **other,
        }
    )
