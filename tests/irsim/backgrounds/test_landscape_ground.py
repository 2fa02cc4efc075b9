"""Ground of a landscape: roads, water and clutter in perspective, and woods along the horizon."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from country import context, view_direction

from irsim.backgrounds import Landscape, ground_texture
from irsim.backgrounds.ground_cover import Roads
from irsim.backgrounds.landscape import TerrainLayer
from irsim.backgrounds.panorama import PanoramaGrid
from irsim.geometry.context import SceneContext
from irsim.physics.radiometry import temperature
from irsim.scenario.model import Scenario
from irsim.types import Floats


def cover_and_kelvin(keys: dict[str, Any], scene: SceneContext) -> tuple[Floats, Floats]:
    """Return cover and temperature, K, (rows, cols) each, of the only cover on level ground without texture."""
    land = Landscape.model_validate({"hills_mrad": 0.0, "spread_k": 0.0, **keys})
    _, layer = land.layers(scene)
    passed, emission = layer.light(view_direction(scene))
    assert passed is not None
    return 1 - passed, np.asarray(temperature("lwir", (emission + 1e-9) / np.maximum(1 - passed, 1e-3)))


@pytest.mark.parametrize(("finer", "below"), [(1.0, 700), (5.0, 1800)])
def test_near_ground_shows_texels_as_long_as_wide(finer: float, below: int) -> None:
    """Seen slantwise, at an angle d below the level, a texel is about d times as high as wide."""
    ifov_rad, wave = 0.25e-3, np.cos(2 * np.pi * np.arange(1024) / 64).astype(np.float32)
    rows, columns = np.arange(below - 400.0, below + 401.0), np.arange(-2000.0, 2000.0)
    depths = np.full((len(rows), len(columns)), rows[:, None])
    across, along = (
        ground_texture.perspective_texture(texture, PanoramaGrid(columns, rows, 0.0), depths, finer, ifov_rad)
        for texture in (np.tile(wave, (1024, 1)), np.tile(wave[:, None], (1, 1024)))
    )
    under = below + ground_texture.VANISHING_PX
    a_px = 2 * np.pi / 64 * ground_texture.VANISHING_PX * finer / under  # of the wave's phase, across
    assert np.diff(across, axis=1)[400].std() == pytest.approx(a_px / math.sqrt(2), rel=0.05)
    phases = np.arccos(np.clip(along[360:441, 0], -1, 1))
    assert np.abs(np.diff(phases)).mean() == pytest.approx(a_px / (under * ifov_rad), rel=0.05)


def test_roads_widen_towards_the_camera() -> None:
    """A road of 6 m, seen from 10 m up: d px below the horizon the ground is 10 m / (d + 40 px) / 0.5 mrad away."""
    scene = context(elevation_deg=-4.0, size=(641, 401))
    widths: dict[int, list[float]] = {20: [], 60: [], 150: []}
    for seed in range(4):
        cover, _ = cover_and_kelvin({"roads": {"count": 6, "width_mrad": 12.0}}, replace(scene, seed=seed))
        horizon = 200 - math.radians(4.0) / 0.5e-3
        for below, found in widths.items():
            line = cover[round(horizon) + below]
            starts = np.flatnonzero((line[1:] > 0.5) & (line[:-1] <= 0.5))
            ends = np.flatnonzero((line[1:] <= 0.5) & (line[:-1] > 0.5))
            if len(starts) and len(ends):
                found += [float(b - a) for a in starts for b in ends[ends > a][:1]]
    for below, found in widths.items():
        assert 0.97 < min(found) / (12.0 / 0.5 * (below + 40) / 40) < 1.3, below


def test_thin_roads_cover_their_share_of_a_pixel() -> None:
    """Within 12 px of the horizon a pixel is 30 texels or more high and a road 4 wide."""
    scene = context(elevation_deg=-4.0, size=(641, 401))
    cover, _ = cover_and_kelvin({"roads": {"count": 20}}, scene)
    far = cover[round(200 - math.radians(4.0) / 0.5e-3) + np.arange(2, 12)]
    share = float(Roads(count=20).paint((1024, 1024), 2.0, 0.0, 1)[0].mean())
    assert far.mean() == pytest.approx(share, rel=0.25)
    assert far.std() < 0.5 * math.sqrt(share * (1 - share))  # half the spread of pixels of 0 or 1


def test_edges_are_sharp_near_and_water_lies_flat() -> None:
    """A shore is about a pixel wide; d px below the horizon lengths ahead are foreshortened by (d + 40 px) 0.5 mrad."""
    scene = context(elevation_deg=-8.0, size=(641, 401))
    for seed in range(2):
        cover, _ = cover_and_kelvin({"water": {"share": 0.4}}, replace(scene, seed=seed))
        near = cover[round(200 - math.radians(8.0) / 0.5e-3) + 100 :][:200]
        across, down = (np.mean(np.abs(np.diff(near, axis=axis))) for axis in (1, 0))
        assert np.mean((near > 0.05) & (near < 0.95)) < 2 * (across + down)
        assert across / down == pytest.approx((200 + 40) * 0.5e-3, rel=0.6)
    # The side of a road that goes ahead, 200 px below the horizon, where a px of the map is drawn 6 px wide.
    cover, _ = cover_and_kelvin({"roads": {"count": 12, "width_mrad": 8}}, replace(scene, seed=4))
    assert np.abs(np.diff(cover[120:220], axis=1)).max() > 0.5


def test_near_clutter_is_larger_and_rarer() -> None:
    """Objects of 4 mrad, 8 px at the horizon; d px below it they are p = 1 + d / 40 times as wide, and 1 / p^3 as dense
    on the picture."""
    scene = context(elevation_deg=-5.0, size=(641, 501))
    horizon = 250 - math.radians(5.0) / 0.5e-3
    found = []
    for seed in range(8):
        keys = {"per_mrad2": 0.004, "size_mrad": [4.0, 4.0], "contrast_k": [5.0, 5.0], "cold": 0.0}
        cover, kelvin = cover_and_kelvin({"clutter": keys}, replace(scene, seed=seed))
        assert kelvin[cover > 0.9] == pytest.approx(295, abs=0.01)
        assert cover[: round(horizon) - 2].max() < 1e-6
        _, _, boxes, middles = cv2.connectedComponentsWithStats((cover > 0.5).astype(np.uint8))
        found += [(y - horizon, area) for (*_, area), (_, y) in zip(boxes[1:], middles[1:], strict=True)]
    for top, bottom in ((10, 30), (30, 80), (80, 200)):
        areas = [area / (1 + below / 40) ** 2 for below, area in found if top < below < bottom]
        # pi/4 of 8 px by 4 to 8; 8 pictures of 641 columns, and 0.004 / 4 objects on a pixel at the horizon.
        assert np.median(areas) == pytest.approx(math.pi / 4 * 8 * 6, rel=0.2), top
        expected = 8 * 641 * 0.001 * 20 * ((1 + top / 40) ** -2 - (1 + bottom / 40) ** -2)
        assert abs(len(areas) - expected) < 4 * math.sqrt(expected), top


@pytest.mark.parametrize(("hour", "ground", "roads", "water"), [("day", 303, 9, -11), ("night", 283, 4, 5)])
def test_roads_and_water_have_the_temperature_of_the_hour(hour: str, ground: float, roads: float, water: float) -> None:
    scene = context(elevation_deg=-2.0)
    for name, contrast in (("roads", roads), ("water", water)):
        keys = {name: {"count": 20} if name == "roads" else {"share": 0.5}}
        cover, kelvin = cover_and_kelvin({"hour": hour, **keys}, scene)
        assert kelvin[cover > 0.9] == pytest.approx(ground + contrast, abs=0.01)
    cover, kelvin = cover_and_kelvin({"hour": hour, "water": {"share": 0.5, "contrast_k": 1.5}}, scene)
    assert kelvin[cover > 0.9] == pytest.approx(ground + 1.5, abs=0.01)


SCENE = context(size=(640, 240))
PX_PER_MRAD = 2.0
FEW: dict[str, Any] = {"trees": [{"range_m": 600.0, "spacing_m": 40.0, "undergrowth": 0.0, "temperature_k": 285.0}]}


def country(seed: int, **keys: Any) -> tuple[Floats, Floats]:
    """Return the share of sky and the temperature, (rows, cols) each, of the farthest layer."""
    placed = replace(SCENE, seed=seed)
    layer = Landscape.model_validate({"ground_k": 300.0, "spread_k": 0.0, "horizon_k": 270.0, **keys}).layers(placed)[0]
    assert isinstance(layer, TerrainLayer)
    seen = view_direction(placed)
    light = np.asarray(layer.light(seen)[1])
    return np.asarray(layer.sky_share(seen)), np.asarray(temperature("lwir", light))


def edge(sky: Floats) -> Floats:
    """Return the rows of sky above the ground, (cols,)."""
    return np.asarray(sky.sum(axis=0))


def roughness(line: Floats) -> Floats:
    """Return the rms deviation from a straight line of each 20 px of an edge, as wide as a gap in a row of trees."""
    blocks = line.reshape(-1, 20).T
    columns = np.arange(20.0)
    slope, level = np.polyfit(columns, blocks, 1)
    return np.asarray((blocks - (level + columns[:, None] * slope)).std(axis=0))


def test_woods_make_the_horizon_irregular() -> None:
    """A bare horizon is straight within a fifth of a pixel in most places."""
    for seed in range(2):
        bare, grown = (edge(country(seed, **FEW, **keys)[0]) for keys in ({"far_woods_mrad": 0.0}, {}))
        assert np.median(roughness(bare)) < 0.2
        assert np.median(roughness(grown)) > 0.4
        assert roughness(grown).min() > 0.1
        assert (bare - grown).min() > -1e-3  # they stand on it


def test_woods_have_their_mean_height() -> None:
    high = np.mean([edge(country(seed)[0]) - edge(country(seed, far_woods_mrad=4.0)[0]) for seed in range(8)])
    assert high == pytest.approx(4.0 * PX_PER_MRAD, rel=0.25)


def test_woods_have_the_temperature_of_the_trees() -> None:
    sky, kelvin = country(1, **{**FEW, "trees": [{**FEW["trees"][0], "spread_k": 0.0}]}, far_woods_mrad=4.0)
    bare, _ = country(1, **FEW, far_woods_mrad=0.0)
    woods = (bare > 0.999) & (sky < 1e-3)
    assert woods.sum() > 500
    np.testing.assert_allclose(kelvin[woods], 285.0, atol=0.2)
    rows = np.arange(len(sky))[:, None] - edge(bare)
    np.testing.assert_allclose(kelvin[rows > 20], 300.0, atol=0.05)


def test_woods_are_off_without_trees_or_by_name() -> None:
    assert Landscape().far_woods_mrad == 0
    assert Landscape.model_validate(FEW).far_woods_mrad == 1.5
    scene = {"frames": 1, "background": {"kind": "landscape", **FEW}}
    off = Scenario.model_validate({**scene, "without": ["far_woods"]})
    assert off.shown.background == Landscape.model_validate({**FEW, "far_woods_mrad": 0.0})
