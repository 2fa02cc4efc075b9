"""Real time: frames that come while the tracker works are dropped, and scored with the last estimate."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from bench_fakes import Strip, Walker

import irsim
import irtrack
from irsim.types import Box, Frame
from irtrack.errors import InputError
from irtrack.metrics import Reference
from irtrack.replay.live import overlay
from irtrack.replay.real_time import RealTime
from irtrack.replay.replay import Player, replay
from irtrack.replay.start import Start
from irtrack.types import Estimate


@dataclass(frozen=True)
class Slow(Walker):
    """Walker whose steps take `ms` on the clock of the player."""

    ms: float = 0.0


def played(ms: float, rate: float, steps: dict[int, float] | None = None) -> tuple[RealTime, Player]:
    """Return a player of 20 frames at 10 Hz, whose steps take `ms`, or other times in single frames."""
    player = Player(Slow(ms=ms), Start("a", 0, Box(10, 20, 5, 5)))
    camera = RealTime(player, rate)
    see = player.see

    def timed(frame: Frame) -> None:
        see(frame)
        player.clock.step_ms[-1] = (steps or {}).get(frame.index, ms)

    player.see = timed  # type: ignore[method-assign]
    replay(Strip(), [camera.see], "display", 0)
    camera.finish()
    return camera, player


@pytest.mark.parametrize(
    ("ms", "rate", "kept"),
    [
        (99, 1, [*range(20)]),
        (155, 1, [0, 1, 3, 4, 6, 7, 9, 10, 12, 13, 15, 17, 18, 19]),
        (185, 1, [0, 1, 3, 5, 7, 9, 11, 12, 14, 16, 18, 19]),
        (255, 1, [0, 2, 5, 7, 10, 12, 15, 17, 19]),
        (99, 2, [0, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19]),
        (250, 0.4, [*range(20)]),
        (1e6, 1, [0, 19]),
    ],
)
def test_the_newest_frame_follows_a_step(ms: float, rate: float, kept: list[int]) -> None:
    """The camera's frames arrive every 100 ms / rate; worked by hand."""
    camera, player = played(ms, rate)
    assert player.clock.indices == kept
    assert [index for index, _ in camera.dropped] == [k for k in range(20) if k not in kept]


def test_one_slow_step_drops_the_frames_beside_it() -> None:
    camera, player = played(1, 1, {5: 350})
    assert [index for index, _ in camera.dropped] == [6, 7]
    track = camera.held(player.track(Strip(), "display"))
    assert track.indices.tolist() == list(range(20))
    assert track.times.tolist() == [k / 10 for k in range(20)]
    assert [each.center for each in track.estimates[5:9]] == [track.estimates[5].center] * 3 + [
        track.estimates[8].center
    ]
    assert track.step_ms[5:9].tolist() == [350, 350, 350, 1]
    figures = irtrack.score(track, Reference.of(Strip().truths(), "a"))
    assert figures.frames == 19


def test_run_in_real_time_and_its_wrong_rates() -> None:
    whole, fast = irtrack.run(Walker(), Strip()), irtrack.run(Walker(), Strip(), rate=1.0)
    assert fast.indices.tolist() == whole.indices.tolist()
    assert np.array_equal(fast.centers, whole.centers)
    for rate in (0, -1, float("nan"), 1e9, "1", True):
        with pytest.raises(InputError, match=r"^rate .*: allowed: 0\.001 to 1000 times the camera's frame rate$"):
            irtrack.run(Walker(), Strip(), rate=rate)


class Seeing(Walker):
    """Walker that keeps the frames it gets."""

    seen: list[int] = []  # noqa: RUF012 - of the test

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        self.seen.append(frame.index)
        return super().step(state, frame, rng)


def test_tracks_for_a_viewer_follow_its_seeking() -> None:
    source = Strip()
    track = irtrack.run(Walker(), source, init=(Box(10, 20, 5, 5), 2))
    Seeing.seen.clear()
    player = Player(Seeing(), Start(None, 2, Box(10, 20, 5, 5)))
    shown = overlay(player, source, "display")

    def states(index: int) -> list[Any]:
        truth = source.truth(index)
        return list(shown.states(source.frame(index), source.frame(index, "display"), truth))

    assert states(0) == []
    for index in (2, 3, 9, 4, 9, 10):
        (state,) = states(index)
        assert (state.index, state.box) == (index, track.estimates[index - 2].box)
    assert Seeing.seen == [3, 4, 5, 6, 7, 8, 9, 10]


def test_command_prints_the_drops(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    from typer.testing import CliRunner

    from irtrack.cli.app import app

    scene = "frames: 20\ncamera: {size: [48, 40], rate_hz: 30}\nbackground: {kind: sky}\ntargets:\n"
    scene += "  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [9, 20], speed: 1, range_m: 1500}}\n"
    (tmp_path / "s.yaml").write_text(scene)
    words = ["run", "kalman", str(tmp_path / "s.yaml"), "--rate"]
    assert "at 0.01 times 30 Hz" in CliRunner().invoke(app, [*words, "0.01"]).output
    found = json.loads(CliRunner().invoke(app, [*words, "1000", "--json"]).stdout)
    kept = [each["frame"] for each in found["frames"]]
    assert sorted(kept + found["dropped"]) == list(range(20))
    assert found["dropped"]
    assert found["score"]["frames"] == 19
    done = CliRunner().invoke(app, ["run", "gnn", str(tmp_path / "s.yaml"), "--rate", "1"])
    assert "--rate: gnn does not follow one target" in str(done.exception)
    assert irsim.load(tmp_path / "s.yaml").frames == 20
