"""Frames, generators and answers of a tracker in a run."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_fakes import Strip, Vague, Vandal, Walker

import irsim
import irtrack
from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.cli.track_files import track_as_dict, track_to_csv
from irtrack.errors import InputError, TrackerError
from irtrack.types import Estimate
from irtrack.validity import fault


def test_a_run_over_truth() -> None:
    track = irtrack.run(Walker(), Strip(), label="w", seed=3)
    assert (track.source, track.source_hash, track.tracker, track.target) == ("strip", "5712", "w", "a")
    assert (track.start, track.input, track.scene_seed, track.tracker_seed) == (0, "display", None, 3)
    assert track.config == {"tracker": "bench_fakes:Walker", "parameters": {"speed": 1.0, "jitter": 0.0}}
    assert track.start_box == Box(10.0, 20.0, 5.0, 5.0)  # 4x3 px of truth, made up to 5 px
    assert track.indices.tolist() == list(range(20))
    assert track.times.tolist() == [index / 10 for index in range(20)]
    assert track.centers.tolist() == [[10.0 + index, 20.0] for index in range(20)]
    assert track.step_ms.shape == (20,)
    figures = irtrack.score(track, irtrack.Reference.of(Strip().truths(), "a"))
    assert (figures.frames, figures.all.error) == (19, 0.0)


def test_frames_and_input_follow_the_call() -> None:
    seen: list[Frame] = []

    class Watcher(Walker):
        def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
            seen.append(frame)
            return super().step(state, frame, rng)

    done: list[tuple[int, int]] = []
    late = {"init": (Box(20.0, 20.0, 9.0, 9.0), 17)}
    irtrack.run(Walker(), Strip(), progress=lambda *counts: done.append(counts), **late)
    assert done == [(1, 3), (2, 3), (3, 3)]  # frames before the start do not count
    track = irtrack.run(Watcher(), Strip(), input="counts", frames=4)
    assert len(track.indices) == 4
    assert [(frame.index, str(frame.image.dtype), frame.bits) for frame in seen] == [
        (k, "uint16", 14) for k in (1, 2, 3)
    ]


def test_another_object_is_no_source() -> None:
    for given in (None, np.zeros((4, 4)), 7):
        with pytest.raises(InputError, match=r"^a \w+ is no source; allowed: .* a Scenario, or a Source$"):
            irtrack.run(Walker(), given)


def test_each_step_has_its_own_addressed_generator() -> None:
    track = irtrack.run(Walker(jitter=1.0), Strip(), seed=7, label="renamed")
    for index in (1, 13):
        expected = stream(7, "bench_fakes:Walker", "a", index).normal([10.0 + index, 20.0])
        assert track.centers[index] == pytest.approx(expected, abs=1e-12)
    boxed = irtrack.run(Walker(jitter=1.0), Strip(), seed=7, init=(Box(10.0, 20.0, 5.0, 5.0), 0))
    assert boxed.centers[1] == pytest.approx(stream(7, "bench_fakes:Walker", "init", 1).normal([11.0, 20.0]))


def test_frames_are_read_only_for_trackers() -> None:
    with pytest.raises(TrackerError, match=r"Vandal: frame 1: ValueError: .*read-only"):
        irtrack.run(Vandal(), Strip())
    own = Strip().frame(0, "display")
    assert own.image.flags.writeable


@pytest.mark.parametrize(
    ("said", "needles"),
    [
        ({"status": "searching"}, ["status 'searching'", "tracking, occluded, lost"]),
        ({"center": (1.0, 2.0, 3.0)}, ["center", "(3,)", "allowed: (2)"]),
        ({"center": ("here", "there")}, ["center", "allowed: numbers"]),
        ({"center": (1e300, 0.0)}, ["center (1e+300, 0.0)", "within 1e+06 px"]),
        ({"size": (0.0, 4.0)}, ["size (0.0, 4.0)", "above 0"]),
        ({"score": math.inf}, ["score inf", "finite"]),
        ({"covariance": -np.eye(2)}, ["covariance", "0 or more"]),
        ({"particles": np.zeros(4)}, ["particles", "(4,)", "allowed: (any, any)"]),
        ({"weights": np.full(4, 0.25)}, ["4 weights for no particles"]),
        ({"particles": np.zeros((4, 2)), "weights": np.full(4, 0.5)}, ["weights sum to 2"]),
    ],
)
def test_a_wrong_estimate_is_one_line(said: dict[str, Any], needles: list[str]) -> None:
    good: dict[str, Any] = {"center": (1.0, 2.0), "size": (3.0, 4.0)}
    assert fault(Estimate(**good)) is None
    text = fault(Estimate(**good | said)) or ""
    assert all(needle in text for needle in needles), text
    assert "\n" not in text


def test_an_answer_that_is_no_estimate() -> None:
    class Forgetful(Walker):
        def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Any, Any]:
            return state, state

    with pytest.raises(TrackerError, match=r"frame 1: step gave \(state, Box\); allowed: \(state, Estimate\)"):
        irtrack.run(Forgetful(), Strip())
    with pytest.raises(TrackerError, match=r"Vague: frame 1: .*nan.*allowed: finite"):
        irtrack.run(Vague(), Strip())


def test_a_rendered_scenario_by_name_and_by_value() -> None:
    text = """
frames: 12
camera: {size: [64, 48], noise: []}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [20, 24], range_m: 1500}}
"""
    scenario = irsim.loads(text, overrides=["seed=5"])
    track = irtrack.run("template", scenario)
    assert (track.scene_seed, track.target) == (5, "jet")
    assert track.config["tracker"] == "template"
    figures = irtrack.score(track, irtrack.Reference.of(irsim.Rendering(scenario).truths(), "jet"))
    assert figures.frames == 11
    assert figures.lost is False


def test_irsim_and_irtrack_share_their_input_error() -> None:
    with pytest.raises(irtrack.InputError, match="nowhere"):
        irtrack.run("kalman", "nowhere.mcap")
    with pytest.raises(irsim.InputError, match="did you mean 'kalman'"):
        irtrack.run("kalmann", Strip())
    assert issubclass(irtrack.InputError, irtrack.IrtrackError)


def test_a_track_as_csv_and_json(tmp_path: Path) -> None:
    track = irtrack.run(Walker(), Strip(), frames=3)
    rows = list(csv.DictReader(track_to_csv(track, tmp_path / "track.csv").open()))
    assert [row["frame"] for row in rows] == ["0", "1", "2"]
    assert [float(row["cx"]) for row in rows] == [10.0, 11.0, 12.0]
    assert [row["score"] for row in rows] == ["", "0.5", "0.5"]
    assert {row["status"] for row in rows} == {"tracking"}
    document = json.loads(json.dumps(track_as_dict(track), allow_nan=False))
    assert document["start"] == {"frame": 0, "cx": 10.0, "cy": 20.0, "w": 5.0, "h": 5.0}
    assert document["frames"][2]["cx"] == 12.0
    assert document["frames"][0]["neff"] is None
    with pytest.raises(InputError, match=r"the folder .*absent does not exist"):
        track_to_csv(track, tmp_path / "absent" / "track.csv")
