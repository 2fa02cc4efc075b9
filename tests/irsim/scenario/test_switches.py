"""Parts and settings that are switched off: the scene is bit for bit that without them."""

from __future__ import annotations

import copy
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mesh_files import GIVEN

import irsim
from irsim.camera import FRAME_FAULTS, NOISES
from irsim.config.base import Part
from irsim.lint import lint
from irsim.motion import CAMERA_MOTIONS
from irsim.occluders import OCCLUDERS
from irsim.physics.atmosphere import Atmosphere
from irsim.render.stream import Rendering
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario
from irsim.targets import SHAPES
from irsim.types import Frame, Truth

NOISE: dict[str, dict[str, Any]] = {"ar1": {"rho": 0.8}, "noise_3d": {"t": 0.5, "v": 0.3, "th": 0.4}}
OCCLUDER: dict[str, dict[str, Any]] = {
    "bar": {"center_px": (40, 40), "size_px": (9, 50)},
    "pole": {"foot_px": (40, 60), "height_px": 40, "width_px": 4},
    "tree": {"foot_px": (40, 60), "height_px": 40, "crown_px": (20, 24)},
    "building": {"foot_px": (40, 60), "size_px": (24, 30)},
    "smoke": {"center_px": (40, 40), "size_px": (24, 20)},
}


def everything() -> dict[str, Any]:
    """Return a scene with one of everything that has a name, and three kinds of targets."""
    shapes = [kind for kind, _ in SHAPES][:3]
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
            "optics": {},
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
    """Return the same scene without the part of that name."""
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


SETTINGS = {name for name, _ in Scenario.model_validate(everything()).settings()}
NAMES = [name for name, _ in Scenario.model_validate(everything()).names() if name not in SETTINGS]


def test_every_kind_is_there() -> None:
    assert {f"noise_{kind}" for kind, _ in NOISES} <= set(NAMES)
    assert {kind for kind, _ in OCCLUDERS} <= set(NAMES)
    assert {"optics", "smear", "lag", "falloff", "bloom", "correction", "atmosphere", "turbulence"} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES[::6])
def test_switched_off_is_the_scene_without_it(name: str) -> None:
    off = Rendering(Scenario.model_validate({**everything(), "without": [name]}))
    less = Rendering(Scenario.model_validate(lacking(everything(), name)))
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
MOTIONS: dict[str, dict[str, Any]] = {
    "pan": {"azimuth_deg_s": 0.4},
    "zoom": {"factors": [(0.0, 1.0), (3.0, 1.5)]},
    "platform": {"velocity_m_s": (40.0, 0.0, 0.0)},
    "tracks": {"target": "jet"},
}
FAULTY: dict[str, dict[str, Any]] = {"drop": {"frames": [1]}, "duplicate": {"frames": [2]}}


def before(background: dict[str, Any], moving: bool = False) -> dict[str, Any]:
    """Return a scene before a background, if `moving` with every kind of camera motion and frame loss."""
    path = {"kind": "straight", "start": (20.0, 30.0), "speed": 2.0, "range_m": 900.0}
    return {
        "frames": 4 if moving else 1,
        "camera": {
            "size": (64, 48),
            "noise": [{"kind": "white"}],
            "motion": [{"kind": kind, **MOTIONS.get(kind, {})} for kind, _ in CAMERA_MOTIONS] if moving else [],
            "faults": [{"kind": kind, **FAULTY[kind]} for kind, _ in FRAME_FAULTS] if moving else [],
        },
        "background": background,
        "targets": [{"id": "jet", "shape": {"kind": "point", "area_m2": 2.0}, "path": path}],
    }


def landless(scene: dict[str, Any], name: str) -> dict[str, Any]:
    """Return the same scene without the part of that name of its background or camera."""
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
    for scene in map(before, ({"kind": kind, **keys} for kind, keys in LANDS.items()))
    for name, _ in Scenario.model_validate(scene).background.names()
]
CARRIED = [
    (before({"kind": "ground"}, moving=True), kind) for family in (CAMERA_MOTIONS, FRAME_FAULTS) for kind, _ in family
]


@pytest.mark.parametrize(
    ("scene", "name"),
    [pytest.param(*each, id=f"{each[0]['background']['kind']}-{each[1]}") for each in [*LYING[::6], *CARRIED[::4]]],
)
def test_background_parts_and_motions_switch_off(scene: dict[str, Any], name: str) -> None:
    off, less = (
        list(Rendering(Scenario.model_validate(value)).pairs())
        for value in ({**scene, "without": [name]}, landless(scene, name))
    )
    assert [truth for _, truth in off] == [truth for _, truth in less]
    assert all(np.array_equal(a.image, b.image) for (a, _), (b, _) in zip(off, less, strict=True))
    whole = Rendering(Scenario.model_validate(scene)).frames()
    assert [(frame.time, frame.image.tobytes()) for frame, _ in off] != [
        (frame.time, frame.image.tobytes()) for frame in whole
    ]


POINTS = """
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


def test_a_point_of_given_scr_keeps_its_radiance() -> None:
    """Its contribution depends neither on noise that is switched off nor on the other target."""
    scenario = irsim.loads(POINTS)
    whole = irsim.Moments(scenario)
    for name in ("white", "fixed_pattern"):
        less = irsim.Moments(scenario, without=[name])
        for target in ("near", "far"):
            np.testing.assert_array_equal(less.contribution(0, target), whole.contribution(0, target))
    added = whole.contribution(0, "far")
    assert np.abs(added[55:66, 90:103]).max() > 10
    np.testing.assert_array_equal(added[50:71, 70:90], 0)


SMALL = "camera: {size: [48, 32], ifov_mrad: 1, netd_mk: 20, noise: [{kind: white}, {kind: fixed_pattern}]}"
CAMERA_TEXT = SMALL.replace("[48, 32]", "[96, 64]")
LOW = "{id: low, coverage: 0.6, sunlit_k: 8, wind_mrad_s: [9, 0], correlation_mrad: 20}"
CLOUD_LIST = f"[{LOW}, {{id: haze, range_m: 9000}}]"
BODY_LIST = """
targets:
  - {id: gull, shape: {kind: bird}, path: {kind: straight, start: [20, 12], range_m: 60, speed: 1}}
  - {id: walker, shape: {kind: pedestrian}, path: {kind: straight, start: [40, 30], range_m: 60, speed: 1}}
  - {id: drone, shape: {kind: quadrotor}, path: {kind: straight, start: [60, 12], range_m: 30, speed: 1}}
  - {id: plane, shape: {kind: fixed_wing}, path: {kind: straight, start: [84, 12], range_m: 30, speed: 1}}
  - {id: heli, shape: {kind: helicopter}, path: {kind: straight, start: [70, 40], range_m: 600, speed: 1}}
  - {id: jet, shape: {kind: fighter, flicker: {kind: wave, hz: 5}}, spin_deg_s: [0, 0, 90],
     path: {kind: straight, start: [24, 50], range_m: 600, speed: 1}}
"""
SCENES = {
    "sky": f"frames: 2\n{SMALL}\nbackground: {{kind: sky, clouds: {CLOUD_LIST}}}",
    "bodies": f"""
frames: 2
{CAMERA_TEXT}
atmosphere: {{preset: us_standard, rain_mm_h: 3, fog_visibility_km: 2}}
background: {{kind: sky}}
{BODY_LIST}""",
    "landscape": f"frames: 1\n{SMALL}\natmosphere: {{preset: us_standard}}\nbackground: "
    "{kind: landscape, fields: {}, trees: [{id: wood, range_m: 400, relief_m: 2}]}",
    "town": f"frames: 1\n{SMALL}\nbackground: "
    "{kind: landscape, buildings: [{id: town, range_m: 200, spacing_m: 20, relief_m: 2}]}",
    "ground": f"frames: 1\n{SMALL}\nbackground: {{kind: ground, fields: {{}}, roads: {{}}}}",
    "sea": f"""
frames: 1
{CAMERA_TEXT}
background: {{kind: sea, gusts: 0.3, sun_deg: [0, 12], clouds: [{{id: low, sunlit_k: 8}}]}}
""",
    "camera": """
frames: 4
camera:
  size: [96, 64]
  ifov_mrad: 1
  noise:
    - {kind: noise_3d, t: 4, v: 4, h: 4, tv: 4, th: 4, vh: 4, tvh: 1}
    - {kind: fixed_pattern, id: stays, pixel: 4, column: 4, row: 4}
    - {kind: drift, pixel: 4, column: 4, row: 4, gain: 0.05, age_s: 900}
    - {kind: bad_pixels, dead: 0.01, hot: 0.01, blinking: 0.02}
  correction: {frames: [2], freeze_frames: 1}
  falloff: {vignetting: 0.3}
background: {kind: ground, spread_k: 0}
targets:
  - {id: tank, shape: {kind: tank, emissivity: 0.7}, absent: [[1, 1]],
     path: {kind: straight, start: [40, 30], range_m: 200}}
occluders:
  - {kind: pole, foot_px: [20, 60], height_px: 40, width_px: 3, arm_px: 12, range_m: 100}
  - {kind: building, id: house, foot_px: [70, 60], size_px: [24, 30], range_m: 100}
  - {kind: smoke, center_px: [40, 30], size_px: [20, 12], drift_px_s: [60, 0], range_m: 100,
     billows: 1, spread_k: 4}
""",
    "carried": """
frames: 4
camera:
  size: [96, 64]
  ifov_mrad: 1
  optics: {defocus_px: 2}
  motion: [{kind: platform, sway_m: [1, 0, 0.5], sway_period_s: 1}]
background: {kind: ground, height_m: 30}
targets: [{id: tank, shape: {kind: tank}, path: {kind: straight, start: [40, 30], range_m: 200}}]
""",
}
OFF: list[tuple[str, str, str]] = [
    ("bodies", "psf", "camera.psf_px=0"),
    ("bodies", "rain", "atmosphere.rain_mm_h=0"),
    ("bodies", "fog", "atmosphere.fog_visibility_km=null"),
    ("sky", "low.texture", "background.clouds.low.texture_k=0"),
    ("sky", "low.sunlit", "background.clouds.low.sunlit_k=0"),
    ("sky", "low.wind", "background.clouds.low.wind_mrad_s=[0, 0]"),
    ("bodies", "gull.beat", "targets.gull.shape.beat_hz=0"),
    ("bodies", "walker.stride", "targets.walker.shape.stride_hz=0"),
    ("bodies", "drone.rotor", "targets.drone.shape.rotor_hz=0"),
    ("bodies", "plane.propeller", "targets.plane.shape.propeller_hz=0"),
    ("bodies", "heli.rotor", "targets.heli.shape.rotor_hz=0"),
    ("bodies", "jet.spin", "targets.jet.spin_deg_s=[0, 0, 0]"),
    ("bodies", "jet.flicker", "targets.jet.shape.flicker={kind: steady}"),
    ("ground", "psf", "camera.psf_px=0"),
    ("ground", "texture", "background.spread_k=0"),
    ("ground", "lanes", "background.fields.lane_mrad=0"),
    ("town", "texture", "background.spread_k=0"),
    ("town", "hills", "background.hills_mrad=0"),
    ("landscape", "far_woods", "background.far_woods_mrad=0"),
    ("landscape", "wood.texture", "background.trees.wood.spread_k=0"),
    ("landscape", "wood.undergrowth", "background.trees.wood.undergrowth=0"),
    ("landscape", "wood.relief", "background.trees.wood.relief_m=0"),
    ("town", "town.texture", "background.buildings.town.spread_k=0"),
    ("town", "town.windows", "background.buildings.town.windows_k=0"),
    ("town", "town.roofs", "background.buildings.town.roof_k=0"),
    ("town", "town.relief", "background.buildings.town.relief_m=0"),
    ("sea", "waves", "background.wind_m_s=0"),
    ("sea", "gusts", "background.gusts=0"),
    ("sea", "sun", "background.sun_deg=null"),
    ("sea", "low.sunlit", "background.clouds.low.sunlit_k=0"),
    *(("camera", f"noise_3d.{term}", f"camera.noise.noise_3d.{term}=0") for term in ("t", "v", "h", "tv", "th", "vh")),
    ("camera", "noise_3d.tvh", "camera.noise.noise_3d.tvh=0"),
    *(("camera", f"stays.{term}", f"camera.noise.stays.{term}=0") for term in ("pixel", "column", "row")),
    *(("camera", f"drift.{term}", f"camera.noise.drift.{term}=0") for term in ("pixel", "column", "row", "gain")),
    *(("camera", f"bad_pixels.{what}", f"camera.noise.bad_pixels.{what}=0") for what in ("dead", "hot", "blinking")),
    ("camera", "freeze", "camera.correction.freeze_frames=0"),
    ("camera", "cos4", "camera.falloff.cos4=false"),
    ("camera", "vignetting", "camera.falloff.vignetting=0"),
    ("carried", "defocus", "camera.optics.defocus_px=0"),
    ("carried", "platform.sway", "camera.motion.platform.sway_m=[0, 0, 0]"),
    ("camera", "tank.absences", "targets.tank.absent=[]"),
    ("camera", "surroundings", "atmosphere.surroundings_k=1"),
    ("camera", "pole.arm", "occluders.pole.arm_px=0"),
    ("camera", "house.windows", "occluders.house.windows=[0, 0]"),
    ("camera", "smoke.drift", "occluders.smoke.drift_px_s=[0, 0]"),
    ("camera", "smoke.billows", "occluders.smoke.billows=0"),
    ("camera", "smoke.texture", "occluders.smoke.spread_k=0"),
]
"""Scene, name, and the override with the same effect."""
NO_KEY = {"haze", "agc", "flicker", "evolve"}
"""Names with tests of their own."""


def pairs(scenario: irsim.Scenario) -> list[tuple[Frame, Truth]]:
    return [(frame, truth) for frame, truth in irsim.frames(scenario)]


def without(scenario: irsim.Scenario, *names: str) -> irsim.Scenario:
    return irsim.change(scenario, {"without": list(names)})


@lru_cache
def _whole(name: str) -> list[tuple[Frame, Truth]]:
    return pairs(loads(SCENES[name]))


def _same(one: list[tuple[Frame, Truth]], other: list[tuple[Frame, Truth]]) -> bool:
    return all(np.array_equal(a.image, b.image) and s == t for (a, s), (b, t) in zip(one, other, strict=True))


@pytest.mark.parametrize(
    "scene",
    [pytest.param(name, marks=() if name in ("sky", "camera", "ground") else pytest.mark.slow) for name in SCENES],
)
def test_switched_off_is_the_value_without_effect(scene: str) -> None:
    for name, key in [each[1:] for each in OFF if each[0] == scene]:
        off = pairs(without(loads(SCENES[scene]), name))
        assert _same(off, pairs(loads(SCENES[scene], overrides=[key]))), name
        assert not _same(off, _whole(scene)), name


def test_every_switch_is_tried() -> None:
    def kinds(part: type[Part]) -> set[type[Part]]:
        return {part}.union(*(kinds(each) for each in part.__subclasses__()))

    names = {name for part in kinds(Part) if part.__module__.startswith("irsim.") for name in part.switches}
    assert names == {name.rpartition(".")[2] for _, name, _ in OFF} | NO_KEY


def test_without_agc_counts_stay() -> None:
    scenario = loads(SCENES["ground"])
    off = irsim.Rendering(without(scenario, "agc"))
    plain = irsim.Rendering(loads(SCENES["ground"], overrides=["camera.agc={kind: none}"]))
    assert _same(list(off.pairs()), _whole("ground"))
    assert off.agc == plain.agc
    shown, wanted, usual = (
        np.stack([frame.image for frame in each.frames("display")]) for each in (off, plain, irsim.Rendering(scenario))
    )
    np.testing.assert_array_equal(shown, wanted)
    assert (shown != usual).any()


def test_without_haze_visibility_is_unlimited() -> None:
    """ln tau is linear in 1 / V: its value without haze follows from those at 5 km and 300 km."""
    hazy, far, none = (
        Atmosphere(preset="us_standard", visibility_km=5),
        Atmosphere(preset="us_standard", visibility_km=300),
        without(loads(SCENES["landscape"], overrides=["atmosphere.visibility_km=5"]), "haze").air,
    )
    ranges = np.array([100.0, 5000.0, 20_000.0])
    for band in ("mwir", "lwir"):
        tau = [air.transmittance(band, ranges) for air in (hazy, far, none)]
        expected = np.log(tau[1]) + (np.log(tau[1]) - np.log(tau[0])) * (1 / 300) / (1 / 5 - 1 / 300)
        np.testing.assert_allclose(np.log(tau[2]), expected, rtol=1e-9)
    assert not _same(pairs(without(loads(SCENES["landscape"]), "haze")), _whole("landscape"))


def test_an_id_of_the_scene_comes_first() -> None:
    scenario = loads(SCENES["sky"])
    assert [place for name, place in scenario.names() if name == "haze"] == [("background", "clouds", 1, "id")]
    off = without(scenario, "haze")
    assert off.air.visibility_km == scenario.air.visibility_km
    assert off.shown.atmosphere == scenario.atmosphere


def test_names_of_settings() -> None:
    names = dict(loads("camera: {psf_px: 0, agc: {kind: none}}\nbackground: {kind: ground, spread_k: 0}").names())
    assert list(names) == ["white"]  # settings without effect have no name
    with pytest.raises(irsim.InputError, match=r"there is no 'spin'; allowed: .*; did you mean 'jet\.spin'\?"):
        without(loads(SCENES["bodies"]), "spin")


def test_an_override_of_a_switched_off_part_is_a_warning(tmp_path: Path) -> None:
    text = "camera: {agc: {kind: fixed, low: 16383, high: 16384}}\nbackground: {kind: ground}"
    path = tmp_path / "x.yaml"
    path.write_text(text)
    assert irsim.unheeded(path, ["camera.psf_px=2"], ["psf"]) == [
        "override camera.psf_px: warning: its part is switched off"
    ]
    assert [notice.at for notice in lint(loads(text))] == [("camera", "agc", "low")]
    assert list(lint(without(loads(text), "agc"))) == []


CHANGING = "{id: low, coverage: 0.6, evolve_s: 0.5, wind_mrad_s: [9, 0]}"
STEADY = "camera: {size: [96, 64], ifov_mrad: 1, netd_mk: 0}"


def test_a_cloud_without_evolution_keeps_its_shape() -> None:
    """Its wind stays. The key's value 0 would be another cloud from the first frame on."""
    scenario = loads(f"frames: 4\n{STEADY}\nbackground: {{kind: sky, clouds: [{CHANGING}]}}")
    whole, off = pairs(scenario), pairs(without(scenario, "low.evolve"))
    assert _same(off[:1], whole[:1])
    assert not _same(off[1:], whole[1:])
    calm = pairs(without(scenario, "low.evolve", "low.wind"))
    assert _same(calm, [(calm[0][0], truth) for _, truth in calm])
    assert not _same(off, calm)


def test_switches_of_a_placed_occluder_hold() -> None:
    text = (
        f"frames: 9\n{STEADY}\nbackground: {{kind: ground}}\ntargets: [{{id: jet, shape: {{kind: point}}, "
        "path: {kind: straight, start: [20, 30], speed: 6}}]\n"
        "occluders: [{kind: building, hides: jet, frames: [4, 4], range_m: 100}]"
    )
    bare = "occluders.building.windows=[0, 0]"
    off, whole = (pairs(each) for each in (without(loads(text), "building.windows"), loads(text)))
    assert _same(off, pairs(loads(text, overrides=[bare])))
    assert not _same(off, whole)
