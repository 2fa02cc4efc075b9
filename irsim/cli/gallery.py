"""Sheets of `irsim gallery`: a picture of each target kind, background, camera preset or AGC."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from irsim.camera import AGCS
from irsim.camera.presets import PRESETS
from irsim.cli.figures import LabelledImage, labelled_sheet
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.rotations import AWAY, euler
from irsim.geometry.sprite import Sprite
from irsim.physics.radiometry import radiance, temperature
from irsim.recording.output import write_png
from irsim.render.composite import draw_over
from irsim.render.stream import Rendering
from irsim.rng import normals
from irsim.scenario.loader import load
from irsim.scenario.model import Scenario
from irsim.targets import SHAPES, Shape, View
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.types import Band, Box, Image

CROP_PX = 64
"""Side of the square picture of one target, px."""
FILL = 0.84
"""Ratio of the longer side of the body's box to the side of the picture."""
ENLARGEMENT = 2
KINDS_PER_ROW = 3
LABEL_PX = 22
"""Height of a label, px."""
NOISE_K = 0.08
"""Standard deviation of the camera's noise, K."""
SPAN_K = 12.0
"""Least temperature difference between black and white in a picture of a target, K."""
ZOOM_PX = 32
"""Side of the part of a camera's picture that is enlarged, px."""
DRONE_RANGE_M = 45


def body_kinds() -> Iterator[str]:
    """Yield the target kinds that are bodies and need no key, unlike a mesh, which needs a file."""
    for name, kind in SHAPES:
        if issubclass(kind, Body) and not any(field.is_required() for field in kind.model_fields.values()):
            yield name


def default_shape(kind: str) -> Shape:
    """Return the shape of a target kind with default values."""
    shape = SHAPES.find(kind).model_validate({})
    assert isinstance(shape, Shape)
    return shape


def crop(shape: Shape, pose: Angles, *, band: Band = "lwir", time: float = 0.0, side: int = CROP_PX) -> Image:
    """Return a picture (side, side) uint8 of a body in front of a uniform background, with a little noise.

    pose  yaw, pitch, roll, degrees, as for targets

    Black is the 1st percentile of the temperatures and white the 99th, at least SPAN_K apart.
    """
    background = float(radiance(band, shape.picture_background_k))
    context = SceneContext(0, Geometry((side, side), 5e-4), 30.0, band, 0.6, ambient=background)
    scene = np.full((side, side), background)
    draw_over(scene, framed(shape, pose, context, time))
    noisy = temperature(band, scene) + NOISE_K * normals((side, side), 0, "gallery", shape.kind, 0)
    low, high = np.percentile(noisy, [1.0, 99.0])
    low, high = min(low, shape.picture_background_k - SPAN_K / 4), max(high, low + SPAN_K)
    return np.asarray(np.clip((noisy - low) / (high - low), 0, 1) * 255).round().astype(np.uint8)


def framed(shape: Shape, pose: Angles, context: SceneContext, time: float) -> Sprite:
    """Return the sprite of a body at the centre of the picture, at the distance at which it takes FILL of the side.

    pose  yaw, pitch, roll, degrees
    time  s, for moving parts such as rotors
    """
    side = context.geometry.size[0]
    down = np.radians(shape.picture_depression_deg)
    tilt = np.array([[1, 0, 0], [0, np.cos(down), -np.sin(down)], [0, np.sin(down), np.cos(down)]])
    attitude = tilt @ AWAY @ euler(np.array(pose))
    centre, range_m = np.array([(side - 1) / 2] * 2), 3000.0

    def sprite() -> Sprite:
        drawn = shape.draw(View(context.geometry.place(centre, range_m), attitude, context, time))
        assert drawn is not None
        return drawn

    for _ in range(4):
        box = sprite().box
        centre = centre + (side - 1) / 2 - np.array([box.cx, box.cy])
        range_m *= max(box.w, box.h) / (FILL * side)
    return sprite()


def target_sheet() -> Image:
    """Return a sheet (rows, columns) uint8 with the name of every target kind and a picture of each of its poses."""
    blocks = []
    for name in body_kinds():
        shape = default_shape(name)
        crops = np.concatenate([crop(shape, pose) for pose in shape.picture_poses], axis=1)
        large = cv2.resize(crops, None, fx=ENLARGEMENT, fy=ENLARGEMENT, interpolation=cv2.INTER_NEAREST)
        label = np.full((LABEL_PX, large.shape[1]), 255, dtype=np.uint8)
        cv2.putText(label, name, (6, LABEL_PX - 7), cv2.FONT_HERSHEY_SIMPLEX, 0.5, 0, 1, cv2.LINE_AA)
        blocks.append(np.pad(np.concatenate([label, large]), 3, constant_values=255))
    blocks += [np.full_like(blocks[0], 255)] * (-len(blocks) % KINDS_PER_ROW)
    rows = [np.concatenate(blocks[at : at + KINDS_PER_ROW], axis=1) for at in range(0, len(blocks), KINDS_PER_ROW)]
    return np.concatenate(rows)


def write_target_sheet(path: Path) -> Path:
    """Write the sheet of targets as a PNG file and return its path. Raises InputError where it cannot be written."""
    write_png(path, target_sheet())
    return path


_LOOK_UP = {"elevation_deg": 12, "band": "mwir", "range_k": [210, 330]}
_LOOK_DOWN = {"elevation_deg": -12, "ifov_mrad": 0.6, "band": "lwir", "range_k": [250, 330]}
_LOOK_OUT = {"elevation_deg": 0.6, "ifov_mrad": 0.25, "band": "lwir", "range_k": [210, 330]}
_LOOK_AT_SEA = {**_LOOK_OUT, "elevation_deg": -1.2, "ifov_mrad": 0.4}
_SKY = {"kind": "sky", "horizon_k": 285, "zenith_k": 245}
_CLOUD = {"temperature_k": 274, "range_m": 6000}
_HIGH = {"coverage": 0.6, "depth": 0.8, "betas": [2.8, 3.8], "correlation_mrad": 50, "temperature_k": 272}
_LOW = {"id": "low", "coverage": 0.35, "temperature_k": 276, "sunlit_k": 8, "range_m": 3000}
_LAND = {"kind": "landscape", "camera_height_m": 4, "fields": {}}
_WOOD = {"trees": [{"range_m": 900, "height_m": 18, "spacing_m": 4, "relief_m": 0.7}]}
_VILLAGE = {"buildings": [{"range_m": 700, "spacing_m": 60, "relief_m": 0.7}]}
_PATCHES = {"fields": {"size_mrad": 60}, "roads": {"count": 2}, "water": {"share": 0.05}}
_TERRAIN = {"kind": "ground", "correlation_mrad": 60}
_ROUGH = {"form": "rough", "per_mrad2": 0.0012, "size_mrad": [6, 14]}
_SEA = {"kind": "sea", "horizon_k": 281, "zenith_k": 225, "camera_height_m": 18, "water_k": 286}

BACKGROUNDS: list[tuple[str, dict[str, Any], dict[str, Any]]] = [
    ("sky: clear", _LOOK_UP, _SKY),
    ("sky: thin high cloud", _LOOK_UP, {**_SKY, "clouds": [{**_HIGH, "range_m": 9000}]}),
    ("sky: broken, sunlit edges", _LOOK_UP, {**_SKY, "clouds": [{**_CLOUD, "coverage": 0.4, "sunlit_k": 10}]}),
    ("sky: two layers", _LOOK_UP, {**_SKY, "clouds": [{"id": "high", **_HIGH, "range_m": 9000}, _LOW]}),
    ("sky: overcast", _LOOK_UP, {**_SKY, "clouds": [{**_CLOUD, "coverage": 0.98, "depth": 3}]}),
    ("ground: terrain", _LOOK_DOWN, _TERRAIN),
    ("ground: warm and cold clutter", _LOOK_DOWN, {**_TERRAIN, "clutter": _ROUGH}),
    ("ground: fields, roads, water by day", _LOOK_DOWN, {**_TERRAIN, "hour": "day", **_PATCHES}),
    ("ground: the same by night", _LOOK_DOWN, {**_TERRAIN, "hour": "night", **_PATCHES}),
    ("landscape: tree line", _LOOK_OUT, {**_LAND, "hour": "night", **_WOOD}),
    ("landscape: village by day", _LOOK_OUT, {**_LAND, "hour": "day", **_WOOD, **_VILLAGE}),
    ("sea: wind 5 m/s, glint", _LOOK_AT_SEA, {**_SEA, "wind_m_s": 5, "sun_deg": [1, 13]}),
]
"""(label, keys under `camera`, keys under `background`) of each picture."""

_SIZE = {"size": [320, 256], "ifov_mrad": 0.3}


def backgrounds() -> Iterator[LabelledImage]:
    """Yield a picture of each background."""
    for label, camera, background in BACKGROUNDS:
        keys = {"seed": 3, "frames": 2, "camera": {**_SIZE, **camera}, "background": background}
        yield LabelledImage(label, Rendering(Scenario.model_validate(keys)).frame(0, "display").image)


_FAINT_DRONE = {
    "background": {"kind": "sky", "horizon_k": 281, "zenith_k": 278},
    "targets": [
        {
            "id": "drone",
            "shape": {
                "kind": "quadrotor",
                "temperature_k": 280.35,
                "motors_k": 280.75,
                "battery_k": 280.65,
                "rotors_k": 280.1,
                "rotor_deg": 45,
            },
            "attitude_deg": (30, 45, 0),  # tilted, so that all four arms are visible
            "path": {"kind": "straight", "start": [160, 128], "range_m": DRONE_RANGE_M},
        }
    ],
}


def cameras() -> Iterator[LabelledImage]:
    """Yield a picture by each camera preset of one faint drone against an almost uniform sky, which shows the noise."""
    for preset in PRESETS:
        camera = {**_SIZE, "preset": preset, "elevation_deg": 6}
        scenario = Scenario.model_validate({"seed": 3, "frames": 2, "camera": camera, **_FAINT_DRONE})
        image = Rendering(scenario).frame(1, "display").image
        label = f"{preset}: NETD {scenario.camera.netd():.3g} mK; a drone {DRONE_RANGE_M} m away"
        yield LabelledImage(label, image, Box(160, 128, ZOOM_PX, ZOOM_PX))


AGC_EXAMPLES = (("sky", 40), ("countryside", 40), ("entrant", 70), ("sea", 30))
"""(shipped scenario, frame number) of the pictures that compare AGCs."""
_AGC_KINDS = [kind for kind in AGCS.kinds if kind not in ("fixed", "none", "video")]


def agcs() -> Iterator[LabelledImage]:
    """Yield AGC_EXAMPLES as each AGC with default values shows them, except AGCs that need limits or do nothing."""
    for name, index in AGC_EXAMPLES:
        for kind in _AGC_KINDS:
            scenario = load(name, [f"camera.agc={{kind: {kind}}}"])
            yield LabelledImage(f"{name}: {kind}", Rendering(scenario).frame(index, "display").image)


def _writer(images: Callable[[], Iterator[LabelledImage]], columns: int) -> Callable[[Path], Path]:
    return lambda path: labelled_sheet(list(images()), path, columns)


SHEETS: dict[str, Callable[[Path], Path]] = {
    "targets": write_target_sheet,
    "backgrounds": _writer(backgrounds, 4),
    "cameras": _writer(cameras, 4),
    "agcs": _writer(agcs, len(_AGC_KINDS)),
}
"""Function for each sheet that writes it as a PNG file and returns the path."""
