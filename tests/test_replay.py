"""Who is followed, from when, with which randomness; and what a track looks like on paper."""

from __future__ import annotations

import csv
import json
import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_fakes import Strip, Vague, Vandal, Walker

import irsim
import irtrack
from irsim.rng import stream
from irsim.types import Box, Frame, TargetTruth, Truth
from irtrack.errors import InputError, IrtrackError, TrackerError
from irtrack.identity import code_hash, tracker_config, tracker_name
from irtrack.start import find_start
from irtrack.trackfile import track_as_dict, track_to_csv
from irtrack.types import Estimate, fault


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


def test_it_starts_where_half_of_the_target_shows() -> None:
    strip = Strip(visible=(0.0, 0.4999, 0.5, 1.0))
    assert irtrack.run(Walker(), strip).start == 2
    assert irtrack.run(Walker(), Strip(visible=(None, 1.0))).start == 0  # unknown counts as visible


def test_a_target_out_of_view_does_not_start() -> None:
    inside = TargetTruth("a", (9.0, 9.0), Box(9.0, 9.0, 4.0, 4.0), visible=0.6, in_view=True)
    outside = TargetTruth("a", (-0.6, 9.0), Box(-0.6, 9.0, 4.0, 4.0), visible=0.6, in_view=False)
    truths = [Truth(0, 0.0, (outside,)), Truth(1, 0.1, (inside,))]
    assert find_start(Strip(), truths).frame == 1


def test_a_given_box_is_taken_and_nobody_is_followed() -> None:
    track = irtrack.run(Walker(), Strip(has_truth=False), init=(Box(30.0, 20.0, 9.0, 2.0), 4))
    assert (track.start, track.start_box, track.target) == (4, Box(30.0, 20.0, 9.0, 5.0), None)
    assert track.indices.tolist() == list(range(4, 20))
    assert irtrack.run(Walker(), Strip(), target="a", init=(Box(30.0, 20.0, 9.0, 9.0), 4)).target == "a"


def test_frames_and_input_are_as_asked() -> None:
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


@pytest.mark.parametrize(
    ("keywords", "needles"),
    [
        ({"target": "b"}, ["no target 'b'", "allowed: a"]),
        ({"target": "aa"}, ["did you mean 'a'?"]),
        ({"init": (Box(80.0, 20.0, 9.0, 9.0), 0)}, ["outside the frame of 64x48 px"]),
        ({"init": (Box(-3.1, 20.0, 5.0, 5.0), 0)}, ["outside"]),  # ends at -0.6: before the frame's edge
        ({"init": (Box(-2.9, 20.0, 5.0, 5.0), 0)}, ["outside"]),  # ends at -0.4: no pixel's centre inside
        ({"init": (Box(20.0, 20.0, 0.0, 9.0), 0)}, ["width and height above 0"]),
        ({"init": (Box(math.nan, 20.0, 9.0, 9.0), 0)}, ["finite"]),
        ({"init": (Box(20.0, 20.0, 65.0, 9.0), 0)}, ["65x9 px", "larger than the frame", "allowed: at most 64x48 px"]),
        ({"init": (Box(20.0, 20.0, 9.0, 1e30), 0)}, ["larger than the frame"]),
        ({"frames": 0}, ["frames 0: allowed: 1 or more"]),
        ({"frames": 2.5}, ["frames 2.5: allowed: a whole number, 1 or more"]),
        ({"seed": "x"}, ["seed 'x': allowed: a whole number, 0 or more"]),
        ({"seed": -1}, ["seed -1: allowed: 0 or more"]),
        ({"init": (Box(20.0, 20.0, 9.0, 9.0), 20)}, ["start frame 20", "allowed: 0 to 19"]),
        ({"init": (Box(20.0, 20.0, 9.0, 9.0), 3), "target": "b"}, ["no target 'b'"]),
    ],
)
def test_bad_starts_are_one_line(keywords: dict[str, object], needles: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        irtrack.run(Walker(), Strip(), **keywords)
    assert "\n" not in str(caught.value)
    assert all(needle in str(caught.value) for needle in needles)


def test_a_box_as_large_as_the_frame_is_taken() -> None:
    whole = Box.from_pixels(0, 0, 64, 48)
    assert irtrack.run(Walker(), Strip(), init=(whole, 0)).start_box == whole


@pytest.mark.parametrize("given", [None, np.zeros((4, 4)), 7, [], object()], ids=lambda given: type(given).__name__)
def test_what_is_no_source_is_one_line(given: Any) -> None:
    with pytest.raises(InputError, match=r"^a \w+ is no source; allowed: .* a Scenario, or a Source$"):
        irtrack.run(Walker(), given)


def test_a_pixel_centre_on_the_boxes_edge_is_inside() -> None:
    assert irtrack.run(Walker(), Strip(), init=(Box(-2.5, 20.0, 5.0, 5.0), 0)).start == 0


def test_no_truth_asks_for_a_box() -> None:
    with pytest.raises(InputError, match=r"strip has no truth.*--init"):
        irtrack.run(Walker(), Strip(has_truth=False))
    with pytest.raises(InputError, match="never shows"):
        irtrack.run(Walker(), Strip(visible=(0.1, 0.2)))
    with pytest.raises(InputError, match="no target in any frame"):
        find_start(Strip(), [Truth(0, 0.0)])


def test_each_step_has_its_own_addressed_generator() -> None:
    track = irtrack.run(Walker(jitter=1.0), Strip(), seed=7, label="renamed")
    for index in (1, 13):
        expected = stream(7, "bench_fakes:Walker", "a", index).normal([10.0 + index, 20.0])
        assert track.centers[index] == pytest.approx(expected, abs=1e-12)
    boxed = irtrack.run(Walker(jitter=1.0), Strip(), seed=7, init=(Box(10.0, 20.0, 5.0, 5.0), 0))
    assert boxed.centers[1] == pytest.approx(stream(7, "bench_fakes:Walker", "init", 1).normal([11.0, 20.0]))


def test_no_tracker_changes_what_the_next_one_sees() -> None:
    with pytest.raises(TrackerError, match=r"Vandal: frame 1: ValueError: .*read-only"):
        irtrack.run(Vandal(), Strip())
    own = Strip().frame(0, "display")
    assert own.image.flags.writeable


def test_an_estimate_must_be_finite() -> None:
    with pytest.raises(IrtrackError, match=r"Vague: frame 1: .*nan.*allowed: finite"):
        irtrack.run(Vague(), Strip())


@pytest.mark.parametrize(
    ("said", "needles"),
    [
        ({"status": "searching"}, ["status 'searching'", "tracking, occluded, lost"]),
        ({"center": (1.0, 2.0, 3.0)}, ["center", "(3,)", "allowed: (2)"]),
        ({"center": None}, ["center", "allowed"]),
        ({"center": ("here", "there")}, ["center", "allowed: numbers"]),
        ({"center": (1e300, 0.0)}, ["center (1e+300, 0.0)", "within 1e+06 px"]),
        ({"size": (0.0, 4.0)}, ["size (0.0, 4.0)", "above 0"]),
        ({"score": math.inf}, ["score inf", "finite"]),
        ({"velocity": (1.0, math.nan)}, ["velocity", "finite"]),
        ({"covariance": np.eye(3)}, ["covariance", "(3, 3)", "allowed: (2, 2)"]),
        ({"covariance": -np.eye(2)}, ["covariance", "0 or more"]),
        ({"particles": np.zeros(4)}, ["particles", "(4,)", "allowed: (any, any)"]),
        ({"weights": np.full(4, 0.25)}, ["4 weights for no particles"]),
        ({"particles": np.zeros((4, 2)), "weights": np.full(4, 0.5)}, ["weights sum to 2"]),
    ],
)
def test_whatever_is_wrong_with_an_estimate_is_one_line(said: dict[str, Any], needles: list[str]) -> None:
    good: dict[str, Any] = {"center": (1.0, 2.0), "size": (3.0, 4.0)}
    assert fault(Estimate(**good)) is None
    text = fault(Estimate(**good | said)) or ""
    assert all(needle in text for needle in needles), text
    assert "\n" not in text


def test_what_is_no_estimate_is_one_line() -> None:
    class Forgetful(Walker):
        def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Any, Any]:
            return state, state

    with pytest.raises(IrtrackError, match=r"frame 1: step gave \(state, Box\); allowed: \(state, Estimate\)"):
        irtrack.run(Forgetful(), Strip())


def test_configurations_that_differ_are_told_apart() -> None:
    class Of:
        def __init__(self, value: object) -> None:
            self.value = value

    def told(value: object) -> str:
        return json.dumps(tracker_config(Of(value))["parameters"]["value"], allow_nan=False)  # type: ignore[arg-type]

    long = np.zeros(5000)
    other = long.copy()
    other[2500] = 1  # where numpy's repr leaves out
    values = [long, other, long.astype(np.float32), long.reshape(50, 100), Nest(long), Nest(other), math.inf, -math.inf]
    assert len({told(value) for value in values}) == len(values)
    assert told(long) == told(np.zeros(5000))
    assert told({"b", "a"}) == told({"a", "b"})
    assert told(np.float32(0.5)) == told(0.5)
    for vague in (object(), [object()], np.array([object()])):
        with pytest.raises(InputError, match=r"value: object does not say what it is.*allowed"):
            told(vague)


@dataclass(frozen=True)
class Nest:
    inner: np.ndarray


def test_only_the_tracker_is_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(np.arange(0, 1000, 0.25))
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    cpu = iter(np.arange(0, 1000, 0.125))
    monkeypatch.setattr(time, "process_time", lambda: next(cpu))
    track = irtrack.run(Walker(), Strip())
    assert (track.step_ms.tolist(), track.cpu_ms.tolist()) == ([250.0] * 20, [125.0] * 20)


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


def test_name_and_configuration_of_a_tracker() -> None:
    known = irtrack.make("kalman")
    assert tracker_name(known) == "kalman"
    again = irtrack.make("kalman", tracker_config(known)["parameters"])
    assert again == known

    class Plain:
        def __init__(self) -> None:
            self.gain = 2
            self.model = object

    assert tracker_config(Plain()) == {  # type: ignore[arg-type]
        "tracker": tracker_name(Plain()),  # type: ignore[arg-type]
        "parameters": {"gain": 2, "model": repr(object)},
    }


def test_the_code_hash_follows_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def hash_of(name: str, text: str) -> str:
        (tmp_path / f"{name}.py").write_text(text)
        return code_hash(__import__(name).T())

    monkeypatch.syspath_prepend(tmp_path)
    plain = "class T:\n    pass\n"
    own = [hash_of("hashed_one", plain), hash_of("hashed_two", plain + "\n")]
    assert own[0] != own[1]
    (tmp_path / "hashed_one.py").write_text(plain + "# changed\n")
    assert code_hash(__import__("hashed_one").T()) != own[0]
    # what it imports of irtrack counts, through packages and their modules
    importing = hash_of("hashed_three", "from irtrack.filters import kalman\n" + plain)
    assert importing != hash_of("hashed_four", "from irtrack.features import window\n" + plain)
    assert code_hash(irtrack.make("kalman")) != code_hash(irtrack.make("template"))
    assert code_hash(irtrack.make("kalman")) == code_hash(irtrack.make("kalman"))


def test_a_track_as_csv_and_json(tmp_path: Path) -> None:
    track = irtrack.run(Walker(), Strip(), frames=3)
    path = track_to_csv(track, tmp_path / "track.csv")
    rows = list(csv.DictReader(path.open()))
    assert [row["frame"] for row in rows] == ["0", "1", "2"]
    assert [float(row["cx"]) for row in rows] == [10.0, 11.0, 12.0]
    assert [row["score"] for row in rows] == ["", "0.5", "0.5"]
    assert {row["status"] for row in rows} == {"tracking"}
    document = json.loads(json.dumps(track_as_dict(track), allow_nan=False))
    assert document["start"] == {"frame": 0, "cx": 10.0, "cy": 20.0, "w": 5.0, "h": 5.0}
    assert document["frames"][2]["cx"] == 12.0
    assert document["frames"][0]["neff"] is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["track.csv"]


def test_one_except_catches_what_irsim_and_irtrack_say_of_bad_input() -> None:
    with pytest.raises(irtrack.InputError, match="nowhere"):
        irtrack.run("kalman", "nowhere.mcap")
    with pytest.raises(irsim.InputError, match="did you mean 'kalman'"):
        irtrack.run("kalmann", Strip())
    assert issubclass(irtrack.InputError, irtrack.IrtrackError)


def test_a_folder_that_does_not_exist_is_one_line(tmp_path: Path) -> None:
    track = irtrack.run(Walker(), Strip(), frames=2)
    with pytest.raises(irsim.InputError, match=r"the folder .*absent does not exist"):
        track_to_csv(track, tmp_path / "absent" / "track.csv")
