"""Clock of a playback: frames are due at their times, under play, pause, seek and speed."""

from __future__ import annotations

from pathlib import Path

import pytest

import irsim
from irsim.live.playback import SETTLE_S, Playback, State, times_of


class Hands:
    """Clock that a test moves."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def hands() -> Hands:
    return Hands()


def due(playback: Playback) -> int | None:
    return playback.next(timeout=0)


def test_frames_come_at_their_times(hands: Hands) -> None:
    playback = Playback(4, [0.0, 0.1, 0.4, 0.5].__getitem__, hands)
    assert due(playback) is None
    playback.begin()
    hands.now += SETTLE_S / 2
    playback.begin()  # a second topic of the same viewer
    assert due(playback) is None
    begin = hands.now + SETTLE_S + 1e-6
    shown = []
    for tick in range(8):
        hands.now = begin + 0.1 * tick + 1e-6 * tick
        shown.append(due(playback))
        assert due(playback) is None
    assert shown == [0, 1, None, None, 2, 3, None, None]
    assert playback.state == State("ended", 3, 1.0)


def test_a_slow_caller_gets_every_frame(hands: Hands) -> None:
    playback = Playback(5, lambda index: index / 10, hands)
    playback.begin()
    hands.now += SETTLE_S
    shown = []
    for _ in range(5):
        shown.append(due(playback))
        hands.now += 0.7
    assert shown == [0, 1, 2, 3, 4]


def test_pause_seek_and_speed(hands: Hands) -> None:
    playback = Playback(10, lambda index: index / 10, hands)
    playback.begin()
    hands.now += SETTLE_S
    assert due(playback) == 0
    assert playback.control(False, 1.0) == State("paused", 0, 1.0)
    hands.now += 5
    assert due(playback) is None
    assert playback.control(False, 1.0, 0.55) == State("paused", 6, 1.0)
    assert (due(playback), due(playback)) == (6, None)
    assert playback.control(True, 4.0, 0.2) == State("playing", 2, 4.0)
    assert due(playback) == 2
    hands.now += 0.026
    assert (due(playback), due(playback)) == (3, None)
    assert playback.control(True, 1e9, 99.0) == State("playing", 9, 100.0)
    assert due(playback) == 9
    assert playback.state.status == "ended"
    playback.begin()
    hands.now += SETTLE_S
    assert due(playback) == 9  # for another viewer
    playback.stop()
    assert playback.next() is None


def test_times_are_those_of_the_frames(tmp_path: Path) -> None:
    faults = "[{kind: drop, frames: [3, 4]}, {kind: duplicate, frames: [7]}]"
    camera = f"{{size: [24, 20], rate_hz: 25, faults: {faults}}}"
    source = irsim.Rendering(irsim.loads(f"frames: 12\ncamera: {camera}\nbackground: {{kind: sky}}\n"))
    recording = irsim.open_recording(irsim.record(source, tmp_path / "r.mcap"))
    wanted = [frame.time for frame in source.frames()]
    for each in (source, recording):
        assert [times_of(each)(index) for index in range(len(source))] == pytest.approx(wanted, abs=1e-9)
