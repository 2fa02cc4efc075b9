"""Paths of given turns, random manoeuvres, and paths that refer to another target, against closed forms."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from motion_stage import GEOMETRY, level_axes, path
from pydantic import ValidationError

from irsim.geometry.context import SceneContext
from irsim.motion import PATHS, Path, SceneMotion
from irsim.motion.curves import arcs
from irsim.motion.random_turns import TurnRateChain, coordinated_turn
from irsim.motion.stochastic import StopAndGoProfile, singer
from irsim.types import Floats

RATE = 30.0


def context(seed: int = 0, **others: Path) -> SceneContext:
    return SceneContext(seed, GEOMETRY, RATE, "mwir", 0.6, SceneMotion(others, ()))


def places(value: Path, frames: npt.ArrayLike, scene: SceneContext | None = None, name: str = "jet") -> Floats:
    return value.positions(np.asarray(frames, dtype=float), scene or context(), name)


def pixels(value: Path, frames: npt.ArrayLike, scene: SceneContext | None = None) -> Floats:
    return GEOMETRY.project(places(value, frames, scene))


class TestTurns:
    def test_a_full_turn_comes_back(self) -> None:
        # 90 frames at 4 degrees: once round, radius 2 / radians(4) px.
        np.testing.assert_allclose(arcs(np.array([90.0]), [(0, 90, np.radians(4))], 2.0), [[0, 0]], atol=1e-12)
        half = arcs(np.array([45.0]), [(0, 90, np.radians(4))], 2.0)
        np.testing.assert_allclose(half, [[0, 2 * 2 / np.radians(4)]], atol=1e-9)

    def test_it_is_straight_between(self) -> None:
        value = path(kind="turns", start=[10, 20], speed=2.0, turns=[[10, 40, 3.0]])
        # Ten frames straight; a quarter turn of radius 2 / radians(3); then straight down.
        radius = 2 / np.radians(3)
        corner = np.array([10 + 20 + radius, 20 + radius])
        np.testing.assert_allclose(
            pixels(value, [10, 40, 50]), np.array([[30, 20], corner, corner + np.array([0, 20])]), atol=1e-9
        )

    def test_level_flight_turns_right_of_its_heading(self) -> None:
        east, north, up = level_axes()
        # North at 90 m/s, 10 deg/s for 9 s: a quarter turn to the east of radius 90 / radians(10).
        value = path(
            kind="turns_m", start_m=[0, 0, 0], axes="world", speed_m_s=90.0, heading_deg=0.0, climb_m_s=2.0,
            turns=[[0, 270, 10.0]],
        )  # fmt: skip
        radius = 90 / np.radians(10)
        np.testing.assert_allclose(places(value, [270]), [radius * east + radius * north + 18 * up], atol=1e-9)

    def test_turns_that_cannot_be_are_refused(self) -> None:
        with pytest.raises(ValidationError, match="overlap"):
            PATHS.find("turns").model_validate({"start": [0, 0], "turns": [[0, 20, 1.0], [10, 30, 1.0]]})
        with pytest.raises(ValidationError, match="from frame 9"):
            PATHS.find("turns").model_validate({"start": [0, 0], "turns": [[9, 9, 1.0]]})

    def test_world_axes_are_east_north_up(self) -> None:
        east, north, up = level_axes()
        value = path(kind="straight_m", axes="world", start_m=[10, 500, 30], velocity_m_s=[3, 60, -6])
        expected = 13 * east + 560 * north + 24 * up
        np.testing.assert_allclose(places(value, [30]), [expected], atol=1e-9)


class TestDive:
    def test_it_goes_down_at_its_angle_and_pulls_its_g(self) -> None:
        _, north, up = level_axes()
        value = path(kind="dive", start_m=[0, 0, 0], speed_m_s=150.0, heading_deg=0.0, at_frame=15.0, angle_deg=40.0)
        steep = np.diff(places(value, [200, 201]), axis=0)[0] * RATE
        expected = 150 * (np.cos(np.radians(40)) * north - np.sin(np.radians(40)) * up)
        np.testing.assert_allclose(steep, expected, atol=1e-9)
        # On the arc: v^2 / r = 3 g across the way.
        a, b, c = places(value, [30.0, 30.1, 30.2])
        assert np.linalg.norm(a - 2 * b + c) * (RATE / 0.1) ** 2 == pytest.approx(3 * 9.80665, rel=1e-4)

    def test_it_pulls_out_to_level(self) -> None:
        _, north, _ = level_axes()
        value = path(
            kind="dive", start_m=[0, 0, 0], speed_m_s=150.0, heading_deg=0.0, at_frame=15.0, pull_out_frame=120.0
        )
        after = np.diff(places(value, [300, 301]), axis=0)[0] * RATE
        np.testing.assert_allclose(after, 150 * north, atol=1e-9)

    def test_it_does_not_pull_out_before_it_dives(self) -> None:
        with pytest.raises(ValidationError, match="pull-out comes before the dive"):
            PATHS.find("dive").model_validate({"start_m": [0, 0, 0], "at_frame": 30, "pull_out_frame": 20})


class TestSinger:
    def test_transition_and_noise_are_those_of_the_paper(self) -> None:
        """Q against Van Loan's integral (IEEE Trans. Automatic Control 23, 1978) by scipy's expm."""
        from scipy.linalg import expm

        step, sigma, tau = 0.7, 1.3, 2.0
        drift = np.array([[0, 1, 0], [0, 0, 1], [0, 0, -1 / tau]])
        spread = np.zeros((3, 3))
        spread[2, 2] = 2 * sigma**2 / tau
        block = expm(np.block([[-drift, spread], [np.zeros((3, 3)), drift.T]]) * step)
        transition, noise = singer(step, sigma, tau)
        np.testing.assert_allclose(transition, block[3:, 3:].T, atol=1e-13)
        np.testing.assert_allclose(noise, block[3:, 3:].T @ block[:3, 3:], atol=1e-13)

    def test_long_correlation_is_constant_acceleration(self) -> None:
        transition, noise = singer(1.0, 1.0, 1e6)
        np.testing.assert_allclose(transition, np.array([[1, 1, 0.5], [0, 1, 1], [0, 0, 1]]), rtol=2e-6)
        # White jerk of density 2/tau: [[1/20, 1/8, 1/6], [1/8, 1/3, 1/2], [1/6, 1/2, 1]] of it.
        expected = np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1]])
        np.testing.assert_allclose(noise / 2e-6, expected, rtol=1e-5)

    def test_its_acceleration_has_the_asked_spread_and_memory(self) -> None:
        # A 0.01-frame second difference reads the acceleration: sigma 0.05, exp(-1) at one correlation time.
        value = path(kind="singer", start=[0, 0], speed=0.0, sigma=0.05, correlation_frames=8.0)
        frames = np.add.outer(np.arange(0, 4000, 8), [-0.01, 0.0, 0.01]) + 0.5
        found = []
        for seed in range(8):
            x = value.pixels(frames.ravel(), context(seed), "jet").reshape(-1, 3, 2)  # type: ignore[attr-defined]  # a PixelPath
            found.append((x[:, 0] - 2 * x[:, 1] + x[:, 2]) / 1e-4)
        a = np.concatenate(found, axis=1)
        # 8,000 values, correlated over about two each: 2.5 % is more than three standard errors.
        assert a.std() == pytest.approx(0.05, rel=0.05)
        assert np.mean(a[1:] * a[:-1]) / a.var() == pytest.approx(np.exp(-1), abs=0.05)

    @pytest.mark.parametrize("after", [0, 3])
    def test_its_acceleration_has_that_spread_from_the_first_frame_on(self, after: int) -> None:
        value = path(kind="singer", start=[0, 0], speed=0.0, sigma=0.05, correlation_frames=8.0)
        frames = after + np.array([0.0, 0.01, 0.02])
        x = np.array([value.pixels(frames, context(seed), "jet") for seed in range(600)])  # type: ignore[attr-defined]  # a PixelPath
        a = (x[:, 0] - 2 * x[:, 1] + x[:, 2]) / 1e-4
        # 1,200 independent values: their standard deviation is known to 2 %.
        assert a.std() == pytest.approx(0.05, rel=0.08)

    def test_no_sigma_is_the_steady_way(self) -> None:
        value = path(kind="singer", start=[5, 6], speed=2.0, heading_deg=90.0, sigma=0.0)
        np.testing.assert_allclose(pixels(value, [-1.0, 10.5]), [[5, 4], [5, 27]], atol=1e-9)

    def test_its_dynamics_are_two_axes_of_it(self) -> None:
        value = path(kind="singer", start=[5, 6], sigma=0.2, correlation_frames=5.0)
        dynamics = value.dynamics(context())
        assert dynamics is not None
        assert dynamics.state == ("x", "vx", "ax", "y", "vy", "ay")
        np.testing.assert_array_equal(dynamics.transitions[0, 3:, 3:], singer(1.0, 0.2, 5.0)[0])
        np.testing.assert_array_equal(dynamics.noises[0, :3, 3:], 0)


class TestJump:
    def test_each_frame_obeys_one_of_its_modes(self) -> None:
        value = path(kind="jump", start=[80, 60], speed=2.0, rates_deg=[0.0, 5.0, -5.0], hold_frames=10.0)
        dynamics = value.dynamics(context())
        assert dynamics is not None
        x, y = pixels(value, np.arange(300)).T
        ahead = pixels(value, np.arange(300) + 1e-4)
        vx, vy = (ahead.T - np.stack([x, y])) / 1e-4
        state = np.stack([x, vx, y, vy], axis=1)
        after = np.einsum("mij,nj->mni", dynamics.transitions, state[:-1])
        wrong = np.abs(after[:, :, [0, 2]] - state[1:, [0, 2]]).max(axis=2).min(axis=0)
        assert wrong.max() < 1e-3
        np.testing.assert_allclose(dynamics.switching, [[0.9, 0.05, 0.05], [0.05, 0.9, 0.05], [0.05, 0.05, 0.9]])

    def test_it_holds_a_rate_as_long_as_asked(self) -> None:
        rates = TurnRateChain(np.radians([0.0, 5.0, -5.0]), 10.0).drawn(20_000, context(4), "jet")
        # Changes are Bernoulli with 1/10: 2,000 +- 3 sqrt(20,000 x 0.09) = 127.
        assert np.count_nonzero(np.diff(rates)) == pytest.approx(2000, abs=127)

    def test_the_coordinated_turn_turns_a_velocity(self) -> None:
        x, vx, y, vy = coordinated_turn(np.radians(90)) @ [0, 1, 0, 0]
        # A quarter circle of length 1: radius 2/pi.
        np.testing.assert_allclose([x, vx, y, vy], [2 / np.pi, 0, 2 / np.pi, 1], atol=1e-12)


class TestStopAndGo:
    def test_it_stands_in_its_stops_and_makes_its_way(self) -> None:
        value = path(kind="stop_and_go", start=[10, 20], speed=2.0, go_frames=40.0, stop_frames=20.0, ease_frames=10.0)
        # The first go has no start-up: 30 frames at 2 px and 10 easing out make 70 px; later ones 60 px.
        np.testing.assert_allclose(pixels(value, [40, 50, 60, 100, 120])[:, 0], [80, 80, 80, 140, 140], atol=1e-5)

    def test_lengths_vary_as_asked(self) -> None:
        profile = StopAndGoProfile(speed=1.0, go=40.0, stop=20.0, ease=6.0, vary=0.5)
        times, _ = profile.speed_nodes(20_000.0, context(1), "jet")
        goes = times.reshape(-1, 4)[:, 3] - times.reshape(-1, 4)[:, 0]
        assert 20 <= goes.min() < 22
        assert 58 < goes.max() <= 60.001


LEADER = path(kind="straight", start=[20, 40], speed=2.0, heading_deg=10.0, range_m=800.0)


class TestOthers:
    def test_a_follower_is_where_the_other_was(self) -> None:
        scene = context(leader=LEADER)
        value = path(kind="follow", target="leader", lag_frames=6.0)
        np.testing.assert_array_equal(places(value, [20, 30], scene), places(LEADER, [14, 24], scene))
        beside = path(kind="follow", target="leader", offset_px=[5.0, -3.0], farther_m=50.0)
        np.testing.assert_allclose(
            pixels(beside, [20], scene), pixels(LEADER, [20], scene) + np.array([5, -3]), atol=1e-9
        )
        assert np.linalg.norm(places(beside, [20], scene)) == pytest.approx(850)

    @pytest.mark.parametrize("angle", [-120.0, 40.0, 90.0])
    @pytest.mark.parametrize("miss", [0.0, 6.0, -6.0])
    def test_a_crossing_meets_at_its_frame_and_angle(self, angle: float, miss: float) -> None:
        scene = context(leader=LEADER)
        value = path(kind="crosses", target="leader", at_frame=30.0, angle_deg=angle, miss_px=miss, speed=1.5)
        frames = np.arange(0, 60, 0.5)
        apart = np.linalg.norm(pixels(value, frames, scene) - pixels(LEADER, frames, scene), axis=1)
        assert frames[np.argmin(apart)] == 30.0
        assert apart.min() == pytest.approx(abs(miss), abs=1e-6)
        step = np.diff(pixels(value, [30, 31], scene), axis=0)[0]
        # Positive ones are to the right of who looks along its motion relative to the other, y being down.
        along = step - np.diff(pixels(LEADER, [30, 31], scene), axis=0)[0]
        right = np.array([-along[1], along[0]]) / np.hypot(*along)
        assert (pixels(value, [30], scene) - pixels(LEADER, [30], scene))[0] @ right == pytest.approx(miss, abs=1e-6)
        assert np.hypot(*step) == pytest.approx(1.5)
        assert np.degrees(np.arctan2(step[1], step[0])) == pytest.approx(10 + angle)

    def test_what_is_thrown_falls_at_its_last_speed(self) -> None:
        scene = context(leader=LEADER)
        value = path(kind="thrown", target="leader", at_frame=30.0, velocity_m_s=[3.0, 0.0, 8.0], slow_s=0.5)
        assert value.begins == 30.0
        np.testing.assert_array_equal(places(value, [12, 30], scene), places(LEADER, [12, 30], scene))
        last = np.diff(places(value, [900, 901], scene), axis=0)[0] * RATE
        np.testing.assert_allclose(last, 9.80665 * 0.5 * GEOMETRY.down, atol=1e-6)
        # Half a second on: what is left of the speed is exp(-1), and the way is the integral of that.
        carried = (places(LEADER, [30.5], scene) - places(LEADER, [29.5], scene))[0] * RATE
        level = carried - carried @ GEOMETRY.down * GEOMETRY.down
        right = np.cross(GEOMETRY.down, level / np.linalg.norm(level))
        first = carried + 3 * right - 8 * GEOMETRY.down
        fall = 9.80665 * 0.5 * GEOMETRY.down
        expected = places(LEADER, [30], scene)[0] + fall * 0.5 + (first - fall) * 0.5 * (1 - np.exp(-1))
        np.testing.assert_allclose(places(value, [45], scene)[0], expected, atol=1e-9)
