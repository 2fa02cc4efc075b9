"""Frames that are lost or arrive twice: indices, times, ground truth, recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import irsim
import irtrack
from irsim.camera import FRAME_FAULTS
from irsim.camera.frame_loss import Drop, Duplicate, FrameFault, arriving_frames
from irsim.recording import open_recording, record
from irsim.render.sources import open_rendering
from irsim.render.stream import Rendering
from irsim.types import Frame, Truth

SCENE = """
frames: 40
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
    """Return whether picture, time and truth are equal, indices aside."""
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
def test_a_kind_without_frames_or_rate_changes_nothing(word: str) -> None:
    fault = FRAME_FAULTS.parse({"kind": word})
    assert isinstance(fault, FrameFault)
    assert list(arriving_frames([fault], 3000, 1)) == list(range(3000))


@pytest.mark.parametrize("word", FRAME_FAULTS.kinds)
@given(
    rate=st.floats(0, 1),
    length=st.integers(1, 5),
    count=st.integers(1, 2500),
    more=st.integers(0, 1500),
    seed=st.integers(0, 9),
)
def test_hits_do_not_depend_on_the_number_of_frames(
    word: str, rate: float, length: int, count: int, more: int, seed: int
) -> None:
    fault = FRAME_FAULTS.parse({"kind": word, "rate": rate, "length_frames": length})
    assert isinstance(fault, FrameFault)
    np.testing.assert_array_equal(fault.hits(count, seed), fault.hits(count + more, seed)[:count])
    came = list(arriving_frames([fault], count, seed))
    assert came == sorted(came)


@pytest.mark.parametrize("length", [1, 3])
@pytest.mark.parametrize("rate", [0.02, 0.3])
def test_the_share_of_hits_follows_the_rate(rate: float, length: int) -> None:
    """A frame is hit unless none of the `length` frames up to it began a fault: 1 - (1 - rate)^length."""
    count = 200_000
    share = Drop(rate=rate, length_frames=length).hits(count, 3).mean()
    expected = 1 - (1 - rate) ** length
    # Runs of `length` frames are correlated: the variance is at most that many times the binomial one.
    assert share == pytest.approx(expected, abs=4 * np.sqrt(length * expected * (1 - expected) / count))


def test_hits_are_addressed_by_seed_and_name() -> None:
    one, other = Drop(rate=0.5), Drop(rate=0.5, id="cable")
    hits = [one.hits(500, 1), one.hits(500, 2), other.hits(500, 1)]
    for a in range(3):
        for b in range(a):
            assert 150 < (hits[a] ^ hits[b]).sum() < 350


# Sources


def test_arriving_frames_are_those_of_a_faultless_camera() -> None:
    whole = list(Rendering(scene()).pairs())
    source = faulty("[{kind: drop, rate: 0.2, frames: [0, 7]}, {kind: duplicate, frames: [9, 10]}]")
    found = list(source.pairs())
    assert len(found) == len(source) == len(source.arrivals) < 40
    assert all(same(pair, whole[taken]) for pair, taken in zip(found, source.arrivals, strict=True))
    for index, (frame, truth) in enumerate(found):
        assert truth is not None
        assert frame.index == truth.index == index
        assert frame.time == truth.time == source.arrivals[index] / 30
    assert [truth for _, truth in found] == list(source.truths())
    for index in (-1, len(source)):
        with pytest.raises(IndexError):
            source.frame(index)


def test_a_frame_alone_and_by_workers_is_the_one_in_sequence() -> None:
    source = faulty("[{kind: drop, rate: 0.3}, {kind: duplicate, rate: 0.3}]")
    inputs: tuple[irsim.Input, ...] = ("counts", "display")
    for input in inputs:
        found = list(source.pairs(input=input))
        for index in (20, 3):
            assert (source.frame(index, input).image == found[index][0].image).all()
    parallel = list(source.pairs(5, 25, jobs=2, input="display"))
    assert [frame.index for frame, _ in parallel] == list(range(5, 25))
    assert all(same(a, b) for a, b in zip(parallel, found[5:25], strict=True))


def test_rate_zero_and_switched_off_change_nothing() -> None:
    whole = list(Rendering(scene()).pairs())
    text = "camera.faults=[{kind: drop, rate: 0.4}, {kind: duplicate, id: echo, rate: 0.4}]"
    for source in (
        faulty("[{kind: drop, rate: 0}, {kind: duplicate, rate: 0}]"),
        Rendering(scene(text, "without=[drop, echo]")),
    ):
        assert len(source) == 40
        assert all(same(a, b) for a, b in zip(source.pairs(), whole, strict=True))
    half = Rendering(scene(text, "without=[echo]"))
    assert list(half.arrivals) == np.flatnonzero(~Drop(rate=0.4).hits(40, 5)).tolist()


def test_a_recording_keeps_times_and_renders_again(tmp_path: Path) -> None:
    source = faulty("[{kind: drop, rate: 0.3}, {kind: duplicate, rate: 0.2}]")
    path = record(source, tmp_path / "a.mcap")
    recording = open_recording(path)
    inputs: tuple[irsim.Input, ...] = ("counts", "display")
    for input in inputs:
        pairs = zip(recording.pairs(input=input), source.pairs(input=input), strict=True)
        assert all(same(a, b) and a[0].index == b[0].index for a, b in pairs)
    last = list(recording.frames())[-1]
    assert recording.info()["duration_s"] == pytest.approx(last.time - recording.frame(0).time + 1 / 30, abs=1e-8)

    again, start, stop = open_rendering(path)
    assert all(same(a, b) for a, b in zip(again.pairs(start, stop), recording.pairs(), strict=True))
    some, start, stop = open_rendering(path, frames=(4, 30))
    expected = list(source.pairs())[4:30]
    assert all(same(a, b) for a, b in zip(some.pairs(start, stop), expected, strict=True))
    more, start, stop = open_rendering(path, frames=(10, 90))
    assert stop - start == len(list(more.pairs(start, stop))) == 80


def test_frame_ranges_of_scenarios_count_lost_frames(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    rendering, start, stop = open_rendering(path, ["camera.faults=[{kind: drop, frames: [3, 11]}]"], frames=(10, 15))
    assert [frame.time * 30 for frame in rendering.frames(start=start, stop=stop)] == pytest.approx([10, 12, 13, 14])
    with pytest.raises(irsim.InputError, match="none arrives"):
        open_rendering(path, ["camera.faults=[{kind: drop, frames: [3]}]"], frames=(3, 4))


def test_trackers_run_on_the_frames_that_arrive(tmp_path: Path) -> None:
    source = faulty("[{kind: drop, frames: [0, 1, 12]}, {kind: duplicate, frames: [20]}]")
    track = irtrack.run("template", source)
    assert track.start == 0
    assert track.indices.tolist() == list(range(38))
    assert track.times.tolist() == [frame.time for frame in source.frames()]
    recorded = irtrack.run("template", record(source, tmp_path / "a.mcap"))
    assert [estimate.center for estimate in recorded.estimates] == [estimate.center for estimate in track.estimates]


@pytest.mark.parametrize(
    ("faults", "what"),
    [
        ("[{kind: drop, rate: 1}]", r"camera\.faults: no frame of 40 arrives"),
        ("[{kind: drop, rate: 1.2}]", r"camera\.faults\.drop\.rate"),
        ("[{kind: dorp}]", r"unknown fault kind 'dorp'.*did you mean 'drop'"),
        ("[{kind: drop}, {kind: drop}]", "the id 'drop' is used twice"),
    ],
)
def test_wrong_faults_are_refused(faults: str, what: str) -> None:
    with pytest.raises(irsim.InputError, match=what):
        faulty(faults)
