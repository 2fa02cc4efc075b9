"""How vehicles keep to the ground, and how birds keep upright."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion import PATHS, Path, angles_deg, attitudes
from irsim.motion.attitude import BIRD, STANDARD_GRAVITY, VEHICLE, Posture
from irsim.targets import SHAPES, Shape
from irsim.types import Floats

RATE_HZ = 30.0


class Line(Path):
    """A steady velocity, [right, ahead, up] m/s, until it stops."""

    velocity: tuple[float, float, float]
    stops_s: float = math.inf

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        t = np.minimum(np.asarray(frames) / context.rate_hz, self.stops_s)[:, None]
        right, ahead, up = (np.asarray(self.velocity) * t).T
        return np.stack([right, -up, 300 + ahead], axis=-1)


class Round(Path):
    """A circle of 10 m at 10 m/s: upright before the camera, or level; to the left as it stands, or to the right."""

    upright: bool
    to_right: bool = False

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        t = np.asarray(frames) / context.rate_hz
        one, other = (-10 if self.to_right else 10) * np.cos(t), 10 * np.sin(t)
        flat = np.zeros_like(t)
        return np.stack([one, other, 300 + flat] if self.upright else [one, flat, 300 + other], axis=-1)


def level(elevation_rad: float = 0.0) -> SceneContext:
    return SceneContext(2, Geometry((320, 256), 5e-4, elevation_rad), RATE_HZ, "lwir", 0.6)


def angles(value: Path, posture: Posture, frames: Any, context: SceneContext | None = None) -> Floats:
    """(n, 3) yaw, pitch, roll, degrees."""
    return angles_deg(attitudes(value, np.asarray(frames, dtype=float), context or level(), "it", posture=posture))


def path(**keys: Any) -> Path:
    value = PATHS.parse(keys)
    assert isinstance(value, Path)
    return value


@pytest.mark.parametrize("slope_deg", [-31.0, -12.0, 0.0, 5.0, 20.0, 31.0])
def test_a_vehicle_lies_on_its_slope(slope_deg: float) -> None:
    along, up = 8 * math.cos(math.radians(slope_deg)), 8 * math.sin(math.radians(slope_deg))
    for yaw in (0.0, 70.0, -150.0):
        value = Line(velocity=(along * math.sin(math.radians(yaw)), along * math.cos(math.radians(yaw)), up))
        np.testing.assert_allclose(angles(value, VEHICLE, [0.0, 30.0]), [[yaw, slope_deg, 0]] * 2, atol=1e-6)


def test_a_vehicle_never_rears_up() -> None:
    """Beyond 31 degrees it falls off evenly, to nothing straight up: at 60.5, half way, it is 15.5."""
    for slope_deg, expected in ((45.0, 31 * 45 / 59), (60.5, 15.5), (-60.5, -15.5), (90.0, 0.0), (-90.0, 0.0)):
        slope = math.radians(slope_deg)
        value = Line(velocity=(8 * math.cos(slope), 0.0, 8 * math.sin(slope)))
        assert angles(value, VEHICLE, [10.0])[0, 1] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("shape", ["tank", "truck", "car"])
@pytest.mark.parametrize("heading_deg", [-90.0, 90.0])
def test_straight_up_or_down_the_picture_vehicles_are_level(shape: str, heading_deg: float) -> None:
    """And drive away, or come, where the camera looks down at them."""
    kind = SHAPES.parse({"kind": shape})
    assert isinstance(kind, Shape)
    value = path(kind="straight", start=[159.5, 127.5], speed=1.0, heading_deg=heading_deg, range_m=300)
    context, frames = level(-0.3), np.arange(40.0)
    turns = attitudes(value, frames, context, "it", posture=kind.posture)
    nose, right, down = np.moveaxis(turns, 2, 0)
    pitch = np.degrees(np.arcsin(-(nose @ context.geometry.down)))
    # The camera looks down by 0.3 rad, and a pixel of 5e-4 rad less or more each frame: at a steady range, up the
    # picture is so many degrees from the vertical.
    away = np.sign(-heading_deg)
    off = np.degrees(0.3 - away * 5e-4 * frames)
    np.testing.assert_allclose(pitch, away * 31 * off / 59, atol=0.02)
    np.testing.assert_allclose(right, [[away, 0, 0]] * 40, atol=1e-9)
    assert (np.sign(nose[:, 2]) == away).all()
    assert (down @ context.geometry.down).min() > math.cos(math.radians(10))


def test_a_vehicle_that_stops_stays_as_it_stands() -> None:
    slope = math.radians(10)
    value = Line(velocity=(-9 * math.cos(slope), 0.0, 9 * math.sin(slope)), stops_s=2.0)
    found = angles(value, VEHICLE, [30.0, 100.0, 150.0])
    np.testing.assert_allclose(found, [[-90, 10, 0]] * 3, atol=0.5)


def test_on_ground_below_the_camera_it_is_level_and_looks_where_it_drives() -> None:
    value = path(kind="straight", start=[160, 200], speed=0.2, heading_deg=-90, ground_m=5)
    np.testing.assert_allclose(angles(value, VEHICLE, [0.0, 20.0])[:, 1:], 0.0, atol=1e-9)
    np.testing.assert_allclose(angles(value, VEHICLE, [0.0, 20.0])[:, 0], 0.0, atol=1.0)


@pytest.mark.parametrize(("to_right", "lowered"), [(True, 1), (False, -1)])
def test_a_bird_banks_into_a_level_turn(to_right: bool, lowered: int) -> None:
    """A turn to the right lowers the right wing, one to the left raises it."""
    # tan(bank) = v omega / g at 10 m/s and 1 rad/s; over half a second to each side that seems 2 % weaker.
    value, frames = Round(upright=False, to_right=to_right), np.array([100.0, 131.3])
    found = angles(value, BIRD, frames)
    bank = math.degrees(math.atan(10 / STANDARD_GRAVITY))
    np.testing.assert_allclose(np.abs(found[:, 2]), bank, rtol=0.03)
    np.testing.assert_allclose(found[:, 1], 0.0, atol=1e-6)
    right_wing = attitudes(value, frames, level(), "it", posture=BIRD)[:, :, 1]
    np.testing.assert_allclose(right_wing @ level().geometry.down, lowered * math.sin(math.radians(bank)), rtol=0.03)


def test_a_bird_goes_through_the_vertical_without_rolling_over() -> None:
    """A loop before the camera: pitched by no more than 60 degrees, its back up, and it turns no faster than it may."""
    frames = np.arange(0.0, 400.0)
    turns = attitudes(Round(upright=True), frames, level(), "it", posture=BIRD)
    angles = angles_deg(turns)
    assert np.abs(angles[:, 1]).max() == pytest.approx(60, abs=0.01)
    assert np.abs(angles[:, 2]).max() <= 60 + 1e-6
    assert turns[:, 1, 2].min() >= math.cos(math.radians(60)) ** 2 - 1e-9  # its belly is below
    between = np.einsum("nij,nij->n", turns[1:], turns[:-1])
    steps = np.degrees(np.arccos(np.clip((between - 1) / 2, -1, 1)))
    # 180 degrees a second of yaw are 6 a frame, and the bank goes over meanwhile; an arrow turns by 180 at once.
    assert steps.max() < 14
    assert steps.max() > 4


@pytest.mark.parametrize("kind", ["manoeuvre", "singer", "jump", "stop_and_go", "weave"])
@pytest.mark.parametrize("posture", [BIRD, VEHICLE], ids=["bird", "vehicle"])
def test_each_frame_stands_alone(kind: str, posture: Posture) -> None:
    value = path(kind=kind, start=[160, 128], range_m=100)
    frames = np.arange(0, 90, 0.5)
    turns = attitudes(value, frames, level(-0.1), "it", posture=posture)
    np.testing.assert_allclose(turns @ np.swapaxes(turns, 1, 2), [np.eye(3)] * len(turns), atol=1e-12)
    for one in (0, 57, 140):
        alone = attitudes(value, frames[one : one + 1], level(-0.1), "it", posture=posture)
        np.testing.assert_array_equal(alone[0], turns[one])
