"""How rotorcraft hang from their rotors, and what stands upright."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, get_args

import numpy as np
import pytest

from irsim.config.base import Kind
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion import PATHS, Path, angles_deg, attitudes
from irsim.motion.attitude import (
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

ROTORCRAFT = pytest.mark.parametrize("craft", [MULTIROTOR, HELICOPTER], ids=["multirotor", "helicopter"])
RATE_HZ = 30.0


class Thrust(Path):
    """Steady acceleration."""

    velocity: tuple[float, float, float]
    """[east, north, up] at frame 0, m/s."""
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """[east, north, up], m/s2."""
    wander_m: float = 0.0
    """Standard deviation of white noise on every place."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        t = np.asarray(frames)[:, None] / context.rate_hz
        east, north, up = (np.asarray(self.velocity) * t + np.asarray(self.acceleration) * t**2 / 2).T
        places = np.stack([east, -up, 500 + north], axis=-1)
        return places + self.wander_m * np.random.default_rng(4).standard_normal(places.shape)


class Stop(Path):
    """6 m/s to the left for 3 s, even braking for 2 s, rest."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        t = np.asarray(frames) / context.rate_hz
        way = 6 * np.minimum(t, 3) + 6 * np.clip(t - 3, 0, 2) - 1.5 * np.clip(t - 3, 0, 2) ** 2
        return np.stack([-way, 0 * t, 0 * t + 500], axis=-1)


def level(rate_hz: float = RATE_HZ, elevation_rad: float = 0.0) -> SceneContext:
    return SceneContext(2, Geometry((320, 256), 5e-4, elevation_rad), rate_hz, "lwir", 0.6)


def path(**keys: Any) -> Path:
    value = PATHS.parse(keys)
    assert isinstance(value, Path)
    return value


def angles(value: Path, posture: Posture, frames: Floats | list[float], context: SceneContext | None = None) -> Floats:
    """(n, 3) yaw, pitch, roll, degrees."""
    return angles_deg(attitudes(value, np.asarray(frames, dtype=float), context or level(), "it", posture=posture))


def drag(craft: Rotorcraft) -> float:
    """1/s: horizontal deceleration over speed."""
    return STANDARD_GRAVITY * float(np.tan(np.radians(craft.tilt_deg))) / craft.speed_m_s


@ROTORCRAFT
@pytest.mark.parametrize("climb", [0.0, 5.0, -3.0], ids=["hover", "climb", "descent"])
def test_it_is_level_in_hover_and_in_a_steady_climb(craft: Rotorcraft, climb: float) -> None:
    found = angles(Thrust(velocity=(0, 0, climb)), craft, [0.0, 40.0, 90.5])
    np.testing.assert_allclose(found, [[90, 0, 0]] * 3, atol=1e-6)


@pytest.mark.parametrize(
    ("craft", "speed", "pitch"),
    # tan 35 / 20 = 0.03501 s/m; tan 5 / 70 = 0.0012498 s/m
    [(MULTIROTOR, 20.0, -35.0), (MULTIROTOR, 12.0, -22.79), (MULTIROTOR, 50 / 3.6, -25.93), (HELICOPTER, 70.0, -5.0)],
)
@pytest.mark.parametrize("climb", [0.0, 4.0], ids=["level", "climbing"])
def test_its_nose_is_down_by_the_tilt_of_its_speed(craft: Rotorcraft, speed: float, pitch: float, climb: float) -> None:
    found = angles(Thrust(velocity=(0.6 * speed, 0.8 * speed, climb)), craft, [0.0, 60.0])
    np.testing.assert_allclose(found, [[np.degrees(np.arctan2(0.6, 0.8)), pitch, 0.0]] * 2, atol=5e-3)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["right", "left"])
def test_it_leans_into_a_coordinated_turn(side: float) -> None:
    # 8 m/s at 0.5 rad/s: radius 16 m, atan(v omega / g) = 22.19 degrees across the heading.
    speed, omega = 8.0, 0.5
    angle = np.linspace(0, 4, 120)
    points = np.stack([side * 16 * (1 - np.cos(angle)), 0 * angle, 100 + 16 * np.sin(angle)], axis=1)
    value = path(kind="waypoints_m", points=points.tolist(), speed_m_s=speed)
    turn = attitudes(value, np.array([100.0]), level(), "it", posture=MULTIROTOR)[0]
    yaw = side * omega * 100 / RATE_HZ
    right, ahead = np.array([np.cos(yaw), 0, -np.sin(yaw)]), np.array([np.sin(yaw), 0, np.cos(yaw)])
    up = -turn[:, 2]
    assert np.degrees(np.arctan2(up @ right, -up[1])) == pytest.approx(side * 22.19, rel=0.01)
    assert np.degrees(np.arctan2(up @ ahead, -up[1])) == pytest.approx(np.degrees(np.arctan(0.03501 * speed)), rel=0.01)
    assert angles_deg(turn)[0] == pytest.approx(np.degrees(yaw), rel=0.01)


@ROTORCRAFT
def test_its_attitude_balances_gravity_acceleration_and_drag(craft: Rotorcraft) -> None:
    # At frame 60, 2 s: 7 - 2 * 2 = 3 m/s ahead, braking by 2 m/s2 while it begins to sink by 1 m/s2: nose up.
    value = Thrust(velocity=(0, 7, 0), acceleration=(0, -2, -1))
    push, lift = -2 + drag(craft) * 3, STANDARD_GRAVITY - 1
    np.testing.assert_allclose(angles(value, craft, [60.0]), [[0, -np.degrees(np.arctan2(push, lift)), 0]], atol=1e-6)
    assert push < 0


@ROTORCRAFT
@pytest.mark.parametrize("acceleration", [(0, 90, 0), (30, -40, -20), (0, 0, -30)], ids=["ahead", "down", "falling"])
def test_it_tilts_no_more_than_its_steepest(craft: Rotorcraft, acceleration: tuple[float, float, float]) -> None:
    value = Thrust(velocity=(0, 5, 0), acceleration=acceleration)
    turns = attitudes(value, np.arange(0.0, 60.0), level(), "it", posture=craft)
    tilt = np.degrees(np.arccos(turns[:, 1, 2]))
    assert tilt.max() <= craft.steepest_deg + 1e-6


def test_a_loop_that_no_rotorcraft_flies_does_not_throw_it_about() -> None:
    # 110 m/s2 that turn by 60 degrees a second, cut to g tan(35) = 0.7002 g: without drag the tilt changes fastest
    # where they point straight down, by 0.7002 / (1 - 0.7002) * 60 degrees a second, 4.67 a frame.
    angle = np.arange(0, 600) * np.radians(60) / RATE_HZ
    points = np.stack([100 * np.sin(angle), 100 * np.cos(angle), 500 + 0 * angle], axis=1)
    value = path(kind="waypoints_m", points=points.tolist(), frames=list(range(600)))
    craft = Rotorcraft(speed_m_s=20, tilt_deg=0, steepest_deg=35, turn_deg_s=200)
    ups = -attitudes(value, np.arange(90.0, 450.0), level(), "it", posture=craft)[:, :, 2]
    steps = np.degrees(np.arccos(np.clip(np.sum(ups[1:] * ups[:-1], axis=1), -1, 1)))
    assert steps.max() == pytest.approx(4.67, abs=0.05)


def test_it_noses_up_where_it_stops_and_keeps_its_heading_there() -> None:
    # 6 m/s to the left: pitch -atan(0.03501 * 6). From 3 s to 5 s it brakes by 3 m/s2: half way, at 3 m/s, it
    # pitches up by atan(3 / 9.80665 - 0.03501 * 3).
    found = angles(Stop(), MULTIROTOR, [0.0, 70.0, 120.0, 170.0, 300.0])
    expected = [-11.86, -11.86, 11.36, 0.0, 0.0]
    np.testing.assert_allclose(found, [[-90.0, pitch, 0.0] for pitch in expected], atol=0.01)


def test_what_comes_back_the_way_it_went_turns_at_its_rate() -> None:
    value = path(kind="waypoints_m", points=[[0, 0, 100], [20, 0, 100], [0, 0, 100]], frames=[0, 90, 180])
    found = np.unwrap(angles(value, MULTIROTOR, np.arange(0, 180.0))[:, 0], period=360)
    steps = np.abs(np.diff(found))
    assert found[0] == pytest.approx(90, abs=1e-6)
    assert abs(found[-1] - found[0]) == pytest.approx(180, abs=1)
    assert steps.max() == pytest.approx(MULTIROTOR.turn_deg_s / RATE_HZ, rel=1e-6)


def test_metres_of_a_path_in_pixels_follow_from_range_and_ifov() -> None:
    # 2 px a frame of 5e-4 rad at 400 m and 30 Hz: 12 m/s across. The same path ten times as near is 1.2 m/s.
    # A range that stays is a circle about the camera: v^2 / r is 0.36 m/s2, which leans it towards us.
    for range_m, pitch, bank in ((400, -22.79, 1.94), (40, -2.41, 0.21)):
        value = path(kind="straight", start=[150, 127.5], speed=2.0, range_m=range_m)
        np.testing.assert_allclose(angles(value, MULTIROTOR, [5.0]), [[90, pitch, bank]], atol=0.05)


def test_a_climb_in_pixels_is_level_whatever_the_cameras_elevation() -> None:
    value = path(kind="straight", start=[160, 200], speed=1.0, heading_deg=-90, range_m=60)
    for elevation in (0.0, 0.3):
        turns = attitudes(value, np.arange(60.0), level(elevation_rad=elevation), "it", posture=MULTIROTOR)
        tilt = np.degrees(np.arccos(turns[:, :, 2] @ level(elevation_rad=elevation).geometry.down))
        assert tilt.max() < 1.5  # 0.9 m/s up at most leans back by sin(0.3) of it: 0.53 degrees of drag


@pytest.mark.parametrize("rate_hz", [25.0, 100.0])
def test_noise_of_a_path_hardly_tilts_it(rate_hz: float) -> None:
    # White noise of sigma 0.05 m, least squares over 11 places within 0.5 s to each side: the acceleration's sigma is
    # 2 * 0.05 / sqrt(sum of (t^2 - mean t^2)^2) = 0.342 m/s2, twice as much as 0.5 m/s2 has tilt 5.5 degrees.
    value = Thrust(velocity=(0, 0, 0), wander_m=0.05)
    turns = attitudes(value, np.arange(400.0), level(rate_hz), "it", posture=MULTIROTOR)
    tilt = np.degrees(np.arccos(turns[:, 1, 2]))
    # Its mean square is that of the acceleration on two axes, over g, and a little for the drag.
    assert np.sqrt(np.mean(np.radians(tilt) ** 2)) == pytest.approx(np.sqrt(2) * 0.342 / STANDARD_GRAVITY, rel=0.1)


@pytest.mark.parametrize("kind", ["manoeuvre", "singer", "jump", "stop_and_go", "weave"])
def test_it_turns_smoothly_and_each_frame_stands_alone(kind: str) -> None:
    value = path(kind=kind, start=[160, 128], range_m=100)
    frames = np.arange(0, 150, 0.25)
    turns = attitudes(value, frames, level(), "it", posture=MULTIROTOR)
    between = np.einsum("nij,nij->n", turns[1:], turns[:-1])
    steps = np.degrees(np.arccos(np.clip((between - 1) / 2, -1, 1)))
    # Yaw by 200 degrees a second at most is 1.7 in a quarter of a frame; tilting adds as much again at the most.
    assert steps.max() < 4
    for one in (0, 57, 402):
        alone = attitudes(value, frames[one : one + 1], level(), "it", posture=MULTIROTOR)
        np.testing.assert_array_equal(alone[0], turns[one])


@pytest.mark.parametrize("heading_deg", [-90.0, 90.0, -40.0], ids=["up", "down", "slant"])
@pytest.mark.parametrize("shape", ["pedestrian", "boat"])
def test_what_stands_upright_does_so_up_and_down_the_picture(shape: str, heading_deg: float) -> None:
    posture = SHAPES.parse({"kind": shape}).posture  # type: ignore[attr-defined]  # a body's shape has one
    for elevation in (0.0, -0.4):
        context = level(elevation_rad=elevation)
        value = path(kind="straight", start=[160, 128], speed=0.5, heading_deg=heading_deg, range_m=100)
        turns = attitudes(value, np.arange(60.0), context, "it", posture=posture)
        np.testing.assert_allclose(turns[:, :, 2], [context.geometry.down] * 60, atol=1e-12)


def test_it_looks_where_it_goes_over_the_ground() -> None:
    # Up the picture below a level camera is away from it, over ground 5 m below.
    value = path(kind="straight", start=[160, 200], speed=0.2, heading_deg=-90, ground_m=5)
    np.testing.assert_allclose(angles(value, UPRIGHT, [0.0, 20.0])[:, 1:], 0.0, atol=1e-9)
    np.testing.assert_allclose(angles(value, UPRIGHT, [0.0, 20.0])[:, 0], 0.0, atol=1.0)


def test_every_shape_has_a_posture_and_a_users_own_body_may_have_any(tmp_path: Any) -> None:
    expected: dict[str, Posture] = {
        "quadrotor": MULTIROTOR,
        "helicopter": HELICOPTER,
        "pedestrian": UPRIGHT,
        "boat": UPRIGHT,
        "bird": BIRD,
    }
    expected |= dict.fromkeys(("tank", "truck", "car"), VEHICLE)
    for name, posture in expected.items():
        kind = SHAPES.find(name)
        assert issubclass(kind, Shape)
        assert kind.default_posture is posture
    file = tmp_path / "tetra.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    for name in get_args(PostureName):
        own: Kind = SHAPES.parse({"kind": "mesh", "file": str(file), "length_m": 1.0, "lies_as": name})
        assert isinstance(own, Shape)
        assert own.posture is POSTURES[name]


def test_each_posture_is_listed_once() -> None:
    assert set(get_args(PostureName)) == set(POSTURES)
    assert all(a != b for a, b in pairwise(POSTURES.values()))
