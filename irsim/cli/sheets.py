"""Sheets of what a scene can be made of, each thing in a picture of its own: `irsim gallery`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from irsim.camera import AGCS
from irsim.camera.presets import PRESETS
from irsim.cli.figures import Labelled, labelled_sheet
from irsim.cli.gallery import write_sheet
from irsim.render.stream import Rendering
from irsim.scenario.loader import load
from irsim.scenario.model import Scenario
from irsim.types import Box

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
"""(label, keys of the camera, keys of the background) of each."""

_SIZE = {"size": [320, 256], "ifov_mrad": 0.3}


def backgrounds() -> Iterator[Labelled]:
    """A frame of each background."""
    for label, camera, background in BACKGROUNDS:
        parts = {"seed": 3, "frames": 2, "camera": {**_SIZE, **camera}, "background": background}
        yield Labelled(label, Rendering(Scenario.model_validate(parts)).frame(0, "display").image)


_DRONE_M = 45
_FAINT = {
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
            "attitude_deg": (30, 45, 0),  # tilted, so that its four arms are seen
            "path": {"kind": "straight", "start": [160, 128], "range_m": _DRONE_M},
        }
    ],
}
ZOOM_PX = 32
"""Side of the enlarged part of a camera's picture, px."""


def cameras() -> Iterator[Labelled]:
    """The same faint drone before an almost even sky by each camera preset: what is seen is the camera's noise."""
    for preset in PRESETS:
        camera = {**_SIZE, "preset": preset, "elevation_deg": 6}
        scenario = Scenario.model_validate({"seed": 3, "frames": 2, "camera": camera, **_FAINT})
        image = Rendering(scenario).frame(1, "display").image
        label = f"{preset}: NETD {scenario.camera.netd():.3g} mK; a drone {_DRONE_M} m away"
        yield Labelled(label, image, Box(160, 128, ZOOM_PX, ZOOM_PX))


SHOWN_BY_AGC = (("sky", 40), ("countryside", 40), ("entrant", 70), ("sea", 30))
"""Frames of examples that show what the AGCs make of them."""


def agcs() -> Iterator[Labelled]:
    """The same frames by each AGC with a curve or detail of its own, at their defaults."""
    for name, index in SHOWN_BY_AGC:
        for word in _SHOWN_AGCS:
            scenario = load(name, [f"camera.agc={{kind: {word}}}"])
            yield Labelled(f"{name}: {word}", Rendering(scenario).frame(index, "display").image)


_SHOWN_AGCS = [word for word in AGCS.kinds if word not in ("fixed", "none")]


def _sheet_of(things: Callable[[], Iterator[Labelled]], columns: int) -> Callable[[Path], Path]:
    return lambda path: labelled_sheet(list(things()), path, columns)


SHEETS: dict[str, Callable[[Path], Path]] = {
    "targets": write_sheet,
    "backgrounds": _sheet_of(backgrounds, 4),
    "cameras": _sheet_of(cameras, 4),
    "agcs": _sheet_of(agcs, len(_SHOWN_AGCS)),
}
"""What there are sheets of: each writes its PNG file and returns the path."""
