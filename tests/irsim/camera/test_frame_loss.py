"""Frames that are lost or arrive twice: indices, times, ground truth, recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import irsim
import irtrack
from irsim.camera import FRAME_FAULTS
from irsim.camera.frame_loss import Drop, Duplicate, FrameFault, arriving_frames
from irsim.recording import open_recording, record
from irsim.render.sources import open_rendering
from irsim.render.stream import Rendering
from irsim.types import Frame, Truth

SCENE = """
frames: 20
seed: 5
camera: {size: [48, 40], ifov_mrad: 1, agc: {kind: linear, time_constant_frames: 0.5}}
background: {kind: sky}
targets: [{id: jet, shape: {kind: point, area_m2: 9}, path: {kind: straight, start: [8, 20], speed: 0.8, range_m: 900}}]
"""


def scene(*overrides: str) -> irsim.Scenario:
    return irsim.loads(SCENE, "scene", list(overrides))


def faulty(faults: str) -> Rendering:
    return Rendering(scene(f"camera.faults={faults}"), "scene")


def same(a: tuple[Frame, Truth | None], b: tuple[Frame, Truth | None]) -> bool:
    """Return True if picture, time and truth are equal; indices may differ."""
    first, second = a[1], b[1]
    return (
        bool((a[0].image == b[0].image).all())
        and a[0].time == b[0].time
        and (first is None or second is None or (first.targets, first.time) == (second.targets, second.time))
    )


# Which frames arrive


def test_listed_frames_are_lost_or_doubled() -> None:
    drop, double = Drop(frames=(2, 5)), Duplicate(frames=(0, 3))
    assert arriving_frames([drop], 7, 0) == (0, 1, 3, 4, 6)
    assert arriving_frames([double], 5, 0) == (0, 0, 1, 2, 3, 3, 4)
    assert arriving_frames([drop, double], 7, 0) == arriving_frames([double, drop], 7, 0) == (0, 0, 1, 3, 3, 4, 6)
    assert arriving_frames([Drop(frames=(2, 3), length_frames=3)], 8, 0) == (0, 1, 6, 7)
    assert arriving_frames([Drop(frames=(100,))], 3, 0) == (0, 1, 2)


@pytest.mark.parametrize("word", FRAME_FAULTS.kinds)
def test_hits_do_not_depend_on_the_number_of_frames(word: str) -> None:
    still = FRAME_FAULTS.parse({"kind": word})
    assert isinstance(still, FrameFault)
    assert list(arriving_frames([still], 3000, 1)) == list(range(3000))
    for rate, length, count in ((0.02, 5, 1000), (0.4, 1, 1024), (1.0, 2, 1)):
        fault = still.model_copy(update={"rate": rate, "length_frames": length})
        np.testing.assert_array_equal(fault.hits(count, 3), fault.hits(count + 1500, 3)[:count])
        came = list(arriving_frames([fault], count, 3))
        assert came == sorted(came)


def test_the_share_of_hits_follows_the_rate() -> None:
    """A frame is hit unless none of the `length` frames up to it began a fault: 1 - (1 - rate)^length."""
    count = 200_000
    for rate, length in ((0.02, 3), (0.3, 1)):
        share, expected = Drop(rate=rate, length_frames=length).hits(count, 3).mean(), 1 - (1 - rate) ** length
        # Runs of `length` frames are correlated: the variance is at most that many times the binomial one.
        assert share == pytest.approx(expected, abs=4 * np.sqrt(length * expected * (1 - expected) / count))


def test_hits_are_addressed_by_seed_and_name() -> None:
    one = Drop(rate=0.5).hits(500, 1)
    for other in (Drop(rate=0.5).hits(500, 2), Drop(rate=0.5, id="cable").hits(500, 1)):
        assert 150 < (one ^ other).sum() < 350


# Sources


def test_arriving_frames_are_those_of_a_faultless_camera() -> None:
    whole = list(Rendering(scene()).pairs())
    source = faulty("[{kind: drop, rate: 0.2, frames: [0, 7]}, {kind: duplicate, frames: [9, 10]}]")
    found = list(source.pairs())
    assert len(found) == len(source) == len(source.arrivals) < 20
    assert all(same(pair, whole[taken]) for pair, taken in zip(found, source.arrivals, strict=True))
    for index, (frame, truth) in enumerate(found):
        assert truth is not None
        assert frame.index == truth.index == index
        assert frame.time == truth.time == source.arrivals[index] / 30
    assert [truth for _, truth in found] == list(source.truths())
    for index in (-1, len(source)):
        with pytest.raises(IndexError):
            source.frame(index)


def test_a_frame_alone_is_the_one_in_sequence() -> None:
    source = faulty("[{kind: drop, rate: 0.3}, {kind: duplicate, rate: 0.3}]")
    inputs: tuple[irsim.Input, ...] = ("counts", "display")
    for input in inputs:
        found = list(source.pairs(input=input))
        for index in (14, 3):
            assert (source.frame(index, input).image == found[index][0].image).all()


def test_a_fault_can_be_switched_off() -> None:
    text = "camera.faults=[{kind: drop, rate: 0.4}, {kind: duplicate, id: echo, rate: 0.4}]"
    assert len(Rendering(scene(text, "without=[drop, echo]"))) == 20
    half = Rendering(scene(text, "without=[echo]"))
    assert list(half.arrivals) == np.flatnonzero(~Drop(rate=0.4).hits(20, 5)).tolist()


def test_a_recording_keeps_times_and_renders_again(tmp_path: Path) -> None:
    source = faulty("[{kind: drop, rate: 0.3}, {kind: duplicate, rate: 0.2}]")
    path = record(source, tmp_path / "a.mcap")
    recording, expected = open_recording(path), list(source.pairs())
    assert all(same(a, b) and a[0].index == b[0].index for a, b in zip(recording.pairs(), expected, strict=True))
    again, start, stop = open_rendering(path, frames=(4, 12))
    assert all(same(a, b) for a, b in zip(again.pairs(start, stop), expected[4:12], strict=True))
    more, start, stop = open_rendering(path, frames=(10, 30))
    assert stop - start == len(list(more.pairs(start, stop))) == 20


def test_frame_ranges_of_scenarios_count_lost_frames(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    rendering, start, stop = open_rendering(path, ["camera.faults=[{kind: drop, frames: [3, 11]}]"], frames=(10, 15))
    assert [frame.time * 30 for frame in rendering.frames(start=start, stop=stop)] == pytest.approx([10, 12, 13, 14])
    with pytest.raises(irsim.InputError, match="none arrives"):
        open_rendering(path, ["camera.faults=[{kind: drop, frames: [3]}]"], frames=(3, 4))


def test_trackers_run_on_the_frames_that_arrive() -> None:
    source = faulty("[{kind: drop, frames: [0, 1, 12]}, {kind: duplicate, frames: [16]}]")
    track = irtrack.run("template", source)
    assert track.start == 0
    assert track.indices.tolist() == list(range(18))
    assert track.times.tolist() == [frame.time for frame in source.frames()]


@pytest.mark.parametrize(
    ("faults", "what"),
    [
        ("[{kind: drop, rate: 1}]", r"camera\.faults: no frame of 20 arrives"),
        ("[{kind: drop, rate: 1.2}]", r"camera\.faults\.drop\.rate"),
        ("[{kind: dorp}]", r"unknown fault kind 'dorp'.*did you mean 'drop'"),
        ("[{kind: drop}, {kind: drop}]", "the id 'drop' is used twice"),
    ],
)
def test_wrong_faults_are_refused(faults: str, what: str) -> None:
    with pytest.raises(irsim.InputError, match=what):
        faulty(faults)
