"""How two processes find out which of them does what."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterator
from itertools import cycle, repeat
from typing import Any

import numpy as np
import pytest

import irsim
from irsim.render import division
from irsim.render import workers as crew
from irsim.render.balance import Balance
from irsim.render.division import DIVIDED, LONG, PHASE, TIMED, TRIED, WHOLE, Contest, Trial, Way
from irsim.render.frame import Renderer
from irsim.render.shared_memory import shared
from irsim.render.worker import Answers, Worker
from irsim.render.workers import _Crew


def clock(parts: tuple[float, ...], frames: int, frozen: Collection[int] = ()) -> Iterator[float]:
    """Times of a trial of `sky`, by the parts of a frame: scene, steps, rest, what is done with it. The first frame
    takes long, and another one too."""
    now = 0.0
    yield now
    scene, step, rest, taken = parts
    for frame in range(frames):
        slow = 100.0 if frame in (0, 10) else 1.0
        yield now
        for part in (scene, step, 0.0, 0.0, rest, taken):  # of what three steps take, the first has all
            now += 0.0 if frame in frozen and part in (step, rest) else slow * part
            yield now
    yield from repeat(now)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("scene", "steps", "rest", "taken", "way"),
    [
        (1.0, 0.5, 0.5, 0.0, DIVIDED),
        (1.2, 0.5, 0.4, 0.05, DIVIDED),
        (1.0, 0.1, 0.1, 0.0, WHOLE),  # the worker would do nearly all
        (1.0, 0.1, 0.1, 0.6, DIVIDED),  # what is done with frames counts
        (1.0, 0.3, 0.6, 1.0, WHOLE),  # and may be too much
        (0.3, 0.7, 0.3, 0.0, DIVIDED),  # the worker takes steps
        (0.3, 0.2, 0.8, 0.0, WHOLE),  # but these are too few
    ],
)
def test_work_is_divided_where_both_have_about_as_much(
    scene: float, steps: float, rest: float, taken: float, way: Way, monkeypatch: pytest.MonkeyPatch
) -> None:
    times = clock((scene, steps, rest, taken), TRIED)
    monkeypatch.setattr(division, "perf_counter", lambda: next(times))
    monkeypatch.setattr(division, "TRIED_S", math.inf)
    trial = Trial(Renderer(irsim.load("sky", ["frames=100", "camera.size=[16, 16]"])))
    assert len(list(trial.frames(range(100)))) == trial.count == TRIED
    assert trial.way() == way
    whole = scene + steps + rest + taken
    dealt = trial.balance().steps(1000)
    assert np.mean(np.asarray(dealt) > 0) == pytest.approx(
        min(max(0.5 - scene / whole, 0) * whole / steps, 1), abs=0.002
    )


def test_frames_that_show_an_earlier_picture_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    still = ["frames=100", "camera.size=[16, 16]", "camera.correction={frames: [12], freeze_frames: 12}"]
    renderer = Renderer(irsim.load("sky", still))
    frozen = {index for index in range(TRIED) if renderer.sensor.shown(index) != index}
    assert len(frozen) == 12
    times = clock((1.0, 0.5, 0.5, 0.0), TRIED, frozen)
    monkeypatch.setattr(division, "perf_counter", lambda: next(times))
    monkeypatch.setattr(division, "TRIED_S", math.inf)
    trial = Trial(renderer)
    assert len(list(trial.frames(range(100)))) == TRIED
    assert trial.way() == DIVIDED


@pytest.mark.parametrize(("step", "count"), [(0.001, TRIED), (0.0035, 16), (0.01, 8)])
def test_a_trial_ends_with_a_block_when_it_takes_long(step: float, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    times = clock((step, step / 2, step / 2, 0.0), 100)
    monkeypatch.setattr(division, "perf_counter", lambda: next(times))
    trial = Trial(Renderer(irsim.load("sky", ["frames=100", "camera.size=[16, 16]"])))
    assert len(list(trial.frames(range(100)))) == count


def test_without_frames_tried_whole_ones_are_rendered() -> None:
    trial = Trial(Renderer(irsim.load("sky", ["camera.size=[16, 16]"])))
    assert trial.way() == WHOLE
    assert trial.balance().steps(3) == [0, 0, 0]


class FakeWorker(Worker):
    """It answers whatever it is asked when it is heard."""

    pid = 1

    def __init__(self, renderer: Renderer, way: Way, left: float) -> None:
        self.asked: list[list[int]] = []
        self.ended = None
        self._renderer, self._way, self._left = renderer, way, left
        self._waiting: deque[tuple[Answers[Any], Any]] = deque()

    def left(self) -> float:
        return self._left if self._waiting else 0.0

    def give(self, count: int, *work: Any) -> Answers[Any]:
        way, wanted, _, steps = work
        self.asked.append(steps)
        answers: Answers[Any] = Answers(self, count)
        halves = [way.begun(self._renderer, index, taken) for index, taken in zip(wanted, steps, strict=True)]
        for begin in range(0, len(halves), way.told):
            self._waiting.append((answers, halves[begin : begin + way.told]))
        return answers

    def listen(self) -> None:
        """Nothing comes by itself."""

    def hear(self) -> None:
        answers, halves = self._waiting.popleft()
        answers.put(halves)


@pytest.mark.parametrize(("left", "last"), [(0.1, 3.0), (0.9, 0.0)])
def test_how_much_a_worker_has_left_says_what_it_is_given(left: float, last: float) -> None:
    scenario = irsim.load("sky", ["frames=400", "camera.size=[16, 16]"])
    renderer = Renderer(scenario)
    worker = FakeWorker(renderer, DIVIDED, left)
    chunks = deque(crew.chunked(range(400), DIVIDED.length, 2))
    with shared(0) as memory:
        balance = Balance(0.5, [0.1] * renderer.steps)
        frames = _Crew(renderer, balance, [worker], memory).frames(DIVIDED, chunks, deque(range(24)))
        assert [frame.truth.index for frame in frames] == list(range(400))
    means = [float(np.mean(steps)) for steps in worker.asked]
    assert means[0] < 1
    assert np.mean(means[-5:]) == pytest.approx(last)


def test_a_frame_tried_is_the_frame() -> None:
    renderer = Renderer(irsim.load("sky", ["frames=3", "camera.size=[16, 16]"]))
    for index, (frame, truth) in enumerate(Trial(renderer).frames(range(3))):
        expected, expected_truth = renderer.frame(index)
        assert np.array_equal(frame.image, expected.image)
        assert truth == expected_truth


@pytest.mark.parametrize("camera", ["camera.time_constant_ms=0", "camera.time_constant_ms=60"])
@pytest.mark.parametrize("way", [WHOLE, DIVIDED], ids=["whole", "divided"])
def test_what_is_lent_is_not_written_to_and_not_kept(way: Way, camera: str) -> None:
    scenario = irsim.load("sky", ["frames=3", "camera.size=[16, 16]", camera])
    renderer, alone = Renderer(scenario), Renderer(scenario)
    for index in range(3):
        expected = alone.frame(index)[0].image
        for steps in range(renderer.steps + 1):
            picture, truth = way.begun(renderer, index, steps)
            before = picture.copy()
            frame = way.ended(renderer, picture, truth, steps, lent=True)
            assert np.array_equal(picture, before)
            picture[:] = 0  # another frame is put there
            assert np.array_equal(frame.image, expected)


@pytest.mark.sampled
@pytest.mark.parametrize(
    "camera",
    [
        "noise=[{kind: shot}, {kind: drift, gain: 0.01, age_s: 300}, {kind: noise_3d, t: 1, tv: 1}]",
        "noise=[{kind: bad_pixels}, {kind: white}, {kind: ar1, rho: 0.9}]",
        "bloom={fraction: 0.5}",
        "correction={frames: [1], freeze_frames: 2}",
        "time_constant_ms=60",
    ],
)
def test_wherever_a_frame_is_divided_it_is_the_frame(camera: str) -> None:
    scenario = irsim.load(
        "sky", ["frames=5", "camera.size=[24, 16]", "camera.detector={kind: electrons}", f"camera.{camera}"]
    )
    worker, here, alone = Renderer(scenario), Renderer(scenario), Renderer(scenario)
    assert here.steps == (0 if "time" in camera else 2 if "shot" in camera else 3)
    for index in range(5):
        expected = alone.frame(index)[0].image
        for steps in range(here.steps + 1):
            picture, truth = DIVIDED.begun(worker, index, steps, np.empty((16, 24), np.float32))
            assert np.array_equal(DIVIDED.ended(here, picture, truth, steps, lent=True).image, expected)
            assert np.array_equal(DIVIDED.ended(here, picture, truth, steps, lent=False).image, expected)


def test_however_steps_are_dealt_out_two_processes_give_the_same_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = irsim.load("sky", ["frames=60", "camera.size=[48, 32]"])
    expected = [frame.image for frame, _ in irsim.frames(scenario)]
    dealt = cycle(range(Renderer(scenario).steps + 1))
    monkeypatch.setattr(crew, "LONG", 0)
    monkeypatch.setattr(Trial, "way", lambda _: DIVIDED)
    monkeypatch.setattr(Balance, "steps", lambda _, count: [next(dealt) for _ in range(count)])
    assert np.array_equal([frame.image for frame, _ in irsim.frames(scenario, jobs=2)], expected)


@pytest.mark.parametrize(
    ("whole_s", "divided_s", "faster"), [(1.0, 0.9, DIVIDED), (1.0, 0.99, WHOLE), (0.9, 1.0, WHOLE)]
)
def test_the_faster_way_goes_on(whole_s: float, divided_s: float, faster: Way, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames outside what is timed take long, whichever way."""
    now = 0.0
    monkeypatch.setattr(division, "perf_counter", lambda: now)
    contest, left, ways = Contest(DIVIDED, LONG), LONG, []
    while left:
        way, count = contest.next(left)
        ways.append((way, count))
        frames = contest.timed(iter(range(count)))
        for number in range(count):
            assert next(frames) == number
            timed = TIMED.start <= number < TIMED.stop
            now += 10.0 if not timed else whole_s if way is WHOLE else divided_s
        assert next(frames, None) is None
        left -= count
    assert ways == [(WHOLE, PHASE), (DIVIDED, PHASE), (faster, LONG - 2 * PHASE)]


@pytest.mark.parametrize(("way", "frames"), [(WHOLE, LONG), (DIVIDED, 2 * PHASE)])
def test_without_two_ways_or_time_for_them_nothing_is_tried(way: Way, frames: int) -> None:
    assert Contest(way, frames).next(frames) == (way, frames)


def test_whichever_way_goes_on_frames_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = irsim.load("sky", ["frames=200", "camera.size=[24, 16]"])
    expected = [frame.image for frame, _ in irsim.frames(scenario)]
    for name, value in (("PHASE", 56), ("TIMED", slice(16, 48))):
        monkeypatch.setattr(division, name, value)
    monkeypatch.setattr(crew, "LONG", 0)
    monkeypatch.setattr(Trial, "way", lambda _: DIVIDED)
    for better in (math.inf, 0.0):  # the one that goes on
        monkeypatch.setattr(division, "BETTER", better)
        found = [frame.image for frame, _ in irsim.frames(scenario, jobs=2)]
        assert np.array_equal(found, expected)
