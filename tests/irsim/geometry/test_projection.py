"""Axes and pixels of the pinhole projection, rotation of the camera, and matrix products in blocks."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.geometry.projection import Geometry, blocked_matmul, gimbal

GEOMETRY = Geometry((320, 240), 5e-4)


def test_gimbal_is_a_rotation() -> None:
    turns = gimbal(*np.random.default_rng(0).uniform(-3, 3, (3, 50)))
    np.testing.assert_allclose(turns @ turns.swapaxes(1, 2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0)


def test_projection_inverts_directions() -> None:
    pixels = np.random.default_rng(0).uniform(-2000, 2000, (50, 2))
    for range_m in (0.1, 1e5):
        points = GEOMETRY.place(pixels, range_m)
        np.testing.assert_allclose(np.linalg.norm(points, axis=-1), range_m)
        np.testing.assert_allclose(GEOMETRY.project(points), pixels, atol=1e-8)


@pytest.mark.parametrize(
    ("point", "pixel"),
    [
        ((0.0, 0.0, 5.0), (159.5, 119.5)),  # the axis falls between the middle pixels of an even frame
        ((0.001, 0.002, 1.0), (161.5, 123.5)),  # 1 mrad right and 2 mrad down at 0.5 mrad a pixel
        ((0.1, 0.1, 0.0), (np.nan, np.nan)),
        ((0.1, 0.1, -1.0), (np.nan, np.nan)),
    ],
    ids=["axis", "right and down", "in the camera's plane", "behind"],
)
def test_pixels_of_points(point: tuple[float, ...], pixel: tuple[float, ...]) -> None:
    np.testing.assert_allclose(GEOMETRY.project(np.array(point)), pixel)


@pytest.mark.parametrize(
    ("turn", "point", "moves"),
    [
        # 1 mrad at 0.5 mrad a pixel is 2 px (tan and angle differ by 1e-6 of that).
        ((0.001, 0, 0), (0, 0, 1), (-2, 0)),
        ((0, 0.001, 0), (0, 0, 1), (0, 2)),
        ((0, 0, 0.1), (0, 0, 1), (0, 0)),
        # Rolled clockwise by 90 degrees, the camera sees a point right of the axis above it.
        ((0, 0, np.pi / 2), (0.01, 0, 1), (0, -20)),
    ],
    ids=["right", "up", "roll", "roll off the axis"],
)
def test_the_picture_moves_against_the_turn(
    turn: tuple[float, ...], point: tuple[float, ...], moves: tuple[float, ...]
) -> None:
    seen = GEOMETRY.project(GEOMETRY.rotation(np.array(turn, float)) @ np.array(point, float))
    np.testing.assert_allclose(seen - GEOMETRY.principal, moves, atol=1e-5)


def test_the_first_pointing_is_the_first_camera_frame() -> None:
    geometry = Geometry((64, 64), 1e-3, -1.2)
    np.testing.assert_allclose(geometry.rotation(np.zeros(3)), np.eye(3), atol=1e-12)


def test_azimuth_turns_about_the_vertical() -> None:
    # At 60 degrees of elevation an azimuth turn moves the axis by cos(60) of it, and rolls the picture.
    geometry = Geometry((64, 64), 1e-4, np.pi / 3)
    seen = geometry.project(geometry.rotation(np.array([0.001, 0.0, 0.0])) @ [0.0, 0.0, 1.0])
    np.testing.assert_allclose(seen - geometry.principal, [-5.0, 0.0], atol=0.01)


@pytest.mark.parametrize(
    ("x", "y", "inside"), [(-0.5, 0, True), (-0.51, 0, False), (319.5, 239.5, True), (0, 239.6, False)]
)
def test_the_frame_ends_half_a_pixel_past_its_pixels(x: float, y: float, inside: bool) -> None:
    assert GEOMETRY.inside(x, y) is inside


def test_blocked_products_are_exact() -> None:
    """Whole numbers add up without rounding; einsum does not use BLAS."""
    draws = np.random.default_rng(1)
    for shape in ((2, 300, 300), (300, 300)):
        left = draws.integers(-9, 9, (900, 300)).astype(np.float64)
        right = draws.integers(-9, 9, shape).astype(np.float64)
        np.testing.assert_array_equal(blocked_matmul(left, right), np.einsum("mk,...kn->...mn", left, right))
