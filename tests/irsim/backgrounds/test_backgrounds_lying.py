"""What lies on a landscape's ground: roads, water, clutter."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from country import context, view_direction

from irsim.backgrounds import Landscape, plane
from irsim.backgrounds.ground_cover import Roads
from irsim.backgrounds.panorama import PanoramaGrid
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.physics.radiometry import temperature
from irsim.types import Floats


def lying(keys: dict[str, Any], scene: SceneContext) -> tuple[Floats, Floats]:
    """Cover and temperature, K, (rows, cols) of the one thing that lies on level ground without texture."""
    land = Landscape.model_validate({"hills_mrad": 0.0, "spread_k": 0.0, **keys})
    _, layer = land.layers(scene)
    passed, emission = layer.light(view_direction(scene))
    assert passed is not None
    return 1 - passed, np.asarray(temperature("lwir", (emission + 1e-9) / np.maximum(1 - passed, 1e-3)))


@pytest.mark.parametrize(("finer", "below"), [(1.0, 700), (1.0, 1800), (5.0, 1800)])
def test_near_ground_shows_texels_as_long_as_wide(finer: float, below: int) -> None:
    """Seen slantwise, at an angle d below the level, a texel is about d times as high as wide."""
    ifov_rad, wave = 0.25e-3, np.cos(2 * np.pi * np.arange(1024) / 64).astype(np.float32)
    rows, columns = np.arange(below - 400.0, below + 401.0), np.arange(-2000.0, 2000.0)
    depths = np.full((len(rows), len(columns)), rows[:, None])
    across, along = (
        plane.laid(texture, PanoramaGrid(columns, rows, 0.0), depths, finer, ifov_rad)
        for texture in (np.tile(wave, (1024, 1)), np.tile(wave[:, None], (1, 1024)))
    )
    under = below + plane.VANISHING_PX
    a_px = 2 * np.pi / 64 * plane.VANISHING_PX * finer / under  # of the wave's phase, across
    assert np.diff(across, axis=1)[400].std() == pytest.approx(a_px / math.sqrt(2), rel=0.05)
    phases = np.arccos(np.clip(along[360:441, 0], -1, 1))
    assert np.abs(np.diff(phases)).mean() == pytest.approx(a_px / (under * ifov_rad), rel=0.05)


@pytest.mark.parametrize("depression_deg", [10.0, 20.0, 30.0, 60.0])
def test_ground_seen_from_above_has_no_streaks_towards_the_camera(depression_deg: float) -> None:
    """Up and down it changes no slower than across."""
    scene = replace(context(elevation_deg=-depression_deg, size=(320, 240)), seed=3)
    land = Landscape.model_validate({"hills_mrad": 0.0, "camera_height_m": 400.0})
    light = land.layers(scene)[0].light(view_direction(scene))[1]
    assert np.diff(light, axis=1).std() < np.diff(light, axis=0).std()


def test_roads_are_as_wide_as_the_ground_is_near() -> None:
    """A road of 6 m, seen from 10 m up: wherever it is crossed, at d px below the horizon, where ground is 10 m /
    (d + 40 px) / 0.5 mrad away, its cover across is 6 m at that distance, times how slantwise it is crossed."""
    scene = context(elevation_deg=-4.0, size=(641, 401))
    widths: dict[int, list[float]] = {20: [], 60: [], 150: []}
    for seed in range(6):
        cover, _ = lying({"roads": {"count": 6, "width_mrad": 12.0}}, replace(scene, seed=seed))
        horizon = 200 - math.radians(4.0) / 0.5e-3
        for below, found in widths.items():
            line = cover[round(horizon) + below]
            starts = np.flatnonzero((line[1:] > 0.5) & (line[:-1] <= 0.5))
            ends = np.flatnonzero((line[1:] <= 0.5) & (line[:-1] > 0.5))
            if len(starts) and len(ends):
                found += [float(b - a) for a in starts for b in ends[ends > a][:1]]
    for below, found in widths.items():
        assert 0.97 < min(found) / (12.0 / 0.5 * (below + 40) / 40) < 1.3, below


def test_roads_thinner_than_a_pixel_cover_their_share_of_it() -> None:
    """Within 12 px of the horizon a px is some 30 texels or more high and a road 4 wide: no pixel is all road."""
    scene = context(elevation_deg=-4.0, size=(641, 401))
    cover, _ = lying({"roads": {"count": 50}}, scene)
    far = cover[round(200 - math.radians(4.0) / 0.5e-3) + np.arange(2, 12)]
    share = float(Roads(count=50).paint((1024, 1024), 2.0, 0.0, 1)[0].mean())
    assert far.mean() == pytest.approx(share, rel=0.25)
    assert far.std() < 0.5 * math.sqrt(share * (1 - share))  # half of what all-or-nothing pixels would have


@pytest.mark.parametrize("ifov_mrad", [0.1, 0.5, 2.0])
def test_near_ground_needs_few_looks(monkeypatch: pytest.MonkeyPatch, ifov_mrad: float) -> None:
    """What is covered, against 64 looks at every pixel, past the first rows, where 16 are too few, too."""
    scene = SceneContext(1, Geometry((320, 240), ifov_mrad * 1e-3, -150 * ifov_mrad * 1e-3), 30.0, "lwir", 0.0)
    cover, _ = lying({"water": {"share": 0.4}}, scene)
    monkeypatch.setattr(plane, "LOOKS", (64, 64))
    all_over, _ = lying({"water": {"share": 0.4}}, scene)
    assert 0.1 < all_over.mean() < 0.9
    assert np.std(cover[40:] - all_over[40:]) < 0.02


def test_edges_are_sharp_near_and_water_lies_flat() -> None:
    """However near, a shore is about a pixel wide; a lake is wider than high by what the ground is seen slantwise:
    a metre ahead is (d + 40 px) 0.5 mrad of a metre across."""
    scene = context(elevation_deg=-8.0, size=(641, 401))
    for seed in range(3):
        cover, _ = lying({"water": {"share": 0.4}}, replace(scene, seed=seed))
        near = cover[round(200 - math.radians(8.0) / 0.5e-3) + 100 :][:200]
        across, down = (np.mean(np.abs(np.diff(near, axis=axis))) for axis in (1, 0))
        assert np.mean((near > 0.05) & (near < 0.95)) < 2 * (across + down)
        assert across / down == pytest.approx((200 + 40) * 0.5e-3, rel=0.6)
    # The side of a road that goes ahead, 200 px below the horizon, where a px of the map is drawn 6 px wide.
    cover, _ = lying({"roads": {"count": 12, "width_mrad": 8}}, replace(scene, seed=4))
    assert np.abs(np.diff(cover[120:220], axis=1)).max() > 0.5


def test_clutter_is_larger_and_rarer_the_nearer_it_is() -> None:
    """Things of 4 mrad at the horizon, 8 px there; d px below it all is p = 1 + d / 40 times as wide, and there are
    1 / p^3 as many on a px."""
    scene = context(elevation_deg=-5.0, size=(641, 501))
    horizon = 250 - math.radians(5.0) / 0.5e-3
    found = []
    for seed in range(12):
        keys = {"per_mrad2": 0.004, "size_mrad": [4.0, 4.0], "contrast_k": [5.0, 5.0], "cold": 0.0}
        cover, kelvin = lying({"clutter": keys}, replace(scene, seed=seed))
        assert kelvin[cover > 0.9] == pytest.approx(295, abs=0.01)
        assert cover[: round(horizon) - 2].max() < 1e-6
        _, _, boxes, middles = cv2.connectedComponentsWithStats((cover > 0.5).astype(np.uint8))
        found += [(y - horizon, area) for (*_, area), (_, y) in zip(boxes[1:], middles[1:], strict=True)]
    for top, bottom in ((10, 30), (30, 80), (80, 200)):
        areas = [area / (1 + below / 40) ** 2 for below, area in found if top < below < bottom]
        # pi/4 of 8 px by 4 to 8; there are 12 pictures of 641 columns, and 0.004 / 4 on a px at the horizon.
        assert np.median(areas) == pytest.approx(math.pi / 4 * 8 * 6, rel=0.2), top
        expected = 12 * 641 * 0.001 * 20 * ((1 + top / 40) ** -2 - (1 + bottom / 40) ** -2)
        assert abs(len(areas) - expected) < 4 * math.sqrt(expected), top


@pytest.mark.parametrize(("hour", "ground", "roads", "water"), [("day", 303, 9, -11), ("night", 283, 4, 5)])
def test_roads_and_water_are_as_warm_as_their_hour_has_it(hour: str, ground: float, roads: float, water: float) -> None:
    scene = context(elevation_deg=-2.0)
    for name, contrast in (("roads", roads), ("water", water)):
        keys = {name: {"count": 20} if name == "roads" else {"share": 0.5}}
        cover, kelvin = lying({"hour": hour, **keys}, scene)
        assert kelvin[cover > 0.9] == pytest.approx(ground + contrast, abs=0.01)
    cover, kelvin = lying({"hour": hour, "water": {"share": 0.5, "contrast_k": 1.5}}, scene)
    assert kelvin[cover > 0.9] == pytest.approx(ground + 1.5, abs=0.01)
