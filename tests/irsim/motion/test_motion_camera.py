"""Camera motions against their closed forms and spectra."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from motion_stage import GEOMETRY, LEADER, context, path

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion import CAMERA_MOTIONS, CameraMotion, CameraTrajectory, SceneMotion

MOTIONS: dict[str, dict[str, Any]] = {
    "pan": {"azimuth_deg_s": 1.0, "elevation_deg_s": 2.0},
    "jitter": {},
    "shake": {},
    "vibration": {"lines": [[7.0, 0.5, 0.2], [41.0, 0.1, 0.1]]},
    "zoom": {"factors": [[10, 1.0], [40, 3.0]]},
    "platform": {"velocity_m_s": [10, 5, -1], "sway_m": [0, 0, 0.5]},
    "tracks": {"target": "leader", "lag_s": 0.1, "place_px": [100, 30]},
}


def motion(kind: str, **keys: Any) -> CameraMotion:
    value = CAMERA_MOTIONS.parse({"kind": kind, **MOTIONS[kind], **keys})
    assert isinstance(value, CameraMotion)
    return value


def test_every_camera_motion_is_tested() -> None:
    assert set(MOTIONS) == set(CAMERA_MOTIONS.kinds)


class TestPointings:
    def test_pan_moves_a_fixed_point_by_its_rate_over_the_ifov(self) -> None:
        pan = CAMERA_MOTIONS.parse({"kind": "pan", "azimuth_deg_s": 1.0})
        assert isinstance(pan, CameraMotion)
        level = Geometry((160, 120), 5e-4)
        turns = pan.turns(np.array([0.0, 1.0]), context())
        ahead = [level.project(level.rotation(turn) @ [0.0, 0.0, 500.0]) for turn in turns]
        # 1 deg/s at 30 frames a second and 0.5 mrad a pixel: 0.0174533 / 30 / 0.0005 = 1.16355 px to the left.
        np.testing.assert_allclose(ahead[1] - ahead[0], [-1.16355, 0.0], atol=1e-5)

    def test_jitter_has_its_rms_and_correlation(self) -> None:
        frames = np.arange(0.0, 40_000.0)
        rms, lag = [], []
        for seed in range(10):
            shaking = CAMERA_MOTIONS.parse({"kind": "jitter", "rms_px": 2.0, "correlation_s": 0.1})
            assert isinstance(shaking, CameraMotion)
            turns = shaking.turns(frames, context(seed))[:, :2] / GEOMETRY.ifov_rad
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
            np.testing.assert_array_equal(ask(alone, context(5))[0], ask(frames, context(5))[33])

    def test_jitters_of_two_names_differ(self) -> None:
        one, other = (CAMERA_MOTIONS.parse({"kind": "jitter", "id": name}) for name in ("wind", "motor"))
        assert isinstance(one, CameraMotion)
        assert isinstance(other, CameraMotion)
        assert not np.array_equal(one.turns(np.arange(3.0), context()), other.turns(np.arange(3.0), context()))

    def test_vibration_is_its_lines(self) -> None:
        turns = motion("vibration", lines=[[5.0, 0.8, 0.0], [9.0, 0.3, 0.4]]).turns(np.arange(300.0), context(2))
        spectrum = np.abs(np.fft.rfft(turns[:, :2] / GEOMETRY.ifov_rad, axis=0)) / 150
        # 300 frames at 30 Hz: 0.1 Hz a line, so 5 and 9 Hz are lines 50 and 90.
        np.testing.assert_allclose(spectrum[[50, 90]], [[0.8, 0], [0.3, 0.4]], atol=1e-9)
        assert np.delete(spectrum, [50, 90], axis=0).max() < 1e-9

    def test_shake_has_its_rms_and_spectrum(self) -> None:
        """Power below 2 Hz of a density that is 1 up to 2 Hz and falls evenly to 0 at 10 Hz: 2 of 2 + 4."""
        keys = {"rms_px": 1.5, "spectrum": [[0.01, 1.0], [2.0, 1.0], [10.0, 0.0]]}
        low, all_of_it = 0.0, 0.0
        for seed in range(4):
            turns = motion("shake", **keys).turns(np.arange(30_000.0), context(seed))[:, :2] / GEOMETRY.ifov_rad
            np.testing.assert_allclose(turns.std(axis=0), 1.5, rtol=0.03)
            power = np.abs(np.fft.rfft(turns, axis=0)) ** 2
            hertz = np.fft.rfftfreq(30_000, 1 / 30)
            low, all_of_it = low + power[hertz < 2].sum(), all_of_it + power.sum()
        # 64 equally powerful waves an axis, one in each slice: at most one of them is on the wrong side.
        assert low / all_of_it == pytest.approx(1 / 3, abs=1 / 64)

    def test_zoom_goes_evenly_in_its_logarithm(self) -> None:
        zooms = motion("zoom", factors=[[10, 1.0], [40, 4.0]]).zooms(np.array([0.0, 25.0, 40.0, 90.0]), context())
        np.testing.assert_allclose(zooms, [1, 2, 4, 4])

    def test_a_zoomed_camera_sees_things_farther_from_the_middle(self) -> None:
        mount = CameraTrajectory.of([motion("zoom", factors=[[0, 1.0], [10, 3.0]])], np.arange(11.0), context())
        (at_first, *_, last) = mount.seen(np.tile(GEOMETRY.place(np.array([100.0, 70.0]), 500.0), (11, 1)))
        np.testing.assert_allclose(at_first, [100, 70])
        np.testing.assert_allclose(last, GEOMETRY.principal + 3 * (np.array([100, 70]) - GEOMETRY.principal))
        assert mount.lens(10).ifov_rad == pytest.approx(5e-4 / 3)

    def test_a_platform_has_parallax_by_range(self) -> None:
        mount = CameraTrajectory.of(
            [motion("platform", velocity_m_s=[3.0, 0, 0], sway_m=[0, 0, 0])], np.arange(31.0), context()
        )
        for range_m in (100.0, 1000.0):
            seen = mount.seen(np.tile([0.0, 0.0, range_m], (31, 1)))
            # A second on, 3 m to the east: 3 / range / 0.5 mrad px to the left.
            np.testing.assert_allclose(seen[30] - seen[0], [-3 / range_m / 5e-4, 0], atol=1e-9)

    @pytest.mark.parametrize(
        "way",
        [
            {"kind": "waypoints_m", "axes": "world", "points": [[5, 1, 0], [9, 4, 1], [12, 20, 1]], "speed_m_s": 8},
            {"kind": "turns_m", "start_m": [3, 0, 9], "speed_m_s": 10, "turns": [[5, 15, 90], [15, 35, -90]]},
            {"kind": "singer_m", "start_m": [0, 0, 0], "velocity_m_s": [7, 0, 1], "sigma_m_s2": 3.0},
        ],
    )
    def test_a_platform_on_a_path_sees_what_stands_as_a_camera_at_rest_sees_what_goes_the_other_way(
        self, way: dict[str, Any]
    ) -> None:
        """Places less the platform's own way from where it began, seen by a camera that stands."""
        frames, point = np.arange(41.0), np.array([2.0, -1.0, 60.0])
        gone = path(**way).positions(frames, context(), "platform")
        carried = CameraTrajectory.of(
            [motion("platform", velocity_m_s=[0, 0, 0], sway_m=[0, 0, 0], path=way)], frames, context()
        )
        standing = CameraTrajectory.of([], frames, context())
        np.testing.assert_allclose(
            carried.seen(np.tile(point, (41, 1))), standing.seen(point - gone + gone[0]), atol=1e-9
        )
        assert np.ptp(np.diff(gone, n=2, axis=0), axis=0).max() > 1e-3  # it does not go evenly

    def test_a_path_comes_on_top_of_a_platforms_velocity_and_sway(self) -> None:
        frames = np.arange(20.0)
        straight = {"kind": "straight_m", "axes": "world", "start_m": [9, 9, 9], "velocity_m_s": [1, 2, 3]}
        both = motion("platform", path=straight).shifts(frames, context())
        even = motion("platform", velocity_m_s=[11, 7, 2]).shifts(frames, context())
        np.testing.assert_allclose(both, even, atol=1e-9)

    @pytest.mark.parametrize("place", [None, [20.0, 100.0]])
    def test_it_keeps_a_target_where_it_is_told(self, place: list[float] | None) -> None:
        leader = path(**LEADER)
        cast = SceneMotion({"leader": leader}, (motion("platform"),))
        scene = SceneContext(0, GEOMETRY, 30.0, "mwir", 0.6, cast)
        mount = CameraTrajectory.of(
            [motion("platform"), motion("tracks", lag_s=0.0, place_px=place)], np.arange(60.0), scene
        )
        seen = mount.seen(leader.positions(np.arange(60.0), scene, "leader"))
        np.testing.assert_allclose(seen, np.tile(place or GEOMETRY.principal, (60, 1)), atol=1e-6)

    @pytest.mark.parametrize("place", [None, [20.0, 100.0], [100.0, 60.0]])
    def test_it_keeps_a_target_where_it_is_told_whatever_the_zoom(self, place: list[float] | None) -> None:
        leader = path(**LEADER)
        motions = (
            motion("zoom", factors=[[10, 1.0], [40, 4.0]]),
            motion("tracks", lag_s=0.0, place_px=place),
            motion("zoom", factors=[[0, 1.0], [20, 2.0]]),
        )
        scene = SceneContext(0, GEOMETRY, 30.0, "mwir", 0.6, SceneMotion({"leader": leader}, motions))
        mount = CameraTrajectory.of(motions, np.arange(60.0), scene)
        assert mount.zooms[-1] == pytest.approx(8.0)
        seen = mount.seen(leader.positions(np.arange(60.0), scene, "leader"))
        np.testing.assert_allclose(seen, np.tile(place or GEOMETRY.principal, (60, 1)), atol=1e-6)

    def test_it_lags_by_its_time(self) -> None:
        leader = path(kind="straight", start=[79.5, 59.5], speed=2.0)
        scene = SceneContext(0, Geometry((160, 120), 5e-4), 30.0, "mwir", 0.6, SceneMotion({"leader": leader}, ()))
        mount = CameraTrajectory.of([motion("tracks", lag_s=0.2, place_px=None)], np.arange(30.0), scene)
        seen = mount.seen(leader.positions(np.arange(30.0), scene, "leader"))
        # 0.2 s are six frames at 2 px: 12 px ahead of the middle.
        np.testing.assert_allclose(seen[10:], [[91.5, 59.5]] * 20, atol=0.02)
