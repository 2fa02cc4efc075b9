"""How a body lies along its path."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion import PATHS, Path, angles_deg, attitudes
from irsim.motion.attitude import AEROPLANE, POSTURES, STANDARD_GRAVITY, PostureName, euler


def context(seed: int = 0) -> SceneContext:
    return SceneContext(seed, Geometry((160, 120), 5e-4, 0.1), 30.0, "mwir", 0.6)


def path(**keys: Any) -> Path:
    value = PATHS.parse(keys)
    assert isinstance(value, Path)
    return value


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(-200, 200)] * 3),
    st.tuples(*[st.floats(-180, 180)] * 3),
    st.sampled_from(sorted(POSTURES)),
)
def test_it_is_a_rotation(
    velocity: tuple[float, float, float], offset: tuple[float, float, float], posture: PostureName
) -> None:
    value = path(kind="straight_m", start_m=[0, 0, 1000], velocity_m_s=list(velocity))
    turns = attitudes(value, np.array([0.0, 3.3]), context(), "jet", offset, (5.0, 0.0, -3.0), POSTURES[posture])
    np.testing.assert_allclose(turns @ np.swapaxes(turns, 1, 2), np.broadcast_to(np.eye(3), (2, 3, 3)), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0)


@given(st.floats(-179, 179), st.floats(-89, 89), st.floats(-179, 179))
def test_angles_come_back(yaw: float, pitch: float, roll: float) -> None:
    away = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
    np.testing.assert_allclose(angles_deg(away @ euler(np.array([yaw, pitch, roll]))), [yaw, pitch, roll], atol=1e-6)


@pytest.mark.parametrize(
    ("velocity", "yaw", "pitch"),
    [((0, 0, 50), 0, 0), ((50, 0, 0), 90, 0), ((0, 0, -50), 180, 0), ((-50, 0, 0), -90, 0), ((0, -50, 50), 0, 45)],
    ids=["away", "right", "towards", "left", "climbing away"],
)
def test_the_nose_follows_the_velocity(velocity: tuple[float, ...], yaw: float, pitch: float) -> None:
    level = SceneContext(0, Geometry((160, 120), 5e-4), 30.0, "mwir", 0.6)
    value = path(kind="straight_m", start_m=[0, 0, 1000], velocity_m_s=list(velocity))
    angles = angles_deg(attitudes(value, np.array([5.0]), level, "jet"))[0]
    np.testing.assert_allclose(np.abs(angles[0]) if yaw == 180 else angles[0], yaw, atol=1e-6)
    np.testing.assert_allclose(angles[1:], [pitch, 0], atol=1e-6)


def test_a_standing_body_looks_right() -> None:
    value = path(kind="straight_m", start_m=[0, 0, 1000])
    turn = attitudes(value, np.array([0.0]), SceneContext(0, Geometry((9, 9), 1e-3), 30.0, "mwir", 0.6), "tank")[0]
    np.testing.assert_allclose(turn @ [1, 0, 0], [1, 0, 0], atol=1e-12)  # nose right
    np.testing.assert_allclose(turn @ [0, 0, 1], [0, 1, 0], atol=1e-12)  # belly down


def test_wings_are_level_with_the_world_not_with_the_camera() -> None:
    # Camera up by 0.1 rad: what flies to the right shows its belly, its down axis leans towards us.
    turn = attitudes(path(kind="straight", start=[80, 60], speed=1.0), np.array([0.0]), context(), "jet")[0]
    np.testing.assert_allclose(turn @ [0, 0, 1], [0, np.cos(0.1), -np.sin(0.1)], atol=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_bank_is_that_of_a_coordinated_turn(side: float) -> None:
    # A level circle, 100 m/s at radius 1500 m: tan(bank) = v^2 / (r g) = 0.6798, 34.21 degrees into the turn.
    angle = np.linspace(0, 1, 60)
    points = np.stack([side * 1500 * (1 - np.cos(angle)), 0 * angle, 1000 + 1500 * np.sin(angle)], axis=1)
    value = path(kind="waypoints_m", points=points.tolist(), speed_m_s=100.0)
    level = SceneContext(0, Geometry((160, 120), 5e-4), 30.0, "mwir", 0.6)
    angles = angles_deg(attitudes(value, np.array([200.0]), level, "jet", posture=AEROPLANE))[0]
    expected = side * np.degrees(np.arctan(100**2 / (1500 * STANDARD_GRAVITY)))
    assert angles[2] == pytest.approx(expected, rel=2e-3)
    assert angles[0] == pytest.approx(side * np.degrees(200 / 30 * 100 / 1500), rel=1e-3)


def test_spin_turns_at_its_rate() -> None:
    value = path(kind="straight_m", start_m=[0, 0, 1000])
    level = SceneContext(0, Geometry((160, 120), 5e-4), 30.0, "mwir", 0.6)
    turns = attitudes(value, np.array([0.0, 30.0]), level, "jet", spin_deg_s=(0.0, 0.0, 40.0))
    np.testing.assert_allclose(angles_deg(turns)[:, 2], [0, 40], atol=1e-9)


def test_a_manoeuvring_jet_rolls_smoothly() -> None:
    value = path(kind="manoeuvre", start=[80, 60], speed=1.5)
    turns = attitudes(value, np.arange(0, 200, 0.1), context(2), "jet", posture=AEROPLANE)
    between = np.einsum("nij,nij->n", turns[1:], turns[:-1])
    steps = np.degrees(np.arccos(np.clip((between - 1) / 2, -1, 1)))
    assert steps.max() < 10  # degrees in a tenth of a frame, never a flip
