"""Frames kept from one cell to the next: read once where no seed changes them, and the same rows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from bench_fakes import Strip, Vandal, Walker
from bench_rows import rows
from irtrack.bench.reel import MOST_BYTES, Reels
from recording_fakes import Noise

import irsim
from irsim.types import Frame, Input, Truth
from irtrack.bench import Entry, run_bench
from irtrack.metrics import Reference


@dataclass(frozen=True, eq=False)
class Counted(Strip):
    """Notes each time that its frames are read."""

    read: list[tuple[Input, int]] = field(default_factory=list)

    def pairs(
        self, start: int = 0, stop: int | None = None, jobs: int = 1, input: Input = "counts"
    ) -> Iterator[tuple[Frame, Truth | None]]:
        self.read.append((input, start))
        return super().pairs(start, stop, jobs, input)


@dataclass(frozen=True, eq=False)
class Seeded(Counted):
    """One whose seed would change its frames."""

    seed: int | None = 0

    def with_seed(self, seed: int) -> Seeded:
        return replace(self, seed=seed, hash=str(seed))


def test_the_frames_of_a_source_are_read_once_for_all_its_tracker_seeds(tmp_path: Path) -> None:
    source, late = Counted(), Counted("late", "1", visible=(0.0,) * 5 + (1.0,) * 15)
    trackers = [Entry("vandal", Vandal()), Entry("w", Walker(jitter=1.0))]
    with run_bench([source, late], trackers, seeds=4, results=tmp_path / "r.db") as results:
        found = rows(results)
    assert source.read == late.read == [("display", 0)]
    for seed in range(4):  # the same cells, each in a bench of its own
        with run_bench([source, late], trackers, seeds=[seed], results=tmp_path / "alone.db") as results:
            alone = rows(results)
    assert found == alone
    assert {figures["frames"] for *_, figures in found.values() if figures} == {19, 14}


def test_what_a_seed_changes_is_rendered_anew(tmp_path: Path) -> None:
    source = Seeded()
    run_bench([source], [Entry("w", Walker())], seeds=3, results=tmp_path / "r.db").close()
    assert source.read == [("display", 0)] * 3


def test_a_long_source_is_streamed_from_its_start_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("irtrack.bench.reel.MOST_BYTES", 20 * 64 * 48 - 1)
    source = Counted(visible=(0.0,) * 5 + (1.0,) * 15)
    with run_bench([source], [Entry("w", Walker(jitter=1.0))], seeds=2, results=tmp_path / "streamed.db") as results:
        streamed = rows(results)
    assert source.read == [("display", 5)] * 2
    monkeypatch.undo()
    with run_bench([source], [Entry("w", Walker(jitter=1.0))], seeds=2, results=tmp_path / "kept.db") as results:
        assert rows(results) == streamed
    assert source.read[2:] == [("display", 0)]


def test_one_reel_is_kept_by_hash_and_input() -> None:
    reels, one, other = Reels(), Counted(), Counted(hash="1")
    first = reels.of(one, "display")
    assert first is reels.of(replace(one), "display")  # a pickled copy, as workers get it
    for changed in (reels.of(one, "counts"), reels.of(other, "counts"), reels.of(one, "display")):
        assert changed is not None
        assert changed is not first
    assert one.read == [("display", 0), ("counts", 0), ("display", 0)]


def test_no_more_is_kept_than_is_said() -> None:
    most = MOST_BYTES // (64 * 48)
    assert Reels().of(Strip(visible=(1.0,) * (most + 1)), "display") is None
    assert Reels().of(Strip(visible=(1.0,) * (most // 2 + 1)), "counts") is None
    assert Reels().of(Noise(), "counts") is None  # it has a seed


def test_a_reel_of_a_recording_is_what_the_recording_shows(tmp_path: Path) -> None:
    irsim.record(Noise(), tmp_path / "r.mcap")
    recording = irsim.open_source(tmp_path / "r.mcap")
    reel = Reels().of(recording, "display")
    assert reel is not None
    for (frame, truth), alone, told in zip(reel.pairs, recording.frames("display"), recording.truths(), strict=True):
        np.testing.assert_array_equal(frame.image, alone.image)
        assert (frame.index, frame.time, frame.bits, truth) == (alone.index, alone.time, alone.bits, told)
    expected = Reference.of(recording.truths(2), "jet")
    found = reel.reference("jet", 2)
    assert found is reel.reference("jet", 2)
    assert found is not reel.reference("jet", 1)
    for name in ("indices", "centers", "sizes", "visible", "accuracy", "marks"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
