"""Textures repeat without a seam, and are no larger than pictures that are much longer than wide need."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from country import context, view_direction

from irsim.backgrounds import Ground
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.ground_cover import Roads
from irsim.backgrounds.texture import PeriodicTexture, tile_shape
from irsim.physics.psf import GaussianPSF
from irsim.types import Floats


@pytest.mark.parametrize(
    ("frame", "shape"),
    [
        ((640, 512), (1024, 1024)),
        ((1280, 720), (2048, 2048)),
        ((4096, 3000), (4096, 4096)),
        ((4096, 16), (1024, 4096)),
        ((16, 3000), (4096, 1024)),
    ],
)
def test_a_texture_is_as_large_as_its_frame(frame: tuple[int, int], shape: tuple[int, int]) -> None:
    assert tile_shape(frame) == shape


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.3, -0.2, 0.0), (0.0, 0.0, 1.2), (0.0, 0.0, np.pi / 2)])
def test_a_strip_sees_its_texture_however_it_is_turned(turn: tuple[float, float, float]) -> None:
    scene = context(size=(2500, 16))
    texture = np.random.default_rng(1).normal(size=tile_shape((2500, 16))).astype(np.float32)
    tile, chart = PeriodicTexture.of(texture, (2500, 16), GaussianPSF(0.5)), view_direction(scene, turn=turn).chart
    expected = _wrapped(tile, chart, (0.0, 0.0))
    np.testing.assert_allclose(tile.at(*tile.places(chart, (0.0, 0.0))), expected, rtol=0, atol=0.15)
    assert np.std(tile.at(*tile.places(chart, (0.0, 0.0))) - expected) < 0.02 * np.std(expected)


@pytest.mark.parametrize("size", [(640, 512), (2500, 16), (16, 2500)])
@pytest.mark.parametrize("axis", [0, 1])
def test_there_is_no_seam_where_a_texture_that_drifts_comes_in(size: tuple[int, int], axis: int) -> None:
    """The outermost nodes of the chart are just right of the texture's edge, the outermost pixels are still left."""
    texture = np.random.default_rng(1).normal(size=tile_shape(size)).astype(np.float32)
    tile, chart = PeriodicTexture.of(texture, size, GaussianPSF(0.5)), view_direction(context(size=size)).chart
    shift = [0.0, 0.0]
    shift[axis] = float(chart.uv[axis].min()) + tile.phase[axis] - 0.01
    right, down = shift
    found = tile.at(*tile.places(chart, (right, down)))
    np.testing.assert_allclose(found, _wrapped(tile, chart, (right, down)), rtol=0, atol=0.01)


def _wrapped(tile: PeriodicTexture, chart: Chart, shift: tuple[float, float]) -> Floats:
    """The texture where each pixel sees it, wrapped by whole numbers."""
    soft = tile.padded[: tile.shape[0], : tile.shape[1]]
    columns, rows = (
        np.mod(chart.at_pixels(at - by + phase), period).astype(np.float32)
        for at, by, phase, period in zip(chart.uv, shift, tile.phase, tile.shape[::-1], strict=True)
    )
    return np.asarray(cv2.remap(np.pad(soft, (0, 1), mode="wrap"), columns, rows, cv2.INTER_LINEAR))


def test_roads_are_as_many_on_each_px_of_a_strip() -> None:
    square, strip = (float((Roads(count=6).inside(shape, 2.0, 1) > 0).mean()) for shape in ((2048, 2048), (1024, 4096)))
    assert strip == pytest.approx(square, rel=0.15)


def test_ground_with_all_on_it_fills_a_strip_evenly() -> None:
    scene = context(size=(4096, 16))
    ground = Ground.model_validate({"fields": {}, "roads": {}, "water": {"share": 0.3}, "clutter": {"per_mrad2": 0.01}})
    for layer in ground.layers(scene):
        emission = layer.light(view_direction(scene))[1]
        assert emission.shape == (16, 4096)
        assert emission.std() > 0
        halves = emission[:, :2048], emission[:, 2048:]
        assert not np.allclose(*halves)
