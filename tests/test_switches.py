"""What is switched off is gone, and nothing else changes: the scene is, bit for bit, that without it."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from mesh_files import GIVEN

from irsim.detector import NOISES
from irsim.occluders import OCCLUDERS
from irsim.scenario import Scenario
from irsim.shapes import SHAPES
from irsim.simulate import Rendering

NOISE: dict[str, dict[str, Any]] = {"ar1": {"rho": 0.8}, "noise_3d": {"t": 0.5, "v": 0.3, "th": 0.4}}
OCCLUDER: dict[str, dict[str, Any]] = {
    "bar": {"center_px": (40, 40), "size_px": (9, 50)},
    "pole": {"foot_px": (40, 60), "height_px": 40, "width_px": 4},
    "tree": {"foot_px": (40, 60), "height_px": 40, "crown_px": (20, 24)},
    "building": {"foot_px": (40, 60), "size_px": (24, 30)},
    "smoke": {"center_px": (40, 40), "size_px": (24, 20)},
}


SLOW = ("optics", "smear", "time_constant_ms")
"""What makes drawing many bodies slow."""


def everything(bodies: bool = False) -> dict[str, Any]:
    """A scene with one of everything that has a name: all kinds of targets, or else three and a slower camera."""
    shapes = [kind for kind, _ in SHAPES]
    value = _with(shapes if bodies else shapes[:3])
    if bodies:
        value["camera"] = {key: item for key, item in value["camera"].items() if key not in SLOW}
    return value


def _with(shapes: list[str]) -> dict[str, Any]:
    return {
        "frames": 3,
        "camera": {
            "size": (80, 64),
            "rate_hz": 30.0,
            "detector": {"kind": "electrons"},
            "time_constant_ms": 8.0,
            "noise": [{"kind": kind, "id": f"noise_{kind}", **NOISE.get(kind, {})} for kind, _ in NOISES],
            "motion": [{"kind": "pan", "azimuth_deg_s": 0.4}, {"kind": "jitter"}],
            "correction": {"period_frames": 50, "freeze_frames": 2},
            "falloff": {"vignetting": 0.2},
            "bloom": {},
            "optics": {"f_number": 2.0},
            "smear": {"time_ms": 10.0, "steps": 3},
        },
        "atmosphere": {"preset": "us_standard", "turbulence": {"cn2": 1e-14}},
        "background": {"kind": "sky", "preset": "us_standard", "clouds": [{"id": "near"}]},
        "targets": [
            {
                "id": kind,
                "shape": {"kind": kind, **GIVEN.get(kind, {})},
                "path": {"kind": "straight", "start": (10 + 4 * k, 20 + 6 * (k % 5)), "range_m": 900 + 80 * k},
            }
            for k, kind in enumerate(shapes)
        ],
        "occluders": [
            {"kind": kind, "id": kind, "range_m": 850.0 + 100 * k, **OCCLUDER[kind]}
            for k, (kind, _) in enumerate(OCCLUDERS)
        ],
    }


def lacking(scene: dict[str, Any], name: str) -> dict[str, Any]:
    """The same scene written down without the part of that name."""
    value = copy.deepcopy(scene)
    camera, sky = value["camera"], value["background"]
    for group in (value["targets"], value["occluders"], camera["noise"], camera["motion"], sky["clouds"]):
        group[:] = [part for part in group if name not in (part.get("id"), part.get("id") or part.get("kind"))]
    camera.pop(name, None)
    if name == "lag":
        del camera["time_constant_ms"]
    if name == "turbulence":
        del value["atmosphere"]["turbulence"]
    if name == "atmosphere":
        value["atmosphere"] = {"turbulence": value["atmosphere"]["turbulence"]}
    return value


BODIES = [kind for kind, _ in SHAPES]
OTHERS = [name for name, _ in Scenario.model_validate(everything()).names() if name not in BODIES]


def test_every_kind_is_there() -> None:
    assert {f"noise_{kind}" for kind, _ in NOISES} <= set(OTHERS)
    assert {kind for kind, _ in OCCLUDERS} <= set(OTHERS)
    assert {"optics", "smear", "lag", "falloff", "bloom", "correction", "atmosphere", "turbulence"} <= set(OTHERS)


@pytest.mark.parametrize("name", [*BODIES, *OTHERS])
def test_switched_off_is_the_scene_without_it(name: str) -> None:
    scene = everything(bodies=name in BODIES)
    off = Rendering(Scenario.model_validate({**scene, "without": [name]}))
    less = Rendering(Scenario.model_validate(lacking(scene, name)))
    assert name not in [each for each, _ in less.scenario.names()]
    (frame, truth), (expected, wanted) = (next(iter(each.pairs(1, 2))) for each in (off, less))
    assert np.array_equal(frame.image, expected.image)
    assert truth == wanted
