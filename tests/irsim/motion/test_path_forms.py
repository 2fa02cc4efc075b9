"""Paths against their closed forms."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_stage import GEOMETRY, RATE, level_axes, path, world
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from irsim.geometry.context import SceneContext
from irsim.motion import Path, SceneMotion
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.curves import Spline, arcs
from irsim.motion.stochastic import StopAndGoProfile, singer
from irsim.motion.turn_rate_chain import TurnRateChain, coordinated_turn
from irsim.types import Floats


def context(seed: int = 0, **others: Path) -> SceneContext:
    return SceneContext(seed, GEOMETRY, RATE, "mwir", 0.6, SceneMotion(others, ()))


def positions(value: Path, frames: npt.ArrayLike, scene: SceneContext | None = None) -> Floats:
    return value.positions(np.asarray(frames, dtype=float), scene or context(), "jet")


def pixels(value: Path, frames: npt.ArrayLike, scene: SceneContext | None = None) -> Floats:
    return GEOMETRY.project(positions(value, frames, scene))


def acceleration(value: Path, frames: npt.ArrayLike, scene: SceneContext | None = None) -> Floats:
    """Return (n, 3) m/s2 along east, north, up."""
    before, here, after = (world(value, np.asarray(frames, float) + d, scene or context()) for d in (-0.02, 0.0, 0.02))
    return (before - 2 * here + after) * (RATE / 0.02) ** 2


RADIUS_PX = 2 / np.radians(3)
"""Radius of a turn by 3 degrees a frame at 2 px a frame."""


@pytest.mark.parametrize(
    ("keys", "frames", "expected"),
    [
        ({"kind": "straight", "start": [10, 20], "speed": 2, "heading_deg": 30}, [10], [[10 + 10 * np.sqrt(3), 30]]),
        ({"kind": "straight", "start": [5, 5], "speed": 1, "heading_deg": 90}, [3], [[5, 8]]),
        (
            {"kind": "weave", "start": [10, 60], "speed": 1.0, "amplitude_px": 8.0, "period_frames": 40.0},
            [0, 10, 20],
            [[10, 60], [20, 68], [30, 60]],
        ),
        ({"kind": "weave", "start": [10, 60], "phase_deg": 70.0}, [0], [[10, 60]]),
        ({"kind": "waypoints", "points": [[10, 20], [60, 80], [140, 30]], "frames": [0, 30, 45]}, [30], [[60, 80]]),
        ({"kind": "waypoints", "points": [[10, 20], [40, 60]], "speed": 5.0}, [0, 20], [[10, 20], [70, 100]]),
        (
            {"kind": "turns", "start": [10, 20], "speed": 2.0, "turns": [[10, 40, 3.0]]},
            [10, 40, 50],
            [[30, 20], [30 + RADIUS_PX, 20 + RADIUS_PX], [30 + RADIUS_PX, 40 + RADIUS_PX]],
        ),
        (
            {"kind": "dive_px", "start": [10, 20], "at_frame": 10, "angle_deg": 90},
            [40],
            [[30 + RADIUS_PX, 20 + RADIUS_PX]],
        ),
        ({"kind": "singer", "start": [5, 6], "speed": 2.0, "heading_deg": 90, "sigma": 0}, [10.5], [[5, 27]]),
        (
            {"kind": "manoeuvre", "start": [40, 60], "turn_deg": 0, "keep_in_px": [-9e3, -9e3, 9e3, 9e3]},
            [10],
            [[60, 60]],
        ),
        # The first movement begins at full speed: 30 frames at 2 px and 10 of braking make 70 px; later ones 60 px.
        (
            {"kind": "stop_and_go", "start": [10, 20], "go_frames": 40, "stop_frames": 20, "ease_frames": 10},
            [40, 60, 100, 120],
            [[80, 20], [80, 20], [140, 20], [140, 20]],
        ),
    ],
)
def test_paths_in_pixels(keys: dict[str, object], frames: list[float], expected: list[list[float]]) -> None:
    np.testing.assert_allclose(pixels(path(**keys), frames), expected, atol=1e-5)


NORTH = {"axes": "world", "heading_deg": 0}
CIRCLE_M = 90 / np.radians(10)


@pytest.mark.parametrize(
    ("keys", "frames", "expected"),
    [
        (
            {"kind": "straight_m", "axes": "world", "start_m": [10, 500, 30], "velocity_m_s": [3, 60, -6]},
            [30],
            [[13, 560, 24]],
        ),
        # Level flight turns right of its heading: a quarter circle to the east in 9 s, with a climb of 2 m/s.
        (
            {
                **NORTH,
                "kind": "turns_m",
                "start_m": [0, 0, 0],
                "speed_m_s": 90,
                "climb_m_s": 2,
                "turns": [[0, 270, 10]],
            },
            [270],
            [[CIRCLE_M, CIRCLE_M, 18]],
        ),
        (
            {**NORTH, "kind": "weave_m", "start_m": [1, 500, 30], "speed_m_s": 60, "amplitude_m": 12, "period_s": 2},
            [0, 15, 30, 45],
            [[1, 500, 30], [13, 530, 30], [1, 560, 30], [-11, 590, 30]],
        ),
        # Along the line 40 north and 30 up a second; perpendicular to it, upwards, -3 north and 4 up in 5.
        (
            {
                **NORTH,
                "kind": "weave_m",
                "start_m": [0, 500, 0],
                "speed_m_s": 40,
                "climb_m_s": 30,
                "amplitude_m": 10,
                "period_s": 2,
                "tilt_deg": 90,
            },
            [15],
            [[0, 500 + 20 - 6, 15 + 8]],
        ),
        (
            {
                "kind": "stop_and_go_m",
                "axes": "world",
                "start_m": [0, 400, 5],
                "speed_m_s": 12,
                "climb_m_s": 3,
                "go_s": 4,
                "stop_s": 2,
                "ease_s": 1,
            },
            [90, 120, 180, 300],
            [[36, 400, 14], [42, 400, 15.5], [42, 400, 15.5], [78, 400, 24.5]],
        ),
        (
            {"kind": "manoeuvre_m", "axes": "world", "start_m": [1, 2, 3], "speed_m_s": 30, "turn_g": 0},
            [60],
            [[61, 2, 3]],
        ),
    ],
)
def test_paths_in_metres(keys: dict[str, object], frames: list[float], expected: list[list[float]]) -> None:
    np.testing.assert_allclose(world(path(**keys), frames, context()), expected, atol=1e-5)


def test_range_shortens_by_closing_speed() -> None:
    value = path(kind="straight", start=[10, 20], range_m=1000.0, closing_m_s=60.0)
    np.testing.assert_allclose(np.linalg.norm(positions(value, [0.0, 50.0]), axis=1), [1000.0, 900.0])


def test_constant_speed_along_waypoints() -> None:
    value = path(kind="waypoints", points=[[10, 20], [60, 80], [140, 30]], speed=1.5)
    speeds = np.linalg.norm(np.diff(pixels(value, np.arange(0, 250, 0.02)), axis=0), axis=1) / 0.02
    np.testing.assert_allclose(speeds, 1.5, rtol=1e-5)  # a chord of 0.03 px; beyond the last point too


def test_spline_equals_scipy() -> None:
    knots, points = np.array([0.0, 1.0, 2.5, 3.0, 7.0]), np.random.default_rng(0).normal(size=(5, 2))
    expected, at = CubicSpline(knots, points, bc_type="natural"), np.linspace(0, 7, 50)
    np.testing.assert_allclose(Spline(knots, points).at(at), expected(at), atol=1e-12)
    np.testing.assert_allclose(Spline(knots, points).slope(at), expected(at, 1), atol=1e-12)
    angles = np.linspace(0, np.pi, 60)
    circle = Spline(angles, np.stack([np.cos(angles), np.sin(angles)], axis=1))
    np.testing.assert_allclose(circle.at_distance(np.array([np.pi / 2])), [[0, 1]], atol=1e-3)


def test_full_turn_is_a_circle() -> None:
    found = arcs(np.array([45.0, 90.0]), [(0, 90, np.radians(4))], 2.0)
    np.testing.assert_allclose(found, [[0, 4 / np.radians(4)], [0, 0]], atol=1e-9)


@pytest.mark.parametrize(("heading", "slope"), [(0.0, 40.0), (180.0, 140.0)])
def test_dive_in_the_picture(heading: float, slope: float) -> None:
    keys = {"speed": 1.5, "heading_deg": heading, "at_frame": 10, "angle_deg": 40, "turn_deg": 4, "pull_out_frame": 60}
    value = path(kind="dive_px", start=[80, 20], **keys)
    steps = np.diff(pixels(value, [5.0, 6.0, 40.0, 41.0, 80.0, 81.0]), axis=0)[::2]
    directions = np.radians([heading, slope, heading])
    np.testing.assert_allclose(steps, 1.5 * np.stack([np.cos(directions), np.sin(directions)], axis=-1), atol=1e-9)


def test_dive_in_space() -> None:
    keys = {"speed_m_s": 150.0, "at_frame": 15.0, "angle_deg": 40.0, "pull_out_frame": 300.0}
    value = path(kind="dive", **NORTH, start_m=[0, 0, 0], **keys)
    steep, after = (np.diff(world(value, [k, k + 1], context()), axis=0)[0] * RATE for k in (200, 600))
    np.testing.assert_allclose(steep, [0, 150 * np.cos(np.radians(40)), -150 * np.sin(np.radians(40))], atol=1e-9)
    np.testing.assert_allclose(after, [0, 150, 0], atol=1e-9)
    assert np.linalg.norm(acceleration(value, [30.1])) == pytest.approx(3 * STANDARD_GRAVITY, rel=1e-3)


@pytest.mark.parametrize(
    ("keys", "frame", "load_g"),
    [
        ({"kind": "weave_m", "start_m": [0, 0, 2000]}, 37.5, 20 * (2 * np.pi / 5) ** 2 / STANDARD_GRAVITY),
        ({"kind": "stop_and_go_m", "start_m": [0, 0, 100]}, 120.0, 5 / STANDARD_GRAVITY),  # braking from 10 m/s in 2 s
    ],
)
def test_acceleration_of_paths(keys: dict[str, object], frame: float, load_g: float) -> None:
    assert np.linalg.norm(acceleration(path(**keys), [frame])) / STANDARD_GRAVITY == pytest.approx(load_g, rel=1e-3)


@pytest.mark.parametrize("speed", [0.5, 2.0, 5.0])
def test_manoeuvre_in_pixels(speed: float) -> None:
    """It stays in its box, at constant speed."""
    left, top, right, bottom = box = (20.0, 15.0, 140.0, 105.0)
    value = path(kind="manoeuvre", start=[80, 60], speed=speed, keep_in_px=list(box))
    for seed in range(8):
        x, y = pixels(value, np.arange(400), context(seed)).T
        assert left <= x.min() < x.max() <= right
        assert top <= y.min() < y.max() <= bottom
    steps = np.linalg.norm(np.diff(pixels(value, np.arange(0, 50, 0.01)), axis=0), axis=1)
    np.testing.assert_allclose(steps, speed / 100, rtol=1e-6)


def test_largest_turn_rate_of_a_manoeuvre() -> None:
    value = path(kind="manoeuvre", start=[80, 60], speed=1.0, turn_deg=4.0, keep_in_px=[-9000, -9000, 9000, 9000])
    steps = np.diff(pixels(value, np.arange(500)), axis=0)
    turns = np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))))
    assert 3.0 < np.degrees(turns.max()) < 4.0


@pytest.mark.parametrize("speed_m_s", [10, 60])
def test_manoeuvre_in_metres(speed_m_s: float) -> None:
    """It begins at its start and stays in its box, with more than turn_g only near the edge."""
    box = (-150.0, 400.0, 150.0, 800.0)
    value = path(kind="manoeuvre_m", start_m=[20, 10, 600], speed_m_s=speed_m_s, turn_g=0.5, keep_in_m=list(box))
    np.testing.assert_allclose(positions(value, [0.0]), [[20, 10, 600]], atol=1e-9)
    for seed in range(4):
        east, north, _ = world(value, np.arange(900), context(seed)).T
        assert box[0] <= east.min() < east.max() <= box[2]
        assert box[1] <= north.min() < north.max() <= box[3]
        load = np.linalg.norm(acceleration(value, np.arange(900) + 0.5, context(seed)), axis=1) / STANDARD_GRAVITY
        assert load.max() < max(1.5 * speed_m_s**2 / 300, 0.5)


def test_singer_transition_and_noise() -> None:
    """Q against Van Loan's integral (IEEE Trans. Automatic Control 23, 1978), and its limit, white jerk."""
    step, sigma, tau = 0.7, 1.3, 2.0
    drift, density = np.array([[0, 1, 0], [0, 0, 1], [0, 0, -1 / tau]]), np.zeros((3, 3))
    density[2, 2] = 2 * sigma**2 / tau
    block = expm(np.block([[-drift, density], [np.zeros((3, 3)), drift.T]]) * step)
    transition, noise = singer(step, sigma, tau)
    np.testing.assert_allclose(transition, block[3:, 3:].T, atol=1e-13)
    np.testing.assert_allclose(noise, block[3:, 3:].T @ block[:3, 3:], atol=1e-13)
    transition, noise = singer(1.0, 1.0, 1e6)
    np.testing.assert_allclose(transition, np.array([[1, 1, 0.5], [0, 1, 1], [0, 0, 1]]), rtol=2e-6)
    expected = np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1]])
    np.testing.assert_allclose(noise / 2e-6, expected, rtol=1e-5)


def test_singer_acceleration_is_stationary() -> None:
    """Second differences over 0.01 frames give the acceleration: sigma 0.05, exp(-1) at one correlation time."""
    value = path(kind="singer", start=[0, 0], speed=0.0, sigma=0.05, correlation_frames=8.0)

    def found(frames: Floats, seed: int) -> Floats:
        x = value.pixels(frames.ravel(), context(seed), "jet").reshape(-1, 3, 2)  # type: ignore[attr-defined]  # a PixelPath
        return np.asarray((x[:, 0] - 2 * x[:, 1] + x[:, 2]) / 1e-4)

    around = np.array([-0.01, 0.0, 0.01])
    a = np.concatenate([found(np.add.outer(np.arange(0, 2000, 8), around) + 0.5, seed) for seed in range(8)], axis=1)
    # 4,000 values, correlated over about two each.
    assert a.std() == pytest.approx(0.05, rel=0.07)
    assert np.mean(a[1:] * a[:-1]) / a.var() == pytest.approx(np.exp(-1), abs=0.07)
    first = np.concatenate([found(around + 0.01, seed) for seed in range(300)])
    assert first.std() == pytest.approx(0.05, rel=0.12)


def test_dynamics_of_singer() -> None:
    dynamics = path(kind="singer", start=[5, 6], sigma=0.2, correlation_frames=5.0).dynamics(context())
    assert dynamics is not None
    assert dynamics.state == ("x", "vx", "ax", "y", "vy", "ay")
    np.testing.assert_array_equal(dynamics.transitions[0, 3:, 3:], singer(1.0, 0.2, 5.0)[0])
    np.testing.assert_array_equal(dynamics.noises[0, :3, 3:], 0)


def test_dynamics_of_jump() -> None:
    """Each frame follows one of the modes, in pixels and in metres."""
    value = path(kind="jump", start=[80, 60], speed=2.0, rates_deg=[0.0, 5.0, -5.0], hold_frames=10.0)
    metres = path(kind="jump_m", start_m=[0, 20, 2000], speed_m_s=150, hold_s=0.5, climb_m_s=4, heading_deg=200)
    for each, rate, at, columns in (
        (value, 1.0, pixels, [0, 1]),
        (metres, RATE, lambda v, k: world(v, k, context()), [1, 0, 2]),
    ):
        dynamics = each.dynamics(context())
        assert dynamics is not None
        here, ahead = (at(each, np.arange(300) + d) for d in (0.0, 1e-4))
        states = np.stack([here, (ahead - here) / 1e-4 * rate], axis=-1)[:, columns].reshape(300, -1)
        after = np.einsum("mij,nj->mni", dynamics.transitions, states[:-1])
        errors = np.abs(after - states[1:])[:, :, ::2].max(axis=2)
        assert errors.min(axis=0).max() < 1e-2
        assert len(set(np.argmin(errors, axis=0))) == 3
    jump = value.dynamics(context())
    assert jump is not None
    np.testing.assert_allclose(jump.switching, [[0.9, 0.05, 0.05], [0.05, 0.9, 0.05], [0.05, 0.05, 0.9]])


def test_turn_rate_chain() -> None:
    """Changes are Bernoulli with 1/10: 2,000 +- 3 sqrt(20,000 x 0.09) = 127. A quarter circle has the radius 2 / pi."""
    rates = TurnRateChain(np.radians([0.0, 5.0, -5.0]), 10.0).drawn(20_000, context(4), "jet")
    assert np.count_nonzero(np.diff(rates)) == pytest.approx(2000, abs=127)
    quarter = coordinated_turn(np.radians(90)) @ [0, 1, 0, 0]
    np.testing.assert_allclose(quarter, [2 / np.pi, 0, 2 / np.pi, 1], atol=1e-12)


def test_durations_of_stop_and_go_vary() -> None:
    times, _ = StopAndGoProfile(speed=1.0, go=40.0, stop=20.0, ease=6.0, vary=0.5).speed_nodes(2e4, context(1), "jet")
    goes = times.reshape(-1, 4)[:, 3] - times.reshape(-1, 4)[:, 0]
    assert 20 <= goes.min() < 22
    assert 58 < goes.max() <= 60.001


LEADER = path(kind="straight", start=[20, 40], speed=2.0, heading_deg=10.0, range_m=800.0)


def test_follow() -> None:
    scene = context(leader=LEADER)
    behind = path(kind="follow", target="leader", lag_frames=6.0)
    np.testing.assert_array_equal(positions(behind, [20, 30], scene), positions(LEADER, [14, 24], scene))
    beside = path(kind="follow", target="leader", offset_px=[5.0, -3.0], farther_m=50.0)
    expected = pixels(LEADER, [20], scene) + np.array([5, -3])
    np.testing.assert_allclose(pixels(beside, [20], scene), expected, atol=1e-9)
    assert np.linalg.norm(positions(beside, [20], scene)) == pytest.approx(850)


@pytest.mark.parametrize(("angle", "miss"), [(-120.0, 6.0), (40.0, 0.0), (90.0, -6.0)])
def test_crossing_in_the_picture(angle: float, miss: float) -> None:
    scene = context(leader=LEADER)
    value = path(kind="crosses", target="leader", at_frame=30.0, angle_deg=angle, miss_px=miss, speed=1.5)
    frames = np.arange(0, 60, 0.5)
    gaps = np.linalg.norm(pixels(value, frames, scene) - pixels(LEADER, frames, scene), axis=1)
    assert frames[np.argmin(gaps)] == 30.0
    assert gaps.min() == pytest.approx(abs(miss), abs=1e-6)
    step, other = (np.diff(pixels(each, [30, 31], scene), axis=0)[0] for each in (value, LEADER))
    right = np.array([other[1] - step[1], step[0] - other[0]]) / np.hypot(*(step - other))
    assert (pixels(value, [30], scene) - pixels(LEADER, [30], scene))[0] @ right == pytest.approx(miss, abs=1e-6)
    assert np.hypot(*step) == pytest.approx(1.5)
    assert np.degrees(np.arctan2(step[1], step[0])) == pytest.approx(10 + angle)


def test_thrown_falls_with_drag() -> None:
    scene, (_, _, up) = context(leader=LEADER), level_axes()
    value = path(kind="thrown", target="leader", at_frame=30.0, velocity_m_s=[3.0, 0.0, 8.0], slow_s=0.5)
    assert value.begins == 30.0
    np.testing.assert_array_equal(positions(value, [12, 30], scene), positions(LEADER, [12, 30], scene))
    final = np.diff(positions(value, [900, 901], scene), axis=0)[0] * RATE
    np.testing.assert_allclose(final, -STANDARD_GRAVITY * 0.5 * up, atol=1e-6)
    # After one time constant the velocity has approached the final one to exp(-1).
    carried = (positions(LEADER, [30.5], scene) - positions(LEADER, [29.5], scene))[0] * RATE
    level = carried - carried @ up * up
    first = carried + 3 * np.cross(-up, level / np.linalg.norm(level)) + 8 * up
    expected = positions(LEADER, [30], scene)[0] + final * 0.5 + (first - final) * 0.5 * (1 - np.exp(-1))
    np.testing.assert_allclose(positions(value, [45], scene)[0], expected, atol=1e-6)


CLIMBER = path(kind="straight_m", axes="world", start_m=[-60, 900, 20], velocity_m_s=[40, 9, -6])


@settings(max_examples=40, deadline=None)
@given(
    angle=st.floats(-180, 180),
    tilt=st.floats(-180, 180),
    miss=st.floats(0, 50),
    side=st.floats(-180, 180),
    speed=st.floats(5, 300),
)
def test_crossing_in_space(angle: float, tilt: float, miss: float, side: float, speed: float) -> None:
    scene = context(leader=CLIMBER)
    keys = {"angle_deg": angle, "tilt_deg": tilt, "miss_m": miss, "miss_deg": side, "speed_m_s": speed}
    value = path(kind="crosses_m", target="leader", at_frame=30.5, **keys)
    frames = 30.5 + np.array([-1.0, 0.0, 1.0])
    ours, other = world(value, frames, scene), world(CLIMBER, frames, scene)
    own, step = (ours[2] - ours[0]) * RATE / 2, (other[2] - other[0]) * RATE / 2
    gap = ours[1] - other[1]
    assert np.linalg.norm(own) == pytest.approx(speed)
    np.testing.assert_allclose(own @ step, speed * np.linalg.norm(step) * np.cos(np.radians(angle)), atol=1e-6)
    np.testing.assert_allclose(gap @ (own - step), 0, atol=1e-6)  # perpendicular at the closest approach
    if np.linalg.norm(own - step) > 1e-3:
        assert np.linalg.norm(gap) == pytest.approx(miss, abs=1e-8)


COS, SIN = 60 * np.cos(np.radians(30)), 60 * np.sin(np.radians(30))


@pytest.mark.parametrize(
    ("leader", "keys", "velocity", "gap"),
    [
        ([50, 0, 0], {"angle_deg": 30, "speed_m_s": 60}, [COS, -SIN, 0], [0, 0, 0]),  # right of east is south
        ([50, 0, 0], {"angle_deg": 30, "speed_m_s": 60, "tilt_deg": 90}, [COS, 0, SIN], [0, 0, 0]),
        ([0, 50, 0], {"miss_m": 8, "miss_deg": 90, "speed_m_s": 50}, [50, 0, 0], [0, 0, 8]),
        # Relative to the other it moves south-east: right of that is south-west.
        ([0, 50, 0], {"miss_m": 8, "speed_m_s": 50}, [50, 0, 0], [-8 / np.sqrt(2), -8 / np.sqrt(2), 0]),
        ([0, 0, 0], {"angle_deg": -90, "speed_m_s": 6}, [0, 6, 0], [0, 0, 0]),  # at rest counts as moving right
    ],
)
def test_sides_of_a_crossing_in_space(
    leader: list[float], keys: dict[str, float], velocity: list[float], gap: list[float]
) -> None:
    other = path(kind="straight_m", axes="world", start_m=[0, 900, 20], velocity_m_s=leader)
    value, scene = path(kind="crosses_m", target="leader", at_frame=30, **keys), context(leader=other)
    np.testing.assert_allclose(np.diff(world(value, [30, 60], scene), axis=0)[0], velocity, atol=1e-9)
    np.testing.assert_allclose((world(value, [30], scene) - world(other, [30], scene))[0], gap, atol=1e-9)
