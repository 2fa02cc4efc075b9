"""Paths against their closed forms."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import pytest
from motion_stage import context, path, pixels
from pydantic import TypeAdapter, ValidationError

from irsim.motion import PATHS, Path
from irsim.motion.curves import Spline

EXAMPLES: dict[str, dict[str, Any]] = {
    "straight": {"start": [10, 20], "speed": 2.0, "heading_deg": 30.0, "closing_m_s": 50.0},
    "waypoints": {"points": [[10, 20], [60, 80], [140, 30]], "speed": 1.5},
    "weave_m": {"start_m": [-100, 0, 2000], "tilt_deg": 60.0, "climb_m_s": 10.0, "axes": "world", "period_s": 4.0},
    "manoeuvre_m": {"start_m": [-100, 0, 2000], "hold_s": 1.0, "keep_in_m": [-4000, -2000, 4000, 6000]},
    "jump_m": {"start_m": [-100, 0, 2000], "hold_s": 0.4, "climb_m_s": -5.0},
    "stop_and_go_m": {"start_m": [-20, 5, 400], "vary": 0.5, "go_s": 7.0, "climb_m_s": 2.0},
    "crosses_m": {"target": "leader", "at_frame": 40.0, "angle_deg": 40.0, "miss_m": 9.0, "tilt_deg": 30.0},
    "dive_px": {"start": [10, 20], "at_frame": 10.0, "pull_out_frame": 40.0},
    "weave": {"start": [10, 60], "speed": 1.0, "amplitude_px": 12.0},
    "manoeuvre": {"start": [80, 60], "speed": 2.0},
    "straight_m": {"start_m": [-20, 5, 800], "velocity_m_s": [30, -2, 10]},
    "turns": {"start": [10, 60], "turns": [[10, 30, 3.0], [40, 60, -2.0]]},
    "turns_m": {"start_m": [-100, 0, 2000], "turns": [[5, 50, 6.0]], "climb_m_s": 5.0},
    "dive": {"start_m": [-100, -50, 2000], "at_frame": 10.0, "pull_out_frame": 70.0},
    "singer": {"start": [20, 40]},
    "singer_m": {"start_m": [0, 0, 1500], "velocity_m_s": [40, 0, 0], "axes": "world"},
    "jump": {"start": [80, 60], "hold_frames": 10.0},
    "stop_and_go": {"start": [10, 60], "vary": 0.5, "go_frames": 200.0},
    "follow": {"target": "leader", "lag_frames": 5.0, "offset_px": [3.0, -4.0], "farther_m": 20.0},
    "crosses": {"target": "leader", "at_frame": 40.0, "angle_deg": 40.0},
    "thrown": {"target": "leader", "at_frame": 30.0, "velocity_m_s": [3.0, 5.0, -9.0]},
    "waypoints_m": {"points": [[-50, 0, 900], [0, 10, 1000], [60, -20, 950]], "frames": [0, 40, 90]},
}


def test_every_kind_of_path_is_tested() -> None:
    assert set(EXAMPLES) == set(PATHS.kinds)


@pytest.mark.parametrize("kind", EXAMPLES)
class TestEveryPath:
    def test_a_place_does_not_depend_on_the_frames_asked_for(self, kind: str) -> None:
        value, frames = path(kind=kind, **EXAMPLES[kind]), np.arange(120.0)
        together = value.positions(frames, context(3), "jet")
        for frame in (0, 7, 119):
            np.testing.assert_array_equal(
                value.positions(frames[frame : frame + 1], context(3), "jet")[0], together[frame]
            )

    def test_it_has_no_jumps(self, kind: str) -> None:
        frames = np.arange(0.0, 60.0, 0.01)
        steps = np.linalg.norm(
            np.diff(path(kind=kind, **EXAMPLES[kind]).positions(frames, context(), "jet"), axis=0), axis=1
        )
        # A thing that is thrown jumps to another speed at that frame, which is its first.
        assert steps[:2990].max() < 3 * np.median(steps[:2990])
        assert steps[3010:].max() < 3 * np.median(steps[3010:])

    def test_it_is_known_before_frame_0(self, kind: str) -> None:
        around = path(kind=kind, **EXAMPLES[kind]).positions(np.array([-0.01, 0.0, 0.01]), context(), "jet")
        np.testing.assert_allclose(around[1] - around[0], around[2] - around[1], atol=2e-3)


def test_straight_has_its_closed_form() -> None:
    value = path(kind="straight", start=[10, 20], speed=2.0, heading_deg=30.0)
    frames = np.array([0.0, 10.0, 2.5])
    expected = [[10 + 2 * f * np.sqrt(3) / 2, 20 + 2 * f / 2] for f in frames]
    np.testing.assert_allclose(pixels(value, frames), expected)


def test_heading_90_is_down() -> None:
    np.testing.assert_allclose(
        pixels(path(kind="straight", start=[5, 5], speed=1.0, heading_deg=90.0), [3.0]), [[5, 8]]
    )


def test_closing_shortens_the_range() -> None:
    value = path(kind="straight", start=[10, 20], range_m=1000.0, closing_m_s=60.0)
    # 60 m/s at 30 frames a second: 2 m a frame.
    ranges = np.linalg.norm(value.positions(np.array([0.0, 50.0]), context(), "jet"), axis=1)
    np.testing.assert_allclose(ranges, [1000.0, 900.0])


def test_straight_m_has_its_closed_form() -> None:
    value = path(kind="straight_m", start_m=[1, 2, 300], velocity_m_s=[30, 0, -60])
    np.testing.assert_allclose(value.positions(np.array([10.0]), context(), "jet"), [[11, 2, 280]])


def test_weave_swings_across_its_heading() -> None:
    value = path(kind="weave", start=[10, 60], speed=1.0, amplitude_px=8.0, period_frames=40.0)
    # A quarter period on, the swing is at its largest: 8 px to the right of the way, which is down.
    np.testing.assert_allclose(pixels(value, [0.0, 10.0, 20.0]), [[10, 60], [20, 68], [30, 60]], atol=1e-9)


def test_weave_starts_at_its_start_whatever_the_phase() -> None:
    value = path(kind="weave", start=[10, 60], phase_deg=70.0)
    np.testing.assert_allclose(pixels(value, [0.0]), [[10, 60]])


def test_waypoints_pass_their_points_at_their_frames() -> None:
    points = [[10, 20], [60, 80], [140, 30], [150, 100]]
    value = path(kind="waypoints", points=points, frames=[0, 30, 45, 90])
    np.testing.assert_allclose(pixels(value, [0, 30, 45, 90]), points)


def test_waypoints_at_a_speed_keep_it_along_the_curve() -> None:
    frames = np.arange(0, 250, 0.02)  # past the last point as well
    value = path(kind="waypoints", points=[[10, 20], [60, 80], [140, 30]], speed=1.5)
    speeds = np.linalg.norm(np.diff(pixels(value, frames), axis=0), axis=1) / 0.02
    np.testing.assert_allclose(speeds, 1.5, rtol=1e-5)  # a chord of 0.03 px is that near to its arc


def test_two_waypoints_are_a_straight_line() -> None:
    value = path(kind="waypoints", points=[[10, 20], [40, 60]], speed=5.0)
    np.testing.assert_allclose(pixels(value, [0.0, 5.0, 20.0]), [[10, 20], [25, 40], [70, 100]])


def test_the_spline_is_scipy_s() -> None:
    from scipy.interpolate import CubicSpline

    knots, points = np.array([0.0, 1.0, 2.5, 3.0, 7.0]), np.random.default_rng(0).normal(size=(5, 2))
    theirs, at = CubicSpline(knots, points, bc_type="natural"), np.linspace(0, 7, 50)
    np.testing.assert_allclose(Spline(knots, points).at(at), theirs(at), atol=1e-12)
    np.testing.assert_allclose(Spline(knots, points).slope(at), theirs(at, 1), atol=1e-12)


def test_a_distance_along_a_circle_is_its_angle() -> None:
    angles = np.linspace(0, np.pi, 60)
    circle = Spline(angles, np.stack([np.cos(angles), np.sin(angles)], axis=1))
    np.testing.assert_allclose(circle.at_distance(np.array([np.pi / 2])), [[0, 1]], atol=1e-3)


class TestManoeuvre:
    @pytest.mark.parametrize("speed", [0.5, 2.0, 5.0])
    def test_it_stays_in_its_box(self, speed: float) -> None:
        box = (20.0, 15.0, 140.0, 105.0)
        value = path(kind="manoeuvre", start=[80, 60], speed=speed, keep_in_px=list(box))
        for seed in range(20):
            x, y = pixels(value, np.arange(400), seed).T
            assert x.min() >= box[0]
            assert x.max() <= box[2]
            assert y.min() >= box[1]
            assert y.max() <= box[3]

    def test_it_keeps_its_speed(self) -> None:
        frames = np.arange(0, 100, 0.01)
        steps = np.linalg.norm(
            np.diff(pixels(path(kind="manoeuvre", start=[80, 60], speed=2.0), frames), axis=0), axis=1
        )
        np.testing.assert_allclose(steps, 0.02, rtol=1e-6)

    def test_it_turns_no_harder_than_told_far_from_the_edge(self) -> None:
        value = path(kind="manoeuvre", start=[80, 60], speed=1.0, turn_deg=4.0, keep_in_px=[-9000, -9000, 9000, 9000])
        steps = np.diff(pixels(value, np.arange(500)), axis=0)
        turns = np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))))
        assert 3.0 < np.degrees(turns.max()) < 4.0

    def test_without_turns_it_is_straight(self) -> None:
        value = path(kind="manoeuvre", start=[0, 0], speed=2.0, turn_deg=0.0, keep_in_px=[-9000, -9000, 9000, 9000])
        np.testing.assert_allclose(pixels(value, [10.0]), [[20, 0]], atol=1e-6)

    def test_seeds_and_names_differ(self) -> None:
        value, frames = path(kind="manoeuvre", start=[80, 60]), np.array([50.0])
        places = [value.positions(frames, context(s), n) for s, n in ((0, "jet"), (1, "jet"), (0, "other"))]
        assert len({place.tobytes() for place in places}) == 3


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"kind": "waypoints", "points": [[0, 0], [1, 1]]}, "neither 'frames' nor a speed is given"),
        ({"kind": "waypoints", "points": [[0, 0], [1, 1]], "speed": 1.0, "frames": [0, 1]}, "exclude each other"),
        ({"kind": "waypoints", "points": [[0, 0], [1, 1]], "frames": [0]}, "frames: 1, points: 2"),
        ({"kind": "waypoints", "points": [[0, 0], [1, 1]], "frames": [5, 5]}, "do not rise"),
        ({"kind": "waypoints", "points": [[0, 0], [0, 0]], "speed": 1.0}, "consecutive points are equal"),
        (
            {"kind": "waypoints_m", "points": [[0, 0, 9], [1, 1, 9]], "speed_m_s": 1.0, "frames": [0, 1]},
            "exclude each other",
        ),
        ({"kind": "manoeuvre", "start": [0, 0], "keep_in_px": [10, 0, 5, 9]}, "box is empty"),
    ],
)
def test_a_path_that_cannot_be_is_refused(keys: dict[str, Any], says: str) -> None:
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(Annotated[Path, PATHS]).validate_python(keys)
    assert says in str(caught.value.errors())
