"""Periodic textures: seams, resampling, and the transfer function of the lens."""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np
import pytest
from country import context, view_direction

from irsim.backgrounds.chart import Chart
from irsim.backgrounds.panorama import ROOM, Panorama, PanoramaGrid
from irsim.backgrounds.texture import (
    PeriodicTexture,
    blurred,
    enlarged,
    tile_shape,
)
from irsim.geometry.projection import Geometry
from irsim.geometry.silhouette import LayeredPolygons, draw_sprite
from irsim.physics.lens import Lens
from irsim.physics.psf import PSF, GaussianPSF
from irsim.render.frame import Renderer
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario
from irsim.types import Box, Floats


@pytest.mark.parametrize("turn", [(0.3, -0.2, 0.0), (0.0, 0.0, np.pi / 2)])
def test_a_rotated_strip_samples_its_texture(turn: tuple[float, float, float]) -> None:
    scene = context(size=(2500, 16))
    texture = np.random.default_rng(1).normal(size=tile_shape((2500, 16))).astype(np.float32)
    tile, chart = PeriodicTexture.of(texture, (2500, 16), GaussianPSF(0.5)), view_direction(scene, turn=turn).chart
    expected = _wrapped(tile, chart, (0.0, 0.0))
    np.testing.assert_allclose(tile.at(*tile.places(chart, (0.0, 0.0))), expected, rtol=0, atol=0.15)
    assert np.std(tile.at(*tile.places(chart, (0.0, 0.0))) - expected) < 0.02 * np.std(expected)


@pytest.mark.parametrize(("size", "axis"), [((640, 512), 0), ((640, 512), 1), ((2500, 16), 1)])
def test_a_drifting_texture_has_no_seam(size: tuple[int, int], axis: int) -> None:
    """The outermost nodes of the chart lie right of the texture's edge, the outermost pixels left of it."""
    texture = np.random.default_rng(1).normal(size=tile_shape(size)).astype(np.float32)
    tile, chart = PeriodicTexture.of(texture, size, GaussianPSF(0.5)), view_direction(context(size=size)).chart
    shift = [0.0, 0.0]
    shift[axis] = float(chart.uv[axis].min()) + tile.phase[axis] - 0.01
    right, down = shift
    found = tile.at(*tile.places(chart, (right, down)))
    np.testing.assert_allclose(found, _wrapped(tile, chart, (right, down)), rtol=0, atol=0.01)


def _wrapped(tile: PeriodicTexture, chart: Chart, shift: tuple[float, float]) -> Floats:
    """Return the texture at each pixel, wrapped by whole periods."""
    soft = tile.padded[: tile.shape[0], : tile.shape[1]]
    columns, rows = (
        np.mod(chart.at_pixels(at - by + phase), period).astype(np.float32)
        for at, by, phase, period in zip(chart.uv, shift, tile.phase, tile.shape[::-1], strict=True)
    )
    return np.asarray(cv2.remap(np.pad(soft, (0, 1), mode="wrap"), columns, rows, cv2.INTER_LINEAR))


@pytest.mark.parametrize("coarse", [1, 2, 8])
def test_a_part_equals_the_repeated_whole(coarse: int) -> None:
    small = np.random.default_rng(0).random((64 // coarse, 64 // coarse)).astype(np.float32)
    whole = enlarged(small, coarse, slice(0, 64), slice(0, 64))
    tiled = np.tile(whole, (3, 3))
    for top, left in [(0, 0), (-5, 3), (33, -17), (40, 41)]:
        part = enlarged(small, coarse, slice(top, top + 37), slice(left, left + 29))
        wanted = tiled[64 + top : 64 + top + 37, 64 + left : 64 + left + 29]
        np.testing.assert_allclose(part, wanted, atol=1e-6)


SIDE, SEEDS = 256, 2
MARKS = (0.05, 0.1, 0.2, 0.3)
"""Cycles a px."""

GAUSSIAN = "psf_px: 0.7"
DIFFRACTION = "psf_px: 0, optics: {f_number: 4, pitch_um: 15}"
DEFOCUS = "psf_px: 0, optics: {f_number: 4, pitch_um: 15, defocus_px: 4}"
SHARP = "psf_px: 0.3, optics: {f_number: 1, pitch_um: 15}"

GROUND = "-1 ground, beta: 0"
PLANE = "-20 ground, beta: 0, height_m: 300"
CLOUDS = "5 sky, horizon_k: 250, zenith_k: 250, clouds: [{beta: 0, stretch: 1}]"
EVOLVING = "5 sky, horizon_k: 250, zenith_k: 250, clouds: [{beta: 0, stretch: 1, evolve_s: 100}]"
SEA = "-12 sea, wind_m_s: 8"


def scene(background: str, optics: str, seed: int) -> Scenario:
    elevation, kind = background.split(" ", 1)
    return loads(
        f"seed: {seed}\nframes: 1\nbackground: {{kind: {kind}}}\n"
        f"camera: {{size: [{SIDE}, {SIDE}], ifov_mrad: 0.25, band: lwir, elevation_deg: {elevation}, {optics}}}"
    )


@lru_cache
def power(background: str, optics: str) -> Floats:
    window, total = np.hanning(SIDE), np.zeros((SIDE, SIDE))
    for seed in range(SEEDS):
        light = Renderer(scene(background, optics, seed)).scene(0)[0].astype(np.float64)
        total += np.abs(np.fft.fft2((light - light.mean()) * np.outer(window, window))) ** 2
    return total


@pytest.mark.parametrize(
    ("background", "optics"),
    [(GROUND, GAUSSIAN), (CLOUDS, DIFFRACTION), (EVOLVING, SHARP), (PLANE, DEFOCUS), (SEA, DEFOCUS)],
)
def test_a_background_has_the_transfer_function_of_the_lens(background: str, optics: str) -> None:
    """By the ratio of power with and without a lens, for each way of blurring."""
    seen, bare = (power(background, how) for how in (optics, "psf_px: 0"))
    frequency = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.fftfreq(SIDE))
    rings = [np.abs(frequency - mark) < 0.006 for mark in MARKS]
    found = [math.sqrt(seen[ring].sum() / bare[ring].sum()) for ring in rings]
    expected = scene(background, optics, 0).context.psf.otf(np.zeros(len(MARKS)), np.array(MARKS))
    np.testing.assert_allclose(found, expected, atol=0.02)


def target_edge(psf: PSF, left: float) -> Floats:
    """Return the pixels 0 .. 399 of a row across the edge of a half-plane to the right of `left`."""
    corners = np.array([[1000.0, -300.0], [1000.0, 700.0], [left, 700.0], [left, -300.0]])
    box = Box.from_edges(left, -300.0, 1000.0, 700.0)
    edges = corners, np.roll(corners, -1, axis=0), np.zeros(4, np.int64)
    drawn = draw_sprite(LayeredPolygons(edges, np.ones(1), box, box, psf, 1000.0))
    row, begin = drawn.alpha[200 - drawn.y0], min(drawn.x0, 400)
    return np.concatenate([np.zeros(begin), row[: 400 - begin]])


@pytest.mark.parametrize(
    ("psf", "tolerance"),
    [
        (GaussianPSF(1.2), 0.015),
        (Lens(defocus_px=4.0).psf("lwir", 0.2), 0.01),
        (Lens(f_number=2.0).psf("mwir", 0.3), 0.05),  # so sharp that the place of the edge within its pixel matters
    ],
)
def test_background_edges_are_as_soft_as_target_edges(psf: PSF, tolerance: float) -> None:
    cover = np.clip(np.arange(400) + 0.5 - 200.75, 0, 1).astype(np.float32)
    found = blurred(np.tile(cover, (400, 1)), psf)[200]
    inside = slice(100, 300)
    np.testing.assert_allclose(found[inside], target_edge(psf, 200.75)[inside], atol=tolerance)


def test_wings_end_beyond_a_panorama() -> None:
    psf, sheet = Lens().psf("lwir", 0.0), PanoramaGrid.of(Geometry((64, 48), 1e-3, 0.0)).between(-5.0, 5.0)
    assert psf.support_px > ROOM
    picture = np.where(np.abs(sheet.rows)[:, None] <= 5, 1.0, 0.0) * np.ones(sheet.shape)
    panorama = Panorama.on(sheet, picture, psf)
    assert np.abs(panorama.padded[[0, -1]]).max() < 1e-5
    assert panorama.padded[round(-panorama.top)].min() > 0.6  # row 0 of the map
