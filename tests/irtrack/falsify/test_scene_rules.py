"""Rules about all targets of a scene: margins by hand, and their agreement with the metrics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import irsim
from irsim.types import Box, TargetTruth, Truth
from irtrack.falsify.rules import KINDS, explain, frames_to_break, margin, rules_of, stated_rules
from irtrack.falsify.scene_rules import SceneTrace
from irtrack.metrics.tasks import FIGURES_OF
from irtrack.tracks import DetectionSet, TrackSet

RATE_HZ = 10.0
PLACES = {"a": (20.0, 20.0), "b": (60.0, 20.0)}
FALSE = (40.0, 60.0)


def truths(frames: int) -> tuple[Truth, ...]:
    each = tuple(TargetTruth(name, box=Box(*place, 5, 5), center=place, visible=1.0) for name, place in PLACES.items())
    return tuple(Truth(k, k / RATE_HZ, each) for k in range(frames))


def columns(frames: int, rows: list[tuple[int, int, str]]) -> dict[str, Any]:
    """Return columns of rows (frame, id, 'a', 'b' or anything else for a false one)."""
    places = np.array([PLACES.get(name, FALSE) for _, _, name in rows]).reshape(-1, 2)
    index, size = np.arange(frames), np.full(len(rows), 5.0)
    return {
        "source": "s",
        "source_hash": "h",
        "config": {},
        "input": "display",
        "scene_seed": 0,
        "frames": index,
        "times": index / RATE_HZ,
        "step_ms": index * 1.0,
        "cpu_ms": index * 1.0,
        "frame": np.array([frame for frame, _, _ in rows], np.int64),
        "cx": places[:, 0],
        "cy": places[:, 1],
        "w": size,
        "h": size,
        "score": size,
    }


def tracks(frames: int, rows: list[tuple[int, int, str]]) -> SceneTrace:
    ids = np.array([id for _, id, _ in rows], np.int64)
    count = len(rows)
    more: dict[str, Any] = {"id": ids, "status": np.zeros(count, np.int8), "confirmed": np.ones(count, bool)}
    found = TrackSet(tracker="t", tracker_seed=0, **more, **columns(frames, rows))
    return SceneTrace(found, truths(frames), RATE_HZ)


def detections(frames: int, rows: list[tuple[int, int, str]]) -> SceneTrace:
    return SceneTrace(DetectionSet(detector="d", **columns(frames, rows)), truths(frames), RATE_HZ)


def both(frames: range, ids: tuple[int, int] = (1, 2)) -> list[tuple[int, int, str]]:
    return [(k, id, name) for k in frames for id, name in zip(ids, "ab", strict=True)]


def test_probability_of_detection() -> None:
    """Of 40 positions 30 are found, of a 10 of 20; a beginning counts as a second of each target at least."""
    rows = [row for row in both(range(20)) if row[2] == "b" or row[0] < 10]
    for trace in (tracks(20, rows), detections(20, rows)):
        assert margin(irsim.PdAtLeast(share=0.6), trace) == pytest.approx(0.75 / 0.6 - 1)
        assert margin(irsim.PdAtLeast(share=0.6, target="a"), trace) == pytest.approx(0.5 / 0.6 - 1)
        assert margin(irsim.PdAtLeast(share=0.6, target="b"), trace) == pytest.approx(1 / 0.6 - 1)
        assert frames_to_break(irsim.PdAtLeast(share=0.6, target="a"), trace) == 17
        said = explain(irsim.PdAtLeast(share=0.8), trace)
        assert said.asked == "a probability of detection of at least 0.8, of all targets"
        assert said.reached == "30 of 40 positions found; of a in 10 of 20 frames"
    assert margin(irsim.PdAtLeast(share=0.9), tracks(3, [])) == pytest.approx(0.7 / 0.9 - 1)


def test_identity_switches() -> None:
    """Target a has three tracks, the first again after it was another's; b has one."""
    ids = [1] * 4 + [3] * 4 + [1] * 4
    trace = tracks(12, [(k, id, name) for k in range(12) for id, name in ((ids[k], "a"), (2, "b"))])
    assert trace.many.switches == 2
    assert margin(irsim.SwitchesAtMost(), trace) == -2
    assert margin(irsim.SwitchesAtMost(count=4), trace) == 0.5
    assert margin(irsim.SwitchesAtMost(target="b"), trace) == 0
    assert frames_to_break(irsim.SwitchesAtMost(), trace) == 5
    assert frames_to_break(irsim.SwitchesAtMost(count=1), trace) == 9
    assert explain(irsim.SwitchesAtMost(), trace).reached == "2, the first at frame 4, of a"


def test_false_tracks_a_minute() -> None:
    """Two in 20 frames at 10 Hz are 60 a minute; the second begins in frame 12."""
    rows = sorted([*both(range(20)), *((k, 5, "no") for k in range(6)), *((k, 6, "no") for k in range(12, 15))])
    trace = tracks(20, rows)
    assert trace.many.false_tracks_min == 60
    assert margin(irsim.FalseTracksAtMost(per_minute=80), trace) == pytest.approx(0.25)
    assert margin(irsim.FalseTracksAtMost(per_minute=40), trace) == pytest.approx(-0.5)
    assert margin(irsim.FalseTracksAtMost(per_minute=0), trace) == -60
    assert frames_to_break(irsim.FalseTracksAtMost(per_minute=60), trace) == 13
    assert explain(irsim.FalseTracksAtMost(per_minute=40), trace).reached == "2 false tracks in 20 frames, 60 a minute"


def test_false_alarms_a_frame() -> None:
    rows = sorted([*both(range(20)), *((k, 0, "no") for k in (3, 3, 3, 15))])
    trace = detections(20, rows)
    assert margin(irsim.FalseAlarmsAtMost(per_frame=0.4), trace) == pytest.approx(0.5)
    assert margin(irsim.FalseAlarmsAtMost(per_frame=0.1), trace) == pytest.approx(-1)
    assert frames_to_break(irsim.FalseAlarmsAtMost(per_frame=0.2), trace) == 4  # three in a second
    said = explain(irsim.FalseAlarmsAtMost(per_frame=0.1), trace).reached
    assert said == "4 false alarms in 20 frames, 0.2 a frame; 3 in frame 3"


def test_rules_agree_with_the_metrics() -> None:
    """Random tracks and detections of two seconds: a rule at the bound of the metric holds, just beyond it breaks."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        rows = [(k, int(rng.integers(1, 4)), name) for k in range(20) for name in "ab-" if rng.random() < 0.7]
        rows = [row for k, row in enumerate(rows) if row[:2] not in {each[:2] for each in rows[:k]}]
        many, found = tracks(20, rows), detections(20, rows)
        for trace, rule in ((many, irsim.SwitchesAtMost), (many, irsim.FalseTracksAtMost)):
            key, name = ("count", "switches") if rule is irsim.SwitchesAtMost else ("per_minute", "false_tracks_min")
            value = FIGURES_OF["many"][name].of(trace.many)  # type: ignore[misc]  # these are of figures
            assert margin(rule(**{key: value}), trace) == 0
            if value:
                assert margin(rule(**{key: value - 1}), trace) < 0
        for trace, pd in ((many, many.many.recall), (found, found.detection.pd)):
            assert margin(irsim.PdAtLeast(share=pd), trace) == pytest.approx(0, abs=1e-12)
            assert margin(irsim.PdAtLeast(share=min(pd + 0.01, 1)), trace) < 0
        assert margin(irsim.FalseAlarmsAtMost(per_frame=found.detection.false_alarms), found) == 0


def test_untested_without_targets() -> None:
    empty = SceneTrace(tracks(12, []).found, (), RATE_HZ)
    assert margin(irsim.PdAtLeast(), empty) == margin(irsim.SwitchesAtMost(), empty) == 1
    assert margin(irsim.FalseTracksAtMost(per_minute=5), empty) < 1  # tested in every scene


def test_rules_of_each_task() -> None:
    text = "background: {kind: sky}\nexpect: [{kind: pd_at_least}, {kind: false_alarms_at_most, per_frame: 1}]"
    scene = irsim.loads(text)
    assert [rule.kind for rule in rules_of(scene, "detect")] == ["pd_at_least", "false_alarms_at_most"]
    assert [rule.kind for rule in rules_of(scene, "many")] == ["pd_at_least"]
    assert [rule.kind for rule in rules_of(scene)] == ["never_lost"]
    assert stated_rules(scene, "single") == ()
    assert {task for kind in KINDS.values() for task in kind.tasks} == {"single", "many", "detect"}
    text = "background: {kind: sky}\ntargets: [{id: a, shape: {kind: point}, path: {kind: straight, start: [9, 9]}}]\n"
    one = irsim.loads(text + "expect: [{kind: false_tracks_at_most, per_minute: 1, target: a}]")
    with pytest.raises(irsim.InputError, match=r"expect\.0\.target: .* applies to no single target"):
        rules_of(one, "many")


def test_same_and_first() -> None:
    trace = tracks(12, both(range(12)))
    assert trace.same_as(tracks(12, both(range(12))))
    assert not trace.same_as(tracks(12, both(range(12), (1, 3))))
    assert trace.first(5).same_as(SceneTrace(tracks(5, both(range(5))).found, trace.truths, RATE_HZ))
