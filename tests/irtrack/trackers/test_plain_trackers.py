"""Plain trackers: a class with start and step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bench_fakes import Strip

import irtrack
from irsim.types import Box, Frame
from irtrack.errors import TrackerError
from irtrack.registry.identity import code_hash, tracker_config
from irtrack.registry.table import make, of
from irtrack.types import Estimate, resumable


class Walks:
    """Moves right by `speed` px a frame; writes on its image."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed

    def start(self, frame: Any, box: Box) -> None:
        self.box = box

    def step(self, frame: Any) -> Any:
        frame[:] = 0
        self.box = Box(self.box.cx + self.speed, self.box.cy, self.box.w, self.box.h)
        return self.answer()

    def answer(self) -> Any:
        return self.box


class Four(Walks):
    def answer(self) -> Any:
        return np.array([self.box.cx, self.box.cy, self.box.w, self.box.h])


class Says(Walks):
    def answer(self) -> Any:
        return Estimate((self.box.cx, self.box.cy), (self.box.w, self.box.h), status="occluded", score=0.5)


class Jitters(Walks):
    def start(self, frame: Any, box: Box, rng: np.random.Generator | None = None) -> None:
        assert rng is not None
        self.box = Box(box.cx + rng.normal(), box.cy, box.w, box.h)


@pytest.mark.parametrize("given", [Walks, Walks(), Four, Four(), Says], ids=["class", "object", "4", "4s", "says"])
def test_every_answer_is_an_estimate(given: Any) -> None:
    track = irtrack.run(given, Strip())
    assert track.centers[:, 0].tolist() == [10.0 + k for k in range(20)]
    assert track.statuses[1:] == (("occluded" if given is Says else "tracking"),) * 19


def test_each_run_has_its_own_object() -> None:
    mine = Walks(speed=2.0)
    first, second = irtrack.run(mine, Strip()), irtrack.run(mine, Strip())
    assert first.centers.tolist() == second.centers.tolist()
    assert first.centers[-1, 0] == 10 + 2 * 19
    assert not hasattr(mine, "box")


def test_generator_of_a_plain_tracker_follows_the_seed() -> None:
    ends = [irtrack.run(Jitters, Strip(), seed=seed).centers[-1, 0] for seed in (0, 0, 1)]
    assert ends[0] == ends[1] != ends[2]


def test_answer_none_is_lost_at_the_last_position() -> None:
    class Blinks(Walks):
        def answer(self) -> Any:
            return None if self.box.cx > 14 else self.box

    track = irtrack.run(Blinks, Strip())
    assert track.statuses[:5] == ("tracking",) * 5
    assert set(track.statuses[5:]) == {"lost"}
    assert track.centers[-1].tolist() == [14.0, 20.0]


@pytest.mark.parametrize("answer", [3, (1, 2, 3), "1234", ("a", 1, 2, 3)])
def test_invalid_answers_are_one_line(answer: Any) -> None:
    class Mute(Walks):
        def answer(self) -> Any:
            return answer

    with pytest.raises(TrackerError, match=r"Mute: frame 1: step gave .*; allowed: a Box, cx, cy, w, h") as caught:
        irtrack.run(Mute, Strip())
    assert "\n" not in str(caught.value)


def test_only_a_declared_class_is_resumable() -> None:
    class Stays:
        def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Box:
            return box

        def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
            return state, Estimate((state.cx, state.cy), (state.w, state.h))

    assert irtrack.run(Stays, Strip()).centers[-1].tolist() == [10.0, 20.0]
    assert not resumable(of(Stays))
    assert not resumable(of(Walks))
    assert resumable(make("kalman"))


def test_results_are_keyed_by_its_class_and_parameters() -> None:
    named = make("test_plain_trackers:Walks", {"speed": 3})
    assert tracker_config(named) == {"tracker": "test_plain_trackers:Walks", "parameters": {"speed": 3.0}}
    assert tracker_config(of(Walks(3.0))) == tracker_config(named)
    assert code_hash(named) == code_hash(of(Walks))


class Clocked(Walks):
    """Notes index and time of the frames that it gets by annotation."""

    def start(self, frame: Frame, box: Box) -> None:
        self.box, self.seen = box, [(frame.index, frame.time, frame.bits)]

    def step(self, frame: Frame) -> Any:
        frame.image[:] = 0
        self.seen.append((frame.index, frame.time, frame.bits))
        return self.box


class ClockedMany:
    def start(self, frame: Frame) -> None:
        self.seen = [(frame.index, frame.time, frame.bits)]

    def step(self, frame: Frame) -> Any:
        self.seen.append((frame.index, frame.time, frame.bits))
        return []


class ClockedDetector:
    def __init__(self) -> None:
        self.seen: list[Any] = []

    def detect(self, frame: Frame) -> Any:
        self.seen.append((frame.index, frame.time, frame.bits))
        return []


@pytest.mark.parametrize("given", [Clocked, ClockedMany, ClockedDetector])
def test_annotated_arguments_get_frames(given: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Trackers of one target, of many, and detectors, by one mechanism."""
    made: list[Any] = []

    def remembered(kind: Any) -> Any:
        made.append(object.__new__(kind))
        return made[-1]

    monkeypatch.setattr(given, "__new__", remembered, raising=False)
    run: Any = {Clocked: irtrack.run, ClockedMany: irtrack.run_many, ClockedDetector: irtrack.run_detector}[given]
    source = Strip()
    run(given, source)
    assert made[-1].seen == [(frame.index, frame.time, frame.bits) for frame in source.frames("display")]


def test_text_annotations_of_other_names_get_images() -> None:
    def detect(image: "Undefined") -> Any:  # type: ignore[name-defined]  # noqa: F821, UP037
        return [(float(image.shape[1]), 1.0, 2.0, 2.0)]

    found = irtrack.run_detector(detect, Strip(), frames=1)
    assert found.cx.tolist() == [Strip().size[0]]
