"""Warnings about the atmosphere, its fit, and the sky behind it."""

from __future__ import annotations

from typing import Any

import pytest
from lint_scenes import check_warning, warned

AIR = {"preset": "us_standard"}


def scene(**changes: Any) -> dict[str, Any]:
    camera = {"netd_mk": 0.0, **changes.pop("camera", {})}
    ground = {"kind": "ground", "spread_k": 0.0}
    return {"frames": 5, "camera": camera, "atmosphere": AIR, "background": ground, "targets": [jet(2000)], **changes}


def jet(range_m: float, **path: Any) -> dict[str, Any]:
    way = {"kind": "straight", "start": (32, 24), "speed": 0, "range_m": range_m, **path}
    return {"id": "jet", "shape": {"kind": "fighter"}, "path": way}


@pytest.mark.parametrize(
    ("change", "place", "words"),
    [
        ({}, None, ""),
        ({"atmosphere": {}, "targets": [jet(50e3)]}, None, ""),
        ({"targets": [jet(400, closing_m_s=-90)]}, "targets.0.path", "frame 0: a range of 0.4 km lies beyond"),
        ({"targets": [jet(25e3)]}, "targets.0.path.range_m", "a range of 25 km lies beyond the fitted 0.5"),
        ({"atmosphere": {"preset": "tropical", "visibility_km": 2}}, "atmosphere.visibility_km", "2 km lies"),
        ({"atmosphere": {"preset": "tropical", "altitude_m": 3000}}, "targets.0.path", "holds 20% of the gas"),
        ({"camera": {"band": (3.4, 4.9)}}, "atmosphere.preset", "that of mwir is used, which may be off by up to 0.16"),
        ({"camera": {"band": (3.05, 5.0)}}, None, ""),
    ],
)
def test_atmosphere_and_paths_beyond_fit(change: dict[str, Any], place: str | None, words: str) -> None:
    check_warning(scene(**change), place, words)


def test_layers_and_occluders_beyond_fit() -> None:
    bar = {"kind": "bar", "range_m": 300.0, "center_px": (25.0, 24.0), "size_px": (9.0, 9.0)}
    check_warning(scene(occluders=[bar]), "occluders.0.range_m", "a range of 0.3 km lies beyond the fitted 0.5 to 20")
    for family in ("clouds", "trees"):
        land = {"kind": "landscape", "preset": "us_standard", family: [{"id": "ok"}, {"id": "far", "range_m": 4e4}]}
        far = scene(background=land, camera={"elevation_deg": -2.0}, targets=[])
        check_warning(far, f"background.{family}.1.range_m", "a range of 40 km")


@pytest.mark.parametrize(("height_m", "beyond"), [(300.0, False), (8000.0, True)])
def test_ground_beyond_fit(height_m: float, beyond: bool) -> None:
    ground = {"kind": "ground", "height_m": height_m, "spread_k": 0.0}
    air = {**AIR, "altitude_m": height_m}
    found = warned(scene(atmosphere=air, background=ground, camera={"elevation_deg": -30.0}, targets=[]))
    assert ("background.kind" in found) == beyond
    assert not beyond or "in the middle of the picture: a path up to 8000 m above" in found["background.kind"]


@pytest.mark.parametrize(
    ("atmosphere", "sky", "words"),
    [
        (AIR, {}, "of its own temperatures"),
        (AIR, {"preset": "tropical"}, "of tropical"),
        (AIR, AIR, None),
        ({"preset": "none", "rain_mm_h": 5.0, "fog_visibility_km": 1.0}, {}, "behind rain and fog of 288 K"),
    ],
)
def test_sky_unlike_atmosphere(atmosphere: dict[str, Any], sky: dict[str, Any], words: str | None) -> None:
    other = scene(atmosphere=atmosphere, background={"kind": "sky", **sky})
    check_warning(other, None if words is None else "background.preset", words or "")
