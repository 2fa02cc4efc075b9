"""Several trackers over one source: each sees a block of frames in a row."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest
from bench_fakes import Strip

from irsim.types import Frame, Input
from irtrack.replay import replay


@pytest.mark.parametrize(
    ("bound", "value", "lengths"),
    [
        ("BLOCK_FRAMES", 8, [8, 8, 4]),
        ("BLOCK_BYTES", 6 * 48 * 64, [6, 6, 6, 2]),
        ("BLOCK_BYTES", 7 * 48 * 64 - 1, [6, 6, 6, 2]),
        ("BLOCK_BYTES", 1, [1] * 20),  # a frame larger than the bound is shown all the same
    ],
)
def test_each_tracker_sees_a_block_of_frames_in_a_row(
    monkeypatch: pytest.MonkeyPatch, bound: str, value: int, lengths: list[int]
) -> None:
    """Nothing is rendered between two steps of a block, so no tracker's steps are slower for being the first."""
    monkeypatch.setattr(replay, bound, value)
    done: list[tuple[str, int]] = []

    class Noting(Strip):
        def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
            for frame in super().frames(input, start, stop):
                done.append(("rendered", frame.index))
                yield frame

    viewers = [lambda frame, name=name: done.append((name, frame.index)) for name in "ab"]
    truths = replay.replay(Noting(), viewers, "display", 0)
    assert [truth.index for truth in truths] == list(range(20))
    ends = list(itertools.accumulate(lengths))
    blocks = [range(end - length, end) for end, length in zip(ends, lengths, strict=True)]
    assert done == [(who, k) for block in blocks for who in ("rendered", "a", "b") for k in block]
