"""Attitude of bodies along their paths: Euler angles, and the law of each class of target."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_stage import RATE, path

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.rotations import AWAY, euler
from irsim.motion import Path, angles_deg, attitudes
from irsim.motion.attitude import (
    AEROPLANE,
    ARROW,
    BIRD,
    HELICOPTER,
    MULTIROTOR,
    POSTURES,
    STANDARD_GRAVITY,
    UPRIGHT,
    VEHICLE,
    Posture,
    PostureName,
    Rotorcraft,
)
from irsim.targets import SHAPES, Shape
from irsim.types import Floats


class Motion(Path):
    """Constant acceleration until a time, then rest: [east, north, up] m/s and m/s2."""

    velocity: tuple[float, float, float]
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stop_s: float = 1e9
    noise_m: float = 0.0
    """Standard deviation of white noise on each position."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        t = np.minimum(np.asarray(frames) / context.rate_hz, self.stop_s)[:, None]
        east, north, up = (np.asarray(self.velocity) * t + np.asarray(self.acceleration) * t**2 / 2).T
        clean = np.stack([east, -up, 500 + north], axis=-1)
        return clean + self.noise_m * np.random.default_rng(4).standard_normal(clean.shape)


class Circle(Path):
    """Circle of 10 m at 10 m/s, upright before the camera or level."""

    upright: bool
    to_right: bool = False

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        t = np.asarray(frames) / context.rate_hz
        x, other, flat = (-10 if self.to_right else 10) * np.cos(t), 10 * np.sin(t), np.zeros_like(t)
        return np.stack([x, other, 300 + flat] if self.upright else [x, flat, 300 + other], axis=-1)


def level(rate_hz: float = RATE, elevation_rad: float = 0.0) -> SceneContext:
    return SceneContext(2, Geometry((320, 256), 5e-4, elevation_rad), rate_hz, "lwir", 0.6)


def angles(value: Path, posture: Posture, frames: Floats | list[float], context: SceneContext | None = None) -> Floats:
    """Return (n, 3) yaw, pitch, roll, degrees."""
    return angles_deg(attitudes(value, np.asarray(frames, dtype=float), context or level(), "it", posture=posture))


def steps_deg(turns: Floats) -> Floats:
    """Return the angles between consecutive attitudes, (n - 1,)."""
    traces = np.einsum("nij,nij->n", turns[1:], turns[:-1])
    return np.asarray(np.degrees(np.arccos(np.clip((traces - 1) / 2, -1, 1))))


@settings(max_examples=30, deadline=None)
@given(
    st.tuples(*[st.floats(-200, 200)] * 3),
    st.tuples(*[st.floats(-180, 180)] * 3),
    st.sampled_from(sorted(POSTURES)),
)
def test_attitude_is_a_rotation(
    velocity: tuple[float, float, float], offset: tuple[float, float, float], posture: PostureName
) -> None:
    value = Motion(velocity=velocity)
    turns = attitudes(value, np.array([0.0, 3.3]), level(), "jet", offset, (5.0, 0.0, -3.0), POSTURES[posture])
    np.testing.assert_allclose(turns @ np.swapaxes(turns, 1, 2), np.broadcast_to(np.eye(3), (2, 3, 3)), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0)


@given(st.floats(-179, 179), st.floats(-89, 89), st.floats(-179, 179))
def test_angles_invert_euler(yaw: float, pitch: float, roll: float) -> None:
    np.testing.assert_allclose(angles_deg(AWAY @ euler(np.array([yaw, pitch, roll]))), [yaw, pitch, roll], atol=1e-6)


def test_spin_adds_to_the_attitude() -> None:
    turns = attitudes(Motion(velocity=(0, 9, 0)), np.array([0.0, 30.0]), level(), "jet", spin_deg_s=(0.0, 0.0, 40.0))
    np.testing.assert_allclose(angles_deg(turns), [[0, 0, 0], [0, 0, 40]], atol=1e-9)


SLOPE_20 = (8 * np.cos(np.radians(20)), 0.0, 8 * np.sin(np.radians(20)))
SLOPE_60 = (8 * np.cos(np.radians(60.5)), 0.0, 8 * np.sin(np.radians(60.5)))


@pytest.mark.parametrize(
    ("posture", "velocity", "expected"),
    [
        (ARROW, (0, 50, 0), [0, 0, 0]),
        (ARROW, (-50, 0, 0), [-90, 0, 0]),
        (ARROW, (0, 50, 50), [0, 45, 0]),
        (ARROW, (0, 0, 0), [90, 0, 0]),  # right of the camera at rest
        (UPRIGHT, (3, 4, 9), [36.87, 0, 0]),
        (MULTIROTOR, (0, 0, 5), [90, 0, 0]),  # level in a steady climb
        (HELICOPTER, (0, 0, -3), [90, 0, 0]),
        # tan 35 / 20 = 0.03501 s/m; tan 5 / 70 = 0.0012498 s/m
        (MULTIROTOR, (12, 16, 0), [36.87, -35, 0]),
        (MULTIROTOR, (7.2, 9.6, 4), [36.87, -22.79, 0]),
        (HELICOPTER, (42, 56, 4), [36.87, -5, 0]),
        (VEHICLE, SLOPE_20, [90, 20, 0]),
        (VEHICLE, SLOPE_60, [90, 15.5, 0]),  # half of 31, as the slope is half way from 31 to 90
        (VEHICLE, (0, 0, 8), [90, 0, 0]),
        (BIRD, SLOPE_60, [90, 60, 0]),
    ],
)
def test_attitude_at_constant_velocity(posture: Posture, velocity: Any, expected: list[float]) -> None:
    np.testing.assert_allclose(angles(Motion(velocity=velocity), posture, [0.0, 40.0, 90.5]), [expected] * 3, atol=5e-3)


def test_wings_are_level_with_the_world() -> None:
    """Camera up by 0.1 rad: the down axis of a jet that flies right leans towards the camera."""
    jet = path(kind="straight", start=[159.5, 127.5], speed=1.0)
    turn = attitudes(jet, np.array([0.0]), level(elevation_rad=0.1), "jet")[0]
    np.testing.assert_allclose(turn @ [0, 0, 1], [0, np.cos(0.1), -np.sin(0.1)], atol=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("posture", "speed", "radius"), [(AEROPLANE, 100.0, 1500.0), (MULTIROTOR, 8.0, 16.0)])
def test_bank_of_a_coordinated_turn(posture: Posture, speed: float, radius: float, side: float) -> None:
    """tan(bank) = v^2 / (r g), into the turn."""
    angle = np.linspace(0, 4, 160)
    points = np.stack([side * radius * (1 - np.cos(angle)), 0 * angle, 2000 + radius * np.sin(angle)], axis=1)
    value = path(kind="waypoints_m", points=points.tolist(), speed_m_s=speed)
    turn = attitudes(value, np.array([100.0]), level(), "it", posture=posture)[0]
    yaw = side * speed / radius * 100 / RATE
    up = -turn[:, 2]
    lean = up @ [np.cos(yaw), 0, -np.sin(yaw)] / -up[1]
    assert lean == pytest.approx(side * speed**2 / radius / STANDARD_GRAVITY, rel=0.01)
    assert angles_deg(turn)[0] == pytest.approx(np.degrees(yaw), rel=0.01)


def test_rotorcraft_balances_gravity_acceleration_and_drag() -> None:
    """At 2 s it moves at 3 m/s, brakes by 2 m/s2 and begins to sink by 1 m/s2: nose up."""
    value = Motion(velocity=(0, 7, 0), acceleration=(0, -2, -1))
    for craft in (MULTIROTOR, HELICOPTER):
        drag = STANDARD_GRAVITY * np.tan(np.radians(craft.tilt_deg)) / craft.speed_m_s
        pitch = np.degrees(np.arctan2(2 - 3 * drag, STANDARD_GRAVITY - 1))
        np.testing.assert_allclose(angles(value, craft, [60.0]), [[0, pitch, 0]], atol=1e-6)


@pytest.mark.parametrize("acceleration", [(0, 90, 0), (30, -40, -20), (0, 0, -30)], ids=["ahead", "down", "falling"])
def test_largest_tilt_of_a_rotorcraft(acceleration: tuple[float, float, float]) -> None:
    for craft in (MULTIROTOR, HELICOPTER):
        value = Motion(velocity=(0, 5, 0), acceleration=acceleration)
        turns = attitudes(value, np.arange(0.0, 60.0), level(), "it", posture=craft)
        assert np.degrees(np.arccos(turns[:, 1, 2])).max() <= craft.steepest_deg + 1e-6


def test_infeasible_loop_does_not_flip_a_rotorcraft() -> None:
    """110 m/s2 that turn by 60 degrees a second, limited to g tan(35) = 0.7002 g: without drag the tilt changes fastest
    where they point down, by 0.7002 / (1 - 0.7002) * 60 degrees a second, 4.67 a frame."""
    angle = np.arange(0, 400) * np.radians(60) / RATE
    points = np.stack([100 * np.sin(angle), 100 * np.cos(angle), 500 + 0 * angle], axis=1)
    value = path(kind="waypoints_m", points=points.tolist(), frames=list(range(400)))
    craft = Rotorcraft(speed_m_s=20, tilt_deg=0, steepest_deg=35, turn_deg_s=200)
    ups = -attitudes(value, np.arange(90.0, 300.0), level(), "it", posture=craft)[:, :, 2]
    steps = np.degrees(np.arccos(np.clip(np.sum(ups[1:] * ups[:-1], axis=1), -1, 1)))
    assert steps.max() == pytest.approx(4.67, abs=0.05)


def test_heading_is_kept_at_rest_and_turns_at_its_rate() -> None:
    parked = Motion(velocity=(-9, 0, 1.6), stop_s=2.0)
    slope = np.degrees(np.arctan(1.6 / 9))
    np.testing.assert_allclose(angles(parked, VEHICLE, [30.0, 150.0]), [[-90, slope, 0]] * 2, atol=0.5)
    value = path(kind="waypoints_m", points=[[0, 0, 100], [20, 0, 100], [0, 0, 100]], frames=[0, 90, 180])
    yaw = np.unwrap(angles(value, MULTIROTOR, np.arange(0, 180.0))[:, 0], period=360)
    assert abs(yaw[-1] - yaw[0]) == pytest.approx(180, abs=1)
    assert np.abs(np.diff(yaw)).max() == pytest.approx(MULTIROTOR.turn_deg_s / RATE, rel=1e-6)


@pytest.mark.parametrize(("range_m", "pitch", "bank"), [(400, -22.79, 1.94), (40, -2.41, 0.21)])
def test_attitude_on_a_path_in_pixels(range_m: float, pitch: float, bank: float) -> None:
    """2 px a frame of 5e-4 rad at 400 m and 30 Hz are 12 m/s. At a constant range v^2 / r is 0.36 m/s2."""
    value = path(kind="straight", start=[150, 127.5], speed=2.0, range_m=range_m)
    np.testing.assert_allclose(angles(value, MULTIROTOR, [5.0]), [[90, pitch, bank]], atol=0.05)


@pytest.mark.parametrize("posture", [UPRIGHT, VEHICLE])
def test_attitude_on_ground_below_the_camera(posture: Posture) -> None:
    """Up the picture is away from the camera."""
    value = path(kind="straight", start=[160, 200], speed=0.2, heading_deg=-90, ground_m=5)
    found = angles(value, posture, [0.0, 20.0])
    np.testing.assert_allclose(found[:, 1:], 0.0, atol=1e-9)
    np.testing.assert_allclose(found[:, 0], 0.0, atol=1.0)


def test_noise_of_a_path_hardly_tilts_a_rotorcraft() -> None:
    """White noise of sigma 0.05 m, least squares over 11 positions within 0.5 s to each side: the acceleration's sigma
    is 2 * 0.05 / sqrt(sum of (t^2 - mean t^2)^2) = 0.342 m/s2."""
    value = Motion(velocity=(0, 0, 0), noise_m=0.05)
    turns = attitudes(value, np.arange(400.0), level(), "it", posture=MULTIROTOR)
    tilt = np.arccos(turns[:, 1, 2])
    assert np.sqrt(np.mean(tilt**2)) == pytest.approx(np.sqrt(2) * 0.342 / STANDARD_GRAVITY, rel=0.1)


@pytest.mark.parametrize(("to_right", "lowered"), [(True, 1), (False, -1)])
def test_bird_banks_into_a_level_turn(to_right: bool, lowered: int) -> None:
    """tan(bank) = v omega / g at 10 m/s and 1 rad/s, which the fit over a second underestimates by 2 %."""
    value, frames = Circle(upright=False, to_right=to_right), np.array([100.0, 131.3])
    bank = np.arctan(10 / STANDARD_GRAVITY)
    wing = attitudes(value, frames, level(), "it", posture=BIRD)[:, :, 1]
    np.testing.assert_allclose(wing @ level().geometry.down, lowered * np.sin(bank), rtol=0.03)
    np.testing.assert_allclose(angles(value, BIRD, frames)[:, 1], 0.0, atol=1e-6)


def test_bird_in_a_loop_stays_upright() -> None:
    """180 degrees a second of yaw are 6 a frame, while the bank reverses; an arrow would turn by 180 at once."""
    turns = attitudes(Circle(upright=True), np.arange(0.0, 400.0), level(), "it", posture=BIRD)
    found = angles_deg(turns)
    assert np.abs(found[:, 1]).max() == pytest.approx(60, abs=0.01)
    assert np.abs(found[:, 2]).max() <= 60 + 1e-6
    assert turns[:, 1, 2].min() >= np.cos(np.radians(60)) ** 2 - 1e-9
    assert 4 < steps_deg(turns).max() < 14


@pytest.mark.parametrize(("posture", "limit"), [(AEROPLANE, 20), (MULTIROTOR, 4)])
@pytest.mark.parametrize("kind", ["manoeuvre", "singer"])
def test_attitude_has_no_jumps(kind: str, posture: Posture, limit: float) -> None:
    turns = attitudes(
        path(kind=kind, start=[160, 128], range_m=100), np.arange(0, 100, 0.1), level(), "it", posture=posture
    )
    assert steps_deg(turns).max() < limit


def test_posture_of_each_shape(tmp_path: Any) -> None:
    expected = {"quadrotor": MULTIROTOR, "helicopter": HELICOPTER, "boat": UPRIGHT, "bird": BIRD, "tank": VEHICLE}
    for name, posture in expected.items():
        kind = SHAPES.find(name)
        assert issubclass(kind, Shape)
        assert kind.default_posture is posture
    file = tmp_path / "tetra.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    for name in get_args(PostureName):
        mesh = SHAPES.parse({"kind": "mesh", "file": str(file), "length_m": 1.0, "lies_as": name})
        assert isinstance(mesh, Shape)
        assert mesh.posture is POSTURES[name]
    assert set(get_args(PostureName)) == set(POSTURES)
    assert all(a != b for a, b in pairwise(POSTURES.values()))
