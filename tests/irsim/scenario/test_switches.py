"""What is switched off is gone, and nothing else changes: the scene is, bit for bit, that without it."""

from __future__ import annotations

import copy
import json
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from mesh_files import GIVEN

import irsim
from irsim.backgrounds import BACKGROUNDS, Background, Recorded
from irsim.camera.detectors import NOISES
from irsim.camera.frame_loss import FAULTS
from irsim.motion import CAMERA_MOTIONS
from irsim.occluders import OCCLUDERS
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario
from irsim.targets import SHAPES

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
    """A scene with one of everything that has a name: all kinds of targets before a clear sky, or else three, clouds
    and a slower camera."""
    shapes = [kind for kind, _ in SHAPES]
    value = _with(shapes if bodies else shapes[:3])
    if bodies:
        value["camera"] = {key: item for key, item in value["camera"].items() if key not in SLOW}
        value["background"]["clouds"] = []
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
SETTINGS = {name for name, _ in Scenario.model_validate(everything()).settings()}  # see test_switches_settings.py
OTHERS = [name for name, _ in Scenario.model_validate(everything()).names() if name not in {*BODIES, *SETTINGS}]


def test_every_kind_is_there() -> None:
    assert {f"noise_{kind}" for kind, _ in NOISES} <= set(OTHERS)
    assert {kind for kind, _ in OCCLUDERS} <= set(OTHERS)
    assert {"optics", "smear", "lag", "falloff", "bloom", "correction", "atmosphere", "turbulence"} <= set(OTHERS)


@pytest.mark.sampled
@pytest.mark.parametrize("name", [*BODIES, *OTHERS])
def test_switched_off_is_the_scene_without_it(name: str) -> None:
    scene = everything(bodies=name in BODIES)
    off = Rendering(Scenario.model_validate({**scene, "without": [name]}))
    less = Rendering(Scenario.model_validate(lacking(scene, name)))
    assert name not in [each for each, _ in less.scenario.names()]
    (frame, truth), (expected, wanted) = (next(iter(each.pairs(1, 2))) for each in (off, less))
    assert np.array_equal(frame.image, expected.image)
    assert truth == wanted


CLOUDS = [{"id": "cirrus"}]
LANDS: dict[str, dict[str, Any]] = {
    "sky": {"clouds": [*CLOUDS, {"id": "low", "coverage": 0.4}]},
    "ground": {"fields": {}, "roads": {"count": 9}, "water": {"share": 0.4}, "clutter": {"per_mrad2": 0.01}},
    "landscape": {
        "far_woods_mrad": 1.5,  # which stay where rows of trees are off
        "clouds": CLOUDS,
        "trees": [{"range_m": 2000.0}],
        "buildings": [{"range_m": 1500.0, "spacing_m": 30.0}],
    },
    "sea": {"clouds": CLOUDS},
}
COUNTRY = {"kind": "landscape", **LANDS["ground"]}
"""A landscape again, with all that lies on its ground and nothing that stands on it."""
MOTIONS: dict[str, dict[str, Any]] = {
    "pan": {"azimuth_deg_s": 0.4},
    "zoom": {"factors": [(0.0, 1.0), (3.0, 1.5)]},
    "platform": {"velocity_m_s": (40.0, 0.0, 0.0)},
    "tracks": {"target": "jet"},
}
FAULTY: dict[str, dict[str, Any]] = {"drop": {"frames": [1]}, "duplicate": {"frames": [2]}}


def before(background: dict[str, Any], moving: bool = False) -> dict[str, Any]:
    """A scene before a background, with every kind of camera motion and of fault where it is `moving`."""
    path = {"kind": "straight", "start": (20.0, 30.0), "speed": 2.0, "range_m": 900.0}
    return {
        "frames": 4,
        "camera": {
            "size": (80, 64),
            "noise": [{"kind": "white"}],
            "motion": [{"kind": kind, **MOTIONS.get(kind, {})} for kind, _ in CAMERA_MOTIONS] if moving else [],
            "faults": [{"kind": kind, **FAULTY[kind]} for kind, _ in FAULTS] if moving else [],
        },
        "background": background,
        "targets": [{"id": "jet", "shape": {"kind": "point", "area_m2": 2.0}, "path": path}],
    }


def landless(scene: dict[str, Any], name: str) -> dict[str, Any]:
    """The same scene without the part of that name of its background or camera."""
    value = copy.deepcopy(scene)
    background, camera = value["background"], value["camera"]
    for key in ("clouds", "trees", "buildings"):
        if key in background:
            background[key] = [part for part in background[key] if part.get("id", key) != name]
    background.pop(name, None)
    for key in ("motion", "faults"):
        camera[key] = [part for part in camera[key] if part["kind"] != name]
    return value


LYING = [
    (scene, name)
    for scene in map(before, [*({"kind": kind, **keys} for kind, keys in LANDS.items()), COUNTRY])
    for name, _ in Scenario.model_validate(scene).background.names()
]
CARRIED = [(before({"kind": "ground"}, moving=True), kind) for family in (CAMERA_MOTIONS, FAULTS) for kind, _ in family]


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("scene", "name"),
    [pytest.param(*each, id=f"{each[0]['background']['kind']}-{each[1]}") for each in [*LYING, *CARRIED]],
)
def test_what_backgrounds_and_cameras_do_is_switched_off_as_if_never_there(scene: dict[str, Any], name: str) -> None:
    off, less = (
        list(Rendering(Scenario.model_validate(value)).pairs())
        for value in ({**scene, "without": [name]}, landless(scene, name))
    )
    assert [truth for _, truth in off] == [truth for _, truth in less]
    assert all(np.array_equal(a.image, b.image) for (a, _), (b, _) in zip(off, less, strict=True))
    assert [(frame.time, frame.image.tobytes()) for frame, _ in off] != _shown(json.dumps(scene))


@lru_cache
def _shown(scene: str) -> list[tuple[float, bytes]]:
    """Times and pictures with nothing switched off."""
    frames = Rendering(Scenario.model_validate_json(scene)).frames()
    return [(frame.time, frame.image.tobytes()) for frame in frames]


def test_every_kind_of_background_is_there() -> None:
    """But for footage, which is one whole: nothing of it has a name."""
    assert Recorded.names is Background.names
    assert {*LANDS, "recording"} == {kind for kind, _ in BACKGROUNDS}


ASKING = """
frames: 2
camera:
  size: [160, 120]
  ifov_mrad: 0.3
  netd_mk: 200
  noise: [{kind: white}, {kind: fixed_pattern, pixel: 1}]
background: {kind: ground, spread_k: 0.1, fields: {}}
targets:
  - {id: near, shape: {kind: point, scr: 12}, path: {kind: straight, start: [80, 60], range_m: 1200}}
  - {id: far, shape: {kind: point, contrast_k: 2}, path: {kind: straight, start: [96, 60], range_m: 1500}}
"""


@pytest.mark.parametrize("name", ["white", "fixed_pattern"])
def test_a_point_that_asks_for_an_scr_keeps_its_light_without_noise(name: str) -> None:
    scenario = irsim.loads(ASKING)
    whole, less = irsim.Moments(scenario), irsim.Moments(scenario, without=[name])
    for target in ("near", "far"):
        np.testing.assert_array_equal(less.contribution(0, target), whole.contribution(0, target))


def test_a_point_that_asks_for_an_scr_keeps_its_light_without_what_is_behind_it() -> None:
    """What differs is what the point replaces: (1 - alpha) of what the ground differs by, alpha being at most 1."""
    scenario = irsim.loads(ASKING)
    whole, less = irsim.Moments(scenario), irsim.Moments(scenario, without=["fields"])
    behind = whole.mean(0) - whole.contribution(0, "near") - (less.mean(0) - less.contribution(0, "near"))
    passed = (whole.mean(0) - less.mean(0))[56:65, 76:85] / behind[56:65, 76:85]
    assert np.abs(behind[56:65, 76:85]).min() > 10  # counts: fields are seen there
    assert -1e-6 < passed.min() < 0.8
    assert passed.max() < 1 + 1e-6


def test_a_target_left_out_changes_no_other() -> None:
    """The other one's ring holds it: asked again without it, the other would change."""
    added = irsim.Moments(irsim.loads(ASKING)).contribution(0, "far")
    assert np.abs(added[55:66, 90:103]).max() > 10
    np.testing.assert_array_equal(added[50:71, 70:90], 0)
