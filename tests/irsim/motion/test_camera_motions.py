"""Camera motions against their closed forms and spectra."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from motion_stage import GEOMETRY, LEADER, RATE, context, path

from irsim.geometry.context import SceneContext
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


def trajectory(*motions: CameraMotion, frames: int = 41, scene: SceneContext | None = None) -> CameraTrajectory:
    return CameraTrajectory.of(motions, np.arange(float(frames)), scene or context())


@pytest.mark.parametrize("kind", CAMERA_MOTIONS.kinds)
def test_a_frame_alone_equals_the_frame_in_sequence(kind: str) -> None:
    frames, alone = np.arange(50.0), np.array([33.0])
    for method in ("turns", "shifts", "zooms"):
        values = getattr(motion(kind), method)
        np.testing.assert_array_equal(values(alone, context(5))[0], values(frames, context(5))[33])


def test_pan_is_rate_over_ifov() -> None:
    """1 deg/s at 30 frames a second and 0.5 mrad a pixel: 0.0174533 / 30 / 0.0005 = 1.16355 px to the left."""
    pan = motion("pan", elevation_deg_s=0.0)
    ahead = np.tile(GEOMETRY.place(GEOMETRY.principal, 500.0), (2, 1))
    before, after = trajectory(pan, frames=2).project(ahead)
    np.testing.assert_allclose(after - before, [-1.16355, 0.0], atol=2e-2)


def test_rms_and_correlation_of_jitter() -> None:
    """Three frames are 0.1 s, one correlation time: exp(-1/2) = 0.6065."""
    rms, lag = [], []
    for seed in range(8):
        turns = motion("jitter", rms_px=2.0, correlation_s=0.1).turns(np.arange(10_000.0), context(seed))
        rms.append(turns[:, :2].std(axis=0) / GEOMETRY.ifov_rad)
        lag.append([np.corrcoef(one[:-3], one[3:])[0, 1] for one in turns[:, :2].T])
    np.testing.assert_allclose(rms, 2.0, rtol=0.08)
    assert np.mean(lag) == pytest.approx(0.6065, abs=3 * np.std(lag) / np.sqrt(16))
    one, other = (motion("jitter", id=name).turns(np.arange(3.0), context()) for name in ("wind", "motor"))
    assert not np.array_equal(one, other)


def test_lines_of_vibration() -> None:
    """300 frames at 30 Hz: 5 and 9 Hz are lines 50 and 90."""
    turns = motion("vibration", lines=[[5.0, 0.8, 0.0], [9.0, 0.3, 0.4]]).turns(np.arange(300.0), context(2))
    spectrum = np.abs(np.fft.rfft(turns[:, :2] / GEOMETRY.ifov_rad, axis=0)) / 150
    np.testing.assert_allclose(spectrum[[50, 90]], [[0.8, 0], [0.3, 0.4]], atol=1e-9)
    assert np.delete(spectrum, [50, 90], axis=0).max() < 1e-9


def test_rms_and_spectrum_of_shake() -> None:
    """A density of 1 up to 2 Hz that falls linearly to 0 at 10 Hz has 2 of 2 + 4 below 2 Hz."""
    keys = {"rms_px": 1.5, "spectrum": [[0.01, 1.0], [2.0, 1.0], [10.0, 0.0]]}
    turns = motion("shake", **keys).turns(np.arange(30_000.0), context(1))[:, :2] / GEOMETRY.ifov_rad
    np.testing.assert_allclose(turns.std(axis=0), 1.5, rtol=0.03)
    power, hertz = np.abs(np.fft.rfft(turns, axis=0)) ** 2, np.fft.rfftfreq(30_000, 1 / RATE)
    # 64 equally powerful waves, one in each band: at most one of them is on the wrong side.
    assert power[hertz < 2].sum() / power.sum() == pytest.approx(1 / 3, abs=1.5 / 64)


def test_zoom_is_linear_in_its_logarithm() -> None:
    zoom = motion("zoom", factors=[[10, 1.0], [40, 4.0]])
    np.testing.assert_allclose(zoom.zooms(np.array([0.0, 25.0, 40.0, 90.0]), context()), [1, 2, 4, 4])
    camera = trajectory(zoom)
    first, *_, last = camera.project(np.tile(GEOMETRY.place(np.array([100.0, 70.0]), 500.0), (41, 1)))
    np.testing.assert_allclose(first, [100, 70])
    np.testing.assert_allclose(last, GEOMETRY.principal + 4 * (np.array([100, 70]) - GEOMETRY.principal))
    assert camera.lens(40).ifov_rad == pytest.approx(5e-4 / 4)


def test_parallax_of_a_platform() -> None:
    """After a second at 3 m/s to the east: 3 / range / 0.5 mrad px to the left."""
    camera = trajectory(motion("platform", velocity_m_s=[3.0, 0, 0], sway_m=[0, 0, 0]))
    for range_m in (100.0, 1000.0):
        pixels = camera.project(np.tile([0.0, 0.0, range_m], (41, 1)))
        np.testing.assert_allclose(pixels[30] - pixels[0], [-3 / range_m / 5e-4, 0], atol=1e-9)


@pytest.mark.parametrize(
    "way",
    [
        {"kind": "waypoints_m", "axes": "world", "points": [[5, 1, 0], [9, 4, 1], [12, 20, 1]], "speed_m_s": 8},
        {"kind": "singer_m", "start_m": [0, 0, 0], "velocity_m_s": [7, 0, 1], "sigma_m_s2": 3.0},
    ],
)
def test_platform_on_a_path(way: dict[str, Any]) -> None:
    """A point at rest looks like one that moves the other way before a camera at rest; velocity and sway add."""
    frames, point = np.arange(41.0), np.array([2.0, -1.0, 60.0])
    moved = path(**way).positions(frames, context(), "platform")
    still = {"velocity_m_s": [0, 0, 0], "sway_m": [0, 0, 0]}
    expected = trajectory().project(point - moved + moved[0])
    found = trajectory(motion("platform", **still, path=way)).project(np.tile(point, (41, 1)))
    np.testing.assert_allclose(found, expected, atol=1e-9)
    both = motion("platform", path=way).shifts(frames, context())
    np.testing.assert_allclose(both, motion("platform").shifts(frames, context()) + moved - moved[0], atol=1e-9)


@pytest.mark.parametrize("place", [None, [20.0, 100.0]])
@pytest.mark.parametrize("zooms", [[], [[[10, 1.0], [40, 4.0]], [[0, 1.0], [20, 2.0]]]])
def test_target_is_kept_at_its_pixel(place: list[float] | None, zooms: list[Any]) -> None:
    leader = path(**LEADER)
    motions = (motion("platform"), *(motion("zoom", factors=each) for each in zooms))
    scene = SceneContext(0, GEOMETRY, RATE, "mwir", 0.6, SceneMotion({"leader": leader}, motions))
    camera = trajectory(*motions, motion("tracks", lag_s=0.0, place_px=place), frames=60, scene=scene)
    pixels = camera.project(leader.positions(np.arange(60.0), scene, "leader"))
    np.testing.assert_allclose(pixels, np.tile(place or GEOMETRY.principal, (60, 1)), atol=1e-6)


def test_lag_of_a_camera_that_follows() -> None:
    """0.2 s are six frames at 2 px: 12 px ahead of the middle."""
    leader = path(kind="straight", start=[79.5, 59.5], speed=2.0)
    scene = SceneContext(0, GEOMETRY, RATE, "mwir", 0.6, SceneMotion({"leader": leader}, ()))
    camera = trajectory(motion("tracks", lag_s=0.2, place_px=None), frames=30, scene=scene)
    pixels = camera.project(leader.positions(np.arange(30.0), scene, "leader"))
    np.testing.assert_allclose(pixels[10:], [[91.5, 59.5]] * 20, atol=0.1)
