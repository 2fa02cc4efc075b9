"""Paths against their closed forms, and camera motions."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
import pytest
from pydantic import TypeAdapter, ValidationError

from irsim.geometry import Geometry
from irsim.motion import PATHS, POINTINGS, Company, Mount, Path, Pointing
from irsim.motion.spline import Spline
from irsim.stage import Stage
from irsim.types import Floats

GEOMETRY = Geometry((160, 120), 5e-4, 0.1)
LEADER: dict[str, Any] = {"kind": "weave", "start": [20, 40], "speed": 1.0, "amplitude_px": 5.0, "heading_deg": 20.0}


def stage(seed: int = 0) -> Stage:
    """With one other target, `leader`, that the paths under test may refer to."""
    return Stage(seed, GEOMETRY, 30.0, "mwir", 0.6, Company({"leader": path(**LEADER)}, ()))


def path(**keys: Any) -> Path:
    value = PATHS.parse(keys)
    assert isinstance(value, Path)
    return value


def pixels(value: Path, frames: npt.ArrayLike, seed: int = 0) -> Floats:
    return GEOMETRY.project(value.positions(np.asarray(frames, dtype=float), stage(seed), "jet"))


EXAMPLES: dict[str, dict[str, Any]] = {
    "straight": {"start": [10, 20], "speed": 2.0, "heading_deg": 30.0, "closing_m_s": 50.0},
    "waypoints": {"points": [[10, 20], [60, 80], [140, 30]], "speed": 1.5},
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
        together = value.positions(frames, stage(3), "jet")
        for frame in (0, 7, 119):
            np.testing.assert_array_equal(
                value.positions(frames[frame : frame + 1], stage(3), "jet")[0], together[frame]
            )

    def test_it_has_no_jumps(self, kind: str) -> None:
        frames = np.arange(0.0, 60.0, 0.01)
        steps = np.linalg.norm(
            np.diff(path(kind=kind, **EXAMPLES[kind]).positions(frames, stage(), "jet"), axis=0), axis=1
        )
        # A thing that is thrown jumps to another speed at that frame, which is its first.
        assert steps[:2990].max() < 3 * np.median(steps[:2990])
        assert steps[3010:].max() < 3 * np.median(steps[3010:])

    def test_it_is_known_before_frame_0(self, kind: str) -> None:
        around = path(kind=kind, **EXAMPLES[kind]).positions(np.array([-0.01, 0.0, 0.01]), stage(), "jet")
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
    ranges = np.linalg.norm(value.positions(np.array([0.0, 50.0]), stage(), "jet"), axis=1)
    np.testing.assert_allclose(ranges, [1000.0, 900.0])


def test_straight_m_has_its_closed_form() -> None:
    value = path(kind="straight_m", start_m=[1, 2, 300], velocity_m_s=[30, 0, -60])
    np.testing.assert_allclose(value.positions(np.array([10.0]), stage(), "jet"), [[11, 2, 280]])


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
        places = [value.positions(frames, stage(s), n) for s, n in ((0, "jet"), (1, "jet"), (0, "other"))]
        assert len({place.tobytes() for place in places}) == 3


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"kind": "waypoints", "points": [[0, 0], [1, 1]]}, "neither 'frames' nor a speed is given"),
        ({"kind": "waypoints", "points": [[0, 0], [1, 1]], "speed": 1.0, "frames": [0, 1]}, "exclude each other"),
        ({"kind": "waypoints", "points": [[0, 0], [1, 1]], "frames": [0]}, "frames: 1, points: 2"),
        ({"kind": "waypoints", "points": [[0, 0], [1, 1]], "frames": [5, 5]}, "do not rise"),
        ({"kind": "waypoints", "points": [[0, 0], [0, 0]], "speed": 1.0}, "twice in a row"),
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


MOTIONS: dict[str, dict[str, Any]] = {
    "pan": {"azimuth_deg_s": 1.0, "elevation_deg_s": 2.0},
    "jitter": {},
    "shake": {},
    "vibration": {"lines": [[7.0, 0.5, 0.2], [41.0, 0.1, 0.1]]},
    "zoom": {"factors": [[10, 1.0], [40, 3.0]]},
    "platform": {"velocity_m_s": [10, 5, -1], "sway_m": [0, 0, 0.5]},
    "tracks": {"target": "leader", "lag_s": 0.1, "place_px": [100, 30]},
}


def motion(kind: str, **keys: Any) -> Pointing:
    value = POINTINGS.parse({"kind": kind, **MOTIONS[kind], **keys})
    assert isinstance(value, Pointing)
    return value


def test_every_camera_motion_is_tested() -> None:
    assert set(MOTIONS) == set(POINTINGS.kinds)


class TestPointings:
    def test_pan_moves_a_fixed_point_by_its_rate_over_the_ifov(self) -> None:
        pan = POINTINGS.parse({"kind": "pan", "azimuth_deg_s": 1.0})
        assert isinstance(pan, Pointing)
        level = Geometry((160, 120), 5e-4)
        turns = pan.turns(np.array([0.0, 1.0]), stage())
        ahead = [level.project(level.rotation(turn) @ [0.0, 0.0, 500.0]) for turn in turns]
        # 1 deg/s at 30 frames a second and 0.5 mrad a pixel: 0.0174533 / 30 / 0.0005 = 1.16355 px to the left.
        np.testing.assert_allclose(ahead[1] - ahead[0], [-1.16355, 0.0], atol=1e-5)

    def test_jitter_has_its_rms_and_correlation(self) -> None:
        frames = np.arange(0.0, 40_000.0)
        rms, lag = [], []
        for seed in range(10):
            shaking = POINTINGS.parse({"kind": "jitter", "rms_px": 2.0, "correlation_s": 0.1})
            assert isinstance(shaking, Pointing)
            turns = shaking.turns(frames, stage(seed))[:, :2] / GEOMETRY.ifov_rad
            rms.append(turns.std(axis=0))
            lag.append([np.corrcoef(one[:-3], one[3:])[0, 1] for one in turns.T])
        np.testing.assert_allclose(rms, 2.0, rtol=0.05)
        # Three frames are 0.1 s, one correlation time: exp(-1/2) = 0.6065; each draw of 32 waves scatters about it.
        assert np.mean(lag) == pytest.approx(0.6065, abs=3 * np.std(lag) / np.sqrt(20))

    @pytest.mark.parametrize("kind", MOTIONS)
    def test_a_frame_alone_is_the_frame_in_sequence(self, kind: str) -> None:
        frames, alone = np.arange(50.0), np.array([33.0])
        for method in ("turns", "shifts", "zooms"):
            ask = getattr(motion(kind), method)
            np.testing.assert_array_equal(ask(alone, stage(5))[0], ask(frames, stage(5))[33])

    def test_jitters_of_two_names_differ(self) -> None:
        one, other = (POINTINGS.parse({"kind": "jitter", "id": name}) for name in ("wind", "motor"))
        assert isinstance(one, Pointing)
        assert isinstance(other, Pointing)
        assert not np.array_equal(one.turns(np.arange(3.0), stage()), other.turns(np.arange(3.0), stage()))

    def test_vibration_is_its_lines(self) -> None:
        turns = motion("vibration", lines=[[5.0, 0.8, 0.0], [9.0, 0.3, 0.4]]).turns(np.arange(300.0), stage(2))
        spectrum = np.abs(np.fft.rfft(turns[:, :2] / GEOMETRY.ifov_rad, axis=0)) / 150
        # 300 frames at 30 Hz: 0.1 Hz a line, so 5 and 9 Hz are lines 50 and 90.
        np.testing.assert_allclose(spectrum[[50, 90]], [[0.8, 0], [0.3, 0.4]], atol=1e-9)
        assert np.delete(spectrum, [50, 90], axis=0).max() < 1e-9

    def test_shake_has_its_rms_and_spectrum(self) -> None:
        """Power below 2 Hz of a density that is 1 up to 2 Hz and falls evenly to 0 at 10 Hz: 2 of 2 + 4."""
        keys = {"rms_px": 1.5, "spectrum": [[0.01, 1.0], [2.0, 1.0], [10.0, 0.0]]}
        low, all_of_it = 0.0, 0.0
        for seed in range(4):
            turns = motion("shake", **keys).turns(np.arange(30_000.0), stage(seed))[:, :2] / GEOMETRY.ifov_rad
            np.testing.assert_allclose(turns.std(axis=0), 1.5, rtol=0.03)
            power = np.abs(np.fft.rfft(turns, axis=0)) ** 2
            hertz = np.fft.rfftfreq(30_000, 1 / 30)
            low, all_of_it = low + power[hertz < 2].sum(), all_of_it + power.sum()
        # 64 equally powerful waves an axis, one in each slice: at most one of them is on the wrong side.
        assert low / all_of_it == pytest.approx(1 / 3, abs=1 / 64)

    def test_zoom_goes_evenly_in_its_logarithm(self) -> None:
        zooms = motion("zoom", factors=[[10, 1.0], [40, 4.0]]).zooms(np.array([0.0, 25.0, 40.0, 90.0]), stage())
        np.testing.assert_allclose(zooms, [1, 2, 4, 4])

    def test_a_zoomed_camera_sees_things_farther_from_the_middle(self) -> None:
        mount = Mount.of([motion("zoom", factors=[[0, 1.0], [10, 3.0]])], np.arange(11.0), stage())
        (at_first, *_, last) = mount.seen(np.tile(GEOMETRY.place(np.array([100.0, 70.0]), 500.0), (11, 1)))
        np.testing.assert_allclose(at_first, [100, 70])
        np.testing.assert_allclose(last, GEOMETRY.principal + 3 * (np.array([100, 70]) - GEOMETRY.principal))
        assert mount.lens(10).ifov_rad == pytest.approx(5e-4 / 3)

    def test_a_platform_has_parallax_by_range(self) -> None:
        mount = Mount.of([motion("platform", velocity_m_s=[3.0, 0, 0], sway_m=[0, 0, 0])], np.arange(31.0), stage())
        for range_m in (100.0, 1000.0):
            seen = mount.seen(np.tile([0.0, 0.0, range_m], (31, 1)))
            # A second on, 3 m to the east: 3 / range / 0.5 mrad px to the left.
            np.testing.assert_allclose(seen[30] - seen[0], [-3 / range_m / 5e-4, 0], atol=1e-9)

    @pytest.mark.parametrize("place", [None, [20.0, 100.0]])
    def test_it_keeps_a_target_where_it_is_told(self, place: list[float] | None) -> None:
        leader = path(**LEADER)
        cast = Company({"leader": leader}, (motion("platform"),))
        scene = Stage(0, GEOMETRY, 30.0, "mwir", 0.6, cast)
        mount = Mount.of([motion("platform"), motion("tracks", lag_s=0.0, place_px=place)], np.arange(60.0), scene)
        seen = mount.seen(leader.positions(np.arange(60.0), scene, "leader"))
        np.testing.assert_allclose(seen, np.tile(place or GEOMETRY.principal, (60, 1)), atol=1e-6)

    def test_it_lags_by_its_time(self) -> None:
        leader = path(kind="straight", start=[79.5, 59.5], speed=2.0)
        scene = Stage(0, Geometry((160, 120), 5e-4), 30.0, "mwir", 0.6, Company({"leader": leader}, ()))
        mount = Mount.of([motion("tracks", lag_s=0.2, place_px=None)], np.arange(30.0), scene)
        seen = mount.seen(leader.positions(np.arange(30.0), scene, "leader"))
        # 0.2 s are six frames at 2 px: 12 px ahead of the middle.
        np.testing.assert_allclose(seen[10:], [[91.5, 59.5]] * 20, atol=0.02)
