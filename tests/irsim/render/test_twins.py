"""Twins: bit-identical with nothing removed, equal to the scene without a cause, different from its first frame on."""

from __future__ import annotations

import numpy as np
import pytest

import irsim
from irsim.render.twins import TwinFrame
from irsim.types import Input

SCENE = """
seed: 3
frames: 14
camera:
  size: [64, 48]
  netd_mk: 40
  elevation_deg: 8
  noise: [{kind: white}, {kind: fixed_pattern}]
  motion: [{kind: jitter, rms_px: 0.4}]
  faults: [{kind: drop, frames: [5]}, {kind: duplicate, frames: [8]}]
  agc: {kind: linear, time_constant_frames: 2}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: point, contrast_k: 20},
     path: {kind: turns, start: [10, 16], speed: 2, turns: [[6, 9, 15]], range_m: 3000}}
  - {id: late, shape: {kind: point, contrast_k: 30}, absent: [[0, 3]],
     path: {kind: straight, start: [40, 40], speed: 1, range_m: 2500}}
occluders:
  - {kind: bar, id: post, center_px: [30, 24], size_px: [4, 60], range_m: 100, temperature_k: 275}
  - {kind: bar, id: hiding, hides: jet, frames: [2, 3], range_m: 200, temperature_k: 270}
"""


def played(twins: irsim.Twins, names: list[str], input: Input = "display") -> list[list[TwinFrame]]:
    """Return the frames of the twin with nothing removed, then of that without each cause."""
    frames = twins.frames([frozenset(), *(frozenset([name]) for name in names)], input)
    found: list[list[TwinFrame]] = [[] for _ in range(len(names) + 1)]
    for shown in frames:
        for each in shown:
            found[each.twin].append(each)
    return found


@pytest.mark.parametrize("input", ["display", "counts"])
def test_nothing_removed_is_bit_identical(input: Input) -> None:
    scenario = irsim.loads(SCENE)
    (own,) = played(irsim.Twins(scenario, "jet"), [], input)
    expected = list(irsim.Rendering(scenario).pairs(input=input))
    assert len(own) == len(expected) == 14
    for twin, (frame, truth) in zip(own, expected, strict=True):
        np.testing.assert_array_equal(twin.frame.image, frame.image)
        assert (twin.frame.index, twin.frame.bits, twin.truth) == (frame.index, frame.bits, truth)


def test_each_twin_is_the_scene_without_its_cause() -> None:
    twins = irsim.Twins(irsim.loads(SCENE), "jet")
    names = list(twins.causes)
    assert set(names) == {
        *("post", "hiding", "white", "fixed_pattern", "jitter", "drop", "duplicate"),
        *("other_targets", "manoeuvre", "agc_memory"),
    }
    for name, own in zip(["", *names], played(twins, names), strict=True):
        alone = list(irsim.Rendering(twins.scenario_of([name] if name else [])).frames("display"))
        assert len(own) == len(alone), name
        for twin, frame in zip(own, alone, strict=True):
            np.testing.assert_array_equal(twin.frame.image, frame.image, err_msg=name)


def test_clouds_and_clutter_are_removed() -> None:
    """They need no random number of the rest."""
    few = {"frames": 4, "camera.faults": []}
    clouds = irsim.change(irsim.loads(SCENE), {"background.clouds": [{"id": "high"}], **few})
    ground = {
        "background": {"kind": "ground", "height_m": 20, "clutter": {"per_mrad2": 0.1}},
        "camera.elevation_deg": -8,
    }
    cluttered = irsim.change(irsim.loads(SCENE), ground | few)
    for scenario, cause in ((clouds, "high"), (cluttered, "clutter")):
        twins = irsim.Twins(scenario, "jet", causes=[cause])
        own, twin = played(twins, [cause], "counts")
        for each, other, alone in zip(own, twin, irsim.Rendering(twins.scenario_of([cause])).frames(), strict=True):
            np.testing.assert_array_equal(other.frame.image, alone.image)
            assert (each.frame.image != other.frame.image).any()


def test_twins_differ_from_the_first_frame_of_their_cause_on() -> None:
    """The manoeuvre begins after frame 6, number 5 as one is lost, and moves the target from the next on; the other
    target appears in frame 4. Frames before are rendered once."""
    scenario = irsim.change(irsim.loads(SCENE), {"camera.agc": {"kind": "fixed"}, "camera.motion": []})
    twins = irsim.Twins(scenario, "jet")
    names = ["manoeuvre", "other_targets", "drop", "duplicate"]
    own, *others = played(twins, names, "counts")
    for name, twin in zip(names, others, strict=True):
        same = [np.array_equal(a.frame.image, b.frame.image) for a, b in zip(own, twin, strict=False)]
        shared = [a.history == b.history for a, b in zip(own, twin, strict=False)]
        first, rendered = {"manoeuvre": (6, 5), "other_targets": (4, 4), "drop": (5, 5), "duplicate": (8, 8)}[name]
        assert same.index(False) == first, name
        assert shared == [True] * rendered + [False] * (len(shared) - rendered), name
    frames = twins.frames([frozenset(), frozenset(["other_targets"]), frozenset(["manoeuvre"])])
    for _ in frames:
        pass
    assert (frames.rendered, frames.asked) == (14 + 10 + 8, 3 * 14)


def test_noise_seeds_are_the_same_in_all_twins() -> None:
    scenario = irsim.change(irsim.loads(SCENE), {"camera.agc": {"kind": "fixed"}, "camera.noise": [{"kind": "white"}]})
    frames = irsim.Twins(scenario, "jet").frames([frozenset(), frozenset(["post"])], "counts", (None, 7, 8))
    shown = next(iter(frames))
    images = {(each.twin, each.noise): each.frame.image.astype(int) for each in shown}
    apart = [images[0, n] - images[0, 0] for n in (1, 2)]
    assert (apart[0] != 0).mean() > 0.5
    assert (apart[0] != apart[1]).mean() > 0.5
    away = np.s_[:, :20]  # left of the post
    for n in range(3):
        np.testing.assert_array_equal(images[1, n][away], images[0, n][away])


def test_memory_of_the_detector_is_kept() -> None:
    """A response time and a freezing correction make counts depend on earlier frames."""
    slow = {"camera.time_constant_ms": 20, "camera.correction": {"frames": [6], "freeze_frames": 2}}
    twins = irsim.Twins(irsim.change(irsim.loads(SCENE), slow), "jet")
    names = ["other_targets", "white", "lag"]
    for name, own in zip(["", *names], played(twins, names), strict=True):
        alone = irsim.Rendering(twins.scenario_of([name] if name else [])).frames("display")
        for twin, frame in zip(own, alone, strict=True):
            np.testing.assert_array_equal(twin.frame.image, frame.image, err_msg=name)


def test_mean_path_keeps_the_first_velocity_or_stays_in_view() -> None:
    twins = irsim.Twins(irsim.loads(SCENE), "jet")
    centers = [each.truth.target("jet").center for each in played(twins, ["manoeuvre"])[1]]  # type: ignore[union-attr]
    np.testing.assert_allclose(np.diff(centers[8:], axis=0).mean(axis=0), (2.0, 0.0), atol=0.2)
    turning = {
        "targets.jet.path": {"kind": "waypoints", "points": [[10, 16], [56, 16], [12, 30]], "frames": [0, 3, 13]}
    }
    back = irsim.Twins(irsim.change(irsim.loads(SCENE), turning), "jet")
    last = played(back, ["manoeuvre"])[1][-1].truth.target("jet")
    assert last is not None
    assert last.center == pytest.approx((12, 30), abs=1)


def test_a_cause_that_holds_the_target_in_view_is_dropped() -> None:
    follows = {"camera.motion": [{"kind": "tracks", "target": "jet"}], "frames": 60}
    far = {"targets.jet.path": {"kind": "straight", "start": [10, 16], "speed": 4, "range_m": 3000}}
    twins = irsim.Twins(irsim.change(irsim.loads(SCENE), follows | far), "jet")
    assert "tracks" not in twins.causes
    assert "out of view" in twins.dropped["tracks"]


@pytest.mark.parametrize(
    ("target", "causes", "message"),
    [
        ("jat", None, "target: there is no 'jat'; allowed: jet, late"),
        ("jet", ["posts"], "cause: there is no 'posts'; allowed: post, hiding, white"),
    ],
)
def test_wrong_names_are_errors(target: str, causes: list[str] | None, message: str) -> None:
    with pytest.raises(irsim.InputError, match=message):
        irsim.Twins(irsim.loads(SCENE), target, causes=causes)


def test_a_target_out_of_view_is_an_error() -> None:
    away = {"targets.jet.path": {"kind": "straight", "start": [-50, 16], "speed": 1}, "occluders": []}
    with pytest.raises(irsim.InputError, match="target jet: is out of view in all frames from 0 on"):
        irsim.Twins(irsim.change(irsim.loads(SCENE), away), "jet")
