"""Chart against the exact map, sampled textures, and the clear sky."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from irsim.backgrounds import ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.clouds import Clouds
from irsim.backgrounds.sky import ClearSky
from irsim.backgrounds.texture import MARGIN
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.physics.radiometry import temperature

ROUNDED = cv2.__version__.startswith("4.")
"""OpenCV 4 rounds the places of a look-up to 1/32 px, OpenCV 5 does not."""


def context(
    size: tuple[int, int] = (160, 120), ifov_mrad: float = 0.5, elevation_deg: float = 0.0, seed: int = 1
) -> SceneContext:
    return SceneContext(seed, Geometry(size, ifov_mrad * 1e-3, math.radians(elevation_deg)), 30.0, "mwir", 0.6)


def view_direction(
    scene: SceneContext, turn: tuple[float, float, float] = (0.0, 0.0, 0.0), time: float = 0.0
) -> ViewDirection:
    return ViewDirection(time, Chart.at(scene.geometry, scene.geometry.world_rotation(np.array(turn))))


@pytest.mark.parametrize(
    ("field_deg", "elevation_deg", "bound_px"),
    [(2, 0, 1e-3), (20, -60, 1e-3), (35, 60, 0.01), (60, 45, 0.05)],
)
def test_the_chart_follows_the_exact_map(field_deg: float, elevation_deg: float, bound_px: float) -> None:
    size = (640, 512)
    ifov = 2 * math.tan(math.radians(field_deg) / 2) / size[0]
    geometry = Geometry(size, ifov, math.radians(elevation_deg))
    rotation = geometry.world_rotation(np.array([0.02, -0.01, 0.05]))
    chart = Chart.at(geometry, rotation)
    x, y = np.meshgrid(np.linspace(0, 639, 33).round(), np.linspace(0, 511, 33).round())
    rays = geometry.directions(np.stack([x, y], axis=-1)) @ rotation  # camera to world
    u = np.arctan2(rays[..., 0], rays[..., 2]) * math.cos(math.radians(elevation_deg)) / ifov
    v = (math.radians(elevation_deg) - np.arcsin(-rays[..., 1])) / ifov
    rows, columns = y.astype(int), x.astype(int)
    assert np.abs(chart.at_pixels(chart.u)[rows, columns] - u).max() < bound_px
    assert np.abs(chart.at_pixels(chart.v)[rows, columns] - v).max() < bound_px


@pytest.mark.parametrize("elevation_deg", [5.0, 45.0, -20.0])
def test_clear_sky_follows_its_formula(elevation_deg: float) -> None:
    scene = context(size=(161, 121), elevation_deg=elevation_deg)
    light = ClearSky("mwir", 288.0, 211.0).light(view_direction(scene))[1]
    kelvin = 211 + 77 * math.exp(-max(math.sin(math.radians(elevation_deg)), 0) / 0.3)
    assert float(temperature("mwir", light[60, 80])) == pytest.approx(kelvin, abs=0.02)


def test_the_sky_is_equal_with_and_without_a_horizon() -> None:
    sky = ClearSky("mwir", 288.0, 211.0)
    low, high = (context(size=(160, 121), ifov_mrad=1.0, elevation_deg=elevation) for elevation in (3.0, 6.0))
    up = math.radians(6.0 - 3.0)
    seen_low = sky.light(view_direction(low, (0.0, up, 0.0)))[1]  # same pointing, by turning up
    seen_high = sky.light(view_direction(high))[1]
    assert seen_low == pytest.approx(seen_high, rel=1e-5)
    row = sky.light(view_direction(low))[1][:, 80]
    expected = sky.radiance(np.radians(3.0) - np.arctan((np.arange(121) - 60) * 1e-3))
    assert row == pytest.approx(expected, rel=2e-4 if ROUNDED else 2e-5)


@pytest.mark.parametrize("coverage", [0.1, 0.9])
def test_clouds_have_their_coverage(coverage: float) -> None:
    shares = []
    for seed in range(4):
        layer = Clouds(coverage=coverage, correlation_mrad=10, depth=50).layer(context(seed=seed))
        shares.append(np.mean(layer.textures.tiles[0].padded[:1024, :1024] < 0.5))
    assert np.mean(shares) == pytest.approx(coverage, abs=0.06)


def test_wind_shifts_clouds() -> None:
    scene = context()
    layer = Clouds(wind_mrad_s=(5.0, -2.5)).layer(scene)
    before, after = layer.light(view_direction(scene))[0], layer.light(view_direction(scene, time=1.0))[0]
    # 10 px right, 5 px up; the angle bends by .04 px
    assert after[5:-5, 15:-5] == pytest.approx(before[10:, 5:-15], abs=0.02 if ROUNDED else 0.01)


@pytest.mark.parametrize("turn", [(1e-4, -5e-5, 0.0), (2.2e-3, 1.1e-3, 0.0), (0.0, 0.0, 0.1)])
def test_a_shifted_key_frame_equals_sampling(turn: tuple[float, float, float]) -> None:
    """A move interpolates a second time: 4 % of the texture's spread. A place wrong by 1 px would make 11 %."""
    scene = context(size=(320, 240), elevation_deg=12.0)
    layer = Clouds(wind_mrad_s=(2.0, 1.0)).layer(scene)
    exact = view_direction(scene, turn, time=0.2)
    wide = Chart.at(scene.geometry, scene.geometry.world_rotation(np.zeros(3)), MARGIN)
    moved = ViewDirection(exact.time, exact.chart, key=ViewDirection(0.0, wide))
    for found, expected in zip(layer.light(moved), layer.light(exact), strict=True):
        assert found.shape == expected.shape
        assert np.sqrt(np.mean((found - expected) ** 2)) < 0.04 * expected.std()
