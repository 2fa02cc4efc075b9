"""Frames of a recording are read once for all tracker seeds, and the outcomes stay the same."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from bench_fakes import Strip, Vandal, Walker
from bench_rows import rows

from irsim.types import Frame, Input, Truth
from irtrack.bench import Entry, run_bench


@dataclass(frozen=True, eq=False)
class Counted(Strip):
    """Notes each time that its frames are read."""

    read: list[tuple[Input, int]] = field(default_factory=list)

    def pairs(
        self, start: int = 0, stop: int | None = None, jobs: int = 1, input: Input = "counts"
    ) -> Iterator[tuple[Frame, Truth | None]]:
        self.read.append((input, start))
        return super().pairs(start, stop, jobs, input)


def test_a_recording_is_read_once_for_all_seeds(tmp_path: Path) -> None:
    source, late = Counted(), Counted("late", "1", visible=(0.0,) * 5 + (1.0,) * 15)
    trackers = [Entry("vandal", Vandal()), Entry("w", Walker(jitter=1.0))]
    with run_bench([source, late], trackers, seeds=4, results=tmp_path / "r.db") as results:
        found = rows(results)
    assert source.read == late.read == [("display", 0)]
    for seed in range(4):  # the same runs, each in a bench of its own
        with run_bench([source, late], trackers, seeds=[seed], results=tmp_path / "alone.db") as results:
            alone = rows(results)
    assert found == alone
    assert {figures["frames"] for *_, figures in found.values() if figures} == {19, 14}
