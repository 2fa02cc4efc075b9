"""Weaves, jumps, stops, manoeuvres and crossings in metres, and dives in pixels, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_stage import GEOMETRY, level_axes, path
from pydantic import ValidationError

from irsim.geometry.context import SceneContext
from irsim.motion import PATHS, Path, SceneMotion
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.types import Floats

RATE = 30.0


def context(seed: int = 0, **others: Path) -> SceneContext:
    return SceneContext(seed, GEOMETRY, RATE, "mwir", 0.6, SceneMotion(others, ()))


def world(value: Path, frames: npt.ArrayLike, scene: SceneContext | None = None) -> Floats:
    """(n, 3) m: east, north, up."""
    places = value.positions(np.asarray(frames, dtype=float), scene or context(), "jet")
    return np.asarray(places @ np.stack(level_axes(), axis=-1))


def bent(value: Path, frames: npt.ArrayLike, scene: SceneContext | None = None, step: float = 0.02) -> Floats:
    """(n, 3) m/s2 along east, north, up."""
    before, here, after = (world(value, np.asarray(frames, dtype=float) + d, scene) for d in (-step, 0.0, step))
    return (before - 2 * here + after) * (RATE / step) ** 2


class TestWeave:
    def test_it_swings_across_its_line(self) -> None:
        # North at 60 m/s, 12 m aside with a period of 2 s: a quarter of it is 15 frames.
        value = path(
            kind="weave_m", axes="world", start_m=[1, 500, 30], speed_m_s=60, heading_deg=0, amplitude_m=12, period_s=2
        )
        expected = [[1, 500, 30], [13, 530, 30], [1, 560, 30], [-11, 590, 30]]
        np.testing.assert_allclose(world(value, [0, 15, 30, 45]), expected, atol=1e-9)

    def test_it_swings_up_where_it_is_tilted_and_square_to_a_line_that_climbs(self) -> None:
        line = {"axes": "world", "start_m": [0, 500, 0], "speed_m_s": 40, "heading_deg": 0, "climb_m_s": 30}
        value = path(kind="weave_m", **line, amplitude_m=10, period_s=2, tilt_deg=90)
        # Along the line 40 north and 30 up a second; square to it, upwards, -3 north and 4 up in 5.
        np.testing.assert_allclose(world(value, [15]), [[0, 500 + 20 - 6, 15 + 8]], atol=1e-9)

    def test_it_pulls_as_it_says(self) -> None:
        value = path(kind="weave_m", start_m=[0, 0, 2000])
        pulled = np.linalg.norm(bent(value, [37.5, 112.5]), axis=1) / STANDARD_GRAVITY
        np.testing.assert_allclose(pulled, 20 * (2 * np.pi / 5) ** 2 / STANDARD_GRAVITY, rtol=1e-4)
        np.testing.assert_allclose(pulled, 3.2, atol=0.05)


class TestJump:
    VALUE = path(kind="jump_m", start_m=[0, 20, 2000], speed_m_s=150, hold_s=0.5, climb_m_s=4, heading_deg=200)

    def test_each_frame_obeys_one_of_its_modes(self) -> None:
        dynamics = self.VALUE.dynamics(context())
        assert dynamics is not None
        assert dynamics.state == ("north", "vnorth", "east", "veast", "up", "vup")
        places = world(self.VALUE, np.arange(300))
        speeds = (world(self.VALUE, np.arange(300) + 1e-4) - places) / 1e-4 * RATE
        states = np.stack([places, speeds], axis=-1)[:, [1, 0, 2]].reshape(300, 6)
        after = np.einsum("mij,nj->mni", dynamics.transitions, states[:-1])
        wrong = np.abs(after - states[1:])[:, :, ::2].max(axis=2)
        assert wrong.min(axis=0).max() < 1e-2
        assert len(set(np.argmin(wrong, axis=0))) == 3  # each of its modes was there
        np.testing.assert_allclose(dynamics.switching[0], [1 - 1 / 15, 1 / 30, 1 / 30])

    def test_what_holds_for_less_than_a_frame_holds_for_one(self) -> None:
        dynamics = path(kind="jump_m", start_m=[0, 0, 9], hold_s=1e-3).dynamics(context())
        assert dynamics is not None
        np.testing.assert_array_equal(dynamics.switching, [[0, 0.5, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 0]])

    def test_it_keeps_its_speed_and_pulls_speed_times_rate(self) -> None:
        inside = np.arange(300) + 0.5
        steps = np.diff(world(self.VALUE, np.concatenate([inside, inside + 0.01])).reshape(2, 300, 3), axis=0)[0]
        np.testing.assert_allclose(np.linalg.norm(steps[:, :2], axis=1) * RATE / 0.01, 150, rtol=1e-6)
        pulled = np.linalg.norm(bent(self.VALUE, inside), axis=1)
        turning = 150 * np.radians(8)
        assert np.all((pulled < 1e-3) | (np.abs(pulled - turning) < 1e-3))


class TestStopAndGo:
    def test_it_stands_in_its_stops_and_climbs_while_it_goes(self) -> None:
        value = path(
            kind="stop_and_go_m", axes="world", start_m=[0, 400, 5], speed_m_s=12, heading_deg=90, climb_m_s=3,
            go_s=4, stop_s=2, ease_s=1,
        )  # fmt: skip
        # 3 s at full speed and 1 s easing out are 3.5 s' worth; later goes 3 s' worth; six seconds a round.
        worth = np.array([3.0, 3.5, 3.5, 6.5, 6.5])
        expected = np.stack([12 * worth, np.full(5, 400.0), 5 + 3 * worth], axis=-1)
        np.testing.assert_allclose(world(value, [90, 120, 180, 300, 360]), expected, atol=1e-5)

    def test_braking_takes_the_g_that_are_told(self) -> None:
        value = path(kind="stop_and_go_m", start_m=[0, 0, 100])
        assert np.linalg.norm(bent(value, [120.0])) / STANDARD_GRAVITY == pytest.approx(0.51, abs=0.01)


class TestManoeuvre:
    def test_it_keeps_its_speed_and_its_g(self) -> None:
        value = path(kind="manoeuvre_m", start_m=[0, 0, 2000], speed_m_s=120, turn_g=4, hold_s=1, climb_m_s=-2)
        most = 0.0
        for seed in range(8):
            scene = context(seed)
            speeds = np.diff(world(value, np.arange(0, 300, 0.01), scene), axis=0) * RATE / 0.01
            np.testing.assert_allclose(np.linalg.norm(speeds[:, :2], axis=1), 120, rtol=1e-6)
            np.testing.assert_allclose(speeds[:, 2], -2, rtol=1e-4)
            most = max(most, np.linalg.norm(bent(value, np.arange(300) + 0.5, scene), axis=1).max())
        assert 3.5 < most / STANDARD_GRAVITY < 4

    @pytest.mark.parametrize("axes", ["camera", "world"])
    @pytest.mark.parametrize("speed_m_s", [10, 60])
    def test_it_stays_in_its_box_with_the_g_that_are_told(self, axes: str, speed_m_s: float) -> None:
        box = (-150.0, 400.0, 150.0, 800.0)
        start = [20, 10, 600] if axes == "camera" else [20, 600, 10]
        value = path(kind="manoeuvre_m", axes=axes, start_m=start, speed_m_s=speed_m_s, turn_g=0.5, keep_in_m=list(box))
        for seed in range(10):
            east, north, _ = world(value, np.arange(900), context(seed)).T
            assert box[0] <= east.min() < east.max() <= box[2]
            assert box[1] <= north.min() < north.max() <= box[3]
            pulled = np.linalg.norm(bent(value, np.arange(900) + 0.5, context(seed)), axis=1) / STANDARD_GRAVITY
            assert pulled.max() < max(1.5 * speed_m_s**2 / 300, 0.5)

    def test_it_begins_where_it_is_told(self) -> None:
        value = path(kind="manoeuvre_m", start_m=[20, -30, 600], keep_in_m=[-500, 100, 500, 2000])
        np.testing.assert_allclose(value.positions(np.zeros(1), context(), "jet"), [[20, -30, 600]], atol=1e-9)

    def test_without_turns_it_is_straight(self) -> None:
        value = path(kind="manoeuvre_m", axes="world", start_m=[1, 2, 3], speed_m_s=30, turn_g=0, heading_deg=90)
        np.testing.assert_allclose(world(value, [60]), [[61, 2, 3]], atol=1e-9)

    def test_an_empty_box_is_refused(self) -> None:
        with pytest.raises(ValidationError, match=r"box is empty; allowed: \[west, south, east, north\] that rise"):
            PATHS.find("manoeuvre_m").model_validate({"start_m": [0, 0, 9], "keep_in_m": [0, 5, 9, 5]})


class TestDive:
    @pytest.mark.parametrize(("heading", "slope"), [(0.0, 40.0), (180.0, 140.0), (-20.0, 20.0)])
    def test_it_goes_down_the_picture_whichever_way_it_flew(self, heading: float, slope: float) -> None:
        value = path(
            kind="dive_px", start=[80, 20], speed=1.5, heading_deg=heading, at_frame=10, angle_deg=40, turn_deg=4,
            pull_out_frame=60,
        )  # fmt: skip
        frames = np.array([5.0, 6.0, 40.0, 41.0, 80.0, 81.0])
        steps = np.diff(GEOMETRY.project(value.positions(frames, context(), "jet")), axis=0)[::2]
        told = np.radians([heading, slope, heading])
        np.testing.assert_allclose(steps, 1.5 * np.stack([np.cos(told), np.sin(told)], axis=-1), atol=1e-9)

    def test_its_arc_is_as_wide_as_speed_over_turn(self) -> None:
        # Ten frames right, then a quarter circle of 30 frames and radius 2 / radians(3) px.
        value = path(kind="dive_px", start=[10, 20], at_frame=10, angle_deg=90, range_m=700)
        radius = 2 / np.radians(3)
        place = value.positions(np.array([40.0]), context(), "jet")
        np.testing.assert_allclose(GEOMETRY.project(place), [[30 + radius, 20 + radius]], atol=1e-9)
        assert np.linalg.norm(place) == pytest.approx(700)

    def test_it_does_not_pull_out_before_it_dives(self) -> None:
        with pytest.raises(ValidationError, match="pull-out comes before the dive"):
            PATHS.find("dive_px").model_validate({"start": [0, 0], "at_frame": 30, "pull_out_frame": 30})


LEADER = path(kind="straight_m", axes="world", start_m=[-60, 900, 20], velocity_m_s=[40, 9, -6])


class TestCrossing:
    @given(
        angle=st.floats(-180, 180),
        tilt=st.floats(-180, 180),
        miss=st.floats(0, 50),
        side=st.floats(-180, 180),
        speed=st.floats(5, 300),
    )
    def test_they_pass_at_the_frame_distance_and_angle(
        self, angle: float, tilt: float, miss: float, side: float, speed: float
    ) -> None:
        scene = context(leader=LEADER)
        keys = {"angle_deg": angle, "tilt_deg": tilt, "miss_m": miss, "miss_deg": side, "speed_m_s": speed}
        value = path(kind="crosses_m", target="leader", at_frame=30.5, **keys)
        frames = 30.5 + np.array([-1.0, 0.0, 1.0])
        ours, other = world(value, frames, scene), world(LEADER, frames, scene)
        own, step = (ours[2] - ours[0]) * RATE / 2, (other[2] - other[0]) * RATE / 2
        apart = ours[1] - other[1]
        assert np.linalg.norm(own) == pytest.approx(speed)
        np.testing.assert_allclose(own @ step, speed * np.linalg.norm(step) * np.cos(np.radians(angle)), atol=1e-6)
        # The way between them is square to their relative motion: at no other moment are they nearer.
        np.testing.assert_allclose(apart @ (own - step), 0, atol=1e-6)
        if np.linalg.norm(own - step) > 1e-3:
            assert np.linalg.norm(apart) == pytest.approx(miss, abs=1e-8)

    def test_to_the_right_of_level_flight_is_right_and_tilted_it_is_up(self) -> None:
        east_going = path(kind="straight_m", axes="world", start_m=[0, 900, 20], velocity_m_s=[50, 0, 0])
        scene = context(leader=east_going)

        def speed(tilt: float) -> Floats:
            value = path(kind="crosses_m", target="leader", at_frame=30, angle_deg=30, tilt_deg=tilt, speed_m_s=60)
            return np.asarray(np.diff(world(value, [30, 60], scene), axis=0)[0])

        along, aside = 60 * np.cos(np.radians(30)), 60 * np.sin(np.radians(30))
        np.testing.assert_allclose(speed(0), [along, -aside, 0], atol=1e-9)  # right of east is south
        np.testing.assert_allclose(speed(90), [along, 0, aside], atol=1e-9)

    def test_it_misses_to_the_side_that_is_told(self) -> None:
        north_going = path(kind="straight_m", axes="world", start_m=[0, 900, 20], velocity_m_s=[0, 50, 0])
        scene = context(leader=north_going)

        def gap(side: float) -> Floats:
            keys: dict[str, Any] = {"miss_m": 8, "miss_deg": side, "speed_m_s": 50}
            value = path(kind="crosses_m", target="leader", at_frame=30, **keys)
            return np.asarray((world(value, [30], scene) - world(north_going, [30], scene))[0])

        # Eastwards past one that goes north, it moves south-east in the other's eyes: right of that is south-west.
        np.testing.assert_allclose(gap(0), [-8 / np.sqrt(2), -8 / np.sqrt(2), 0], atol=1e-9)
        np.testing.assert_allclose(gap(90), [0, 0, 8], atol=1e-9)

    def test_one_that_stands_counts_as_going_right(self) -> None:
        standing = path(kind="straight_m", axes="world", start_m=[0, 900, 20])
        value = path(kind="crosses_m", target="leader", at_frame=30, angle_deg=-90, speed_m_s=6)
        scene = context(leader=standing)
        np.testing.assert_allclose(world(value, [30, 60], scene), [[0, 900, 20], [0, 906, 20]], atol=1e-9)
