"""Conventions of axes and pixels, and the turning camera."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irsim.geometry.projection import Geometry, gimbal

GEOMETRY = Geometry((320, 240), 5e-4)
angles = st.floats(-3.0, 3.0)


@given(angles, angles, angles)
def test_gimbal_is_a_rotation(azimuth: float, elevation: float, roll: float) -> None:
    turn = gimbal(azimuth, elevation, roll)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_rotations_of_many_frames_at_once_are_those_of_each_to_the_last_bit() -> None:
    turns = np.random.default_rng(0).normal(size=(500, 3))
    lifted = Geometry((320, 240), 5e-4, 0.3)
    np.testing.assert_array_equal(lifted.rotation(turns), np.stack([lifted.rotation(turn) for turn in turns]))


@given(st.floats(-2000, 2000), st.floats(-2000, 2000), st.floats(0.1, 1e5))
def test_a_pixel_s_direction_projects_to_it(x: float, y: float, range_m: float) -> None:
    point = GEOMETRY.place(np.array([x, y]), range_m)
    assert np.linalg.norm(point) == pytest.approx(range_m)
    np.testing.assert_allclose(GEOMETRY.project(point), [x, y], atol=1e-8)


def test_the_axis_falls_between_the_middle_pixels_of_an_even_frame() -> None:
    np.testing.assert_allclose(GEOMETRY.project(np.array([0.0, 0.0, 5.0])), [159.5, 119.5])


def test_x_is_right_y_is_down_and_ifov_holds_at_the_axis() -> None:
    # 1 mrad right and 2 mrad down at 0.5 mrad a pixel: 2 and 4 px.
    np.testing.assert_allclose(GEOMETRY.project(np.array([0.001, 0.002, 1.0])), [161.5, 123.5])


@pytest.mark.parametrize("depth", [0.0, -1.0])
def test_nothing_is_seen_behind_the_camera(depth: float) -> None:
    assert np.isnan(GEOMETRY.project(np.array([0.1, 0.1, depth]))).all()


@pytest.mark.parametrize(
    ("turn", "moves"),
    [((0.001, 0, 0), (-2.0, 0.0)), ((0, 0.001, 0), (0.0, 2.0)), ((0, 0, 0.1), (0.0, 0.0))],
    ids=["right", "up", "roll"],
)
def test_what_the_axis_sees_moves_against_the_turn(turn: tuple[float, ...], moves: tuple[float, float]) -> None:
    # 1 mrad at 0.5 mrad a pixel is 2 px (tan and angle differ by 1e-6 of that).
    seen = GEOMETRY.project(GEOMETRY.rotation(np.array(turn)) @ [0.0, 0.0, 1.0])
    np.testing.assert_allclose(seen - GEOMETRY.principal, moves, atol=1e-5)


def test_roll_turns_the_picture_against_it() -> None:
    # A camera rolled clockwise by 90 degrees sees what was right of the axis above it.
    seen = GEOMETRY.project(GEOMETRY.rotation(np.array([0, 0, np.pi / 2])) @ [0.01, 0.0, 1.0])
    np.testing.assert_allclose(seen - GEOMETRY.principal, [0, -20], atol=1e-9)


@settings(max_examples=30)
@given(st.floats(-1.2, 1.2))
def test_the_first_pointing_is_the_first_camera_frame(elevation: float) -> None:
    geometry = Geometry((64, 64), 1e-3, elevation)
    np.testing.assert_allclose(geometry.rotation(np.zeros(3)), np.eye(3), atol=1e-12)


def test_azimuth_turns_about_the_world_s_vertical() -> None:
    # At 60 degrees of elevation an azimuth turn moves the axis by cos(60) of it, and rolls the picture.
    geometry = Geometry((64, 64), 1e-4, np.pi / 3)
    seen = geometry.project(geometry.rotation(np.array([0.001, 0.0, 0.0])) @ [0.0, 0.0, 1.0])
    np.testing.assert_allclose(seen - geometry.principal, [-5.0, 0.0], atol=0.01)


@pytest.mark.parametrize(
    ("x", "y", "inside"), [(-0.5, 0, True), (-0.51, 0, False), (319.5, 239.5, True), (0, 239.6, False)]
)
def test_the_frame_ends_half_a_pixel_past_the_outer_centres(x: float, y: float, inside: bool) -> None:
    assert GEOMETRY.inside(x, y) is inside
