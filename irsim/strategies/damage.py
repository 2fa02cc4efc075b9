"""Strategies for damaged recordings: whatever a disk, a cable or an editor may do to a file's bytes."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import strategies as st


@st.composite
def damaged_recordings(draw: st.DrawFn, whole: bytes) -> bytes:
    """A recording's bytes with one to three things done to them: an error for whoever reads them, or no difference."""
    data = whole
    for _ in range(draw(st.integers(1, 3))):
        data = draw(st.sampled_from(_DAMAGES))(draw, data)
    return data


def _span(draw: st.DrawFn, data: bytes) -> tuple[int, int]:
    """(first, past the last) of some bytes, no more than 4096."""
    first = draw(st.integers(0, max(len(data) - 1, 0)))
    return first, min(first + draw(st.integers(1, 4096)), len(data))


def _flipped(draw: st.DrawFn, data: bytes) -> bytes:
    first, _ = _span(draw, data)
    mask = draw(st.integers(1, 255))
    return data[:first] + bytes(byte ^ mask for byte in data[first : first + 1]) + data[first + 1 :]


def _cut(draw: st.DrawFn, data: bytes) -> bytes:
    return data[: _span(draw, data)[0]]


def _beheaded(draw: st.DrawFn, data: bytes) -> bytes:
    return data[_span(draw, data)[0] :]


def _without(draw: st.DrawFn, data: bytes) -> bytes:
    first, stop = _span(draw, data)
    return data[:first] + data[stop:]


def _blank(draw: st.DrawFn, data: bytes) -> bytes:
    first, stop = _span(draw, data)
    return data[:first] + draw(st.sampled_from([b"\0", b"\xff"])) * (stop - first) + data[stop:]


def _twice(draw: st.DrawFn, data: bytes) -> bytes:
    first, stop = _span(draw, data)
    return data[:stop] + data[first:stop] + data[stop:]


def _foreign(draw: st.DrawFn, data: bytes) -> bytes:
    first, _ = _span(draw, data)
    return data[:first] + draw(st.binary(min_size=1, max_size=64)) + data[first:]


def _number(draw: st.DrawFn, data: bytes) -> bytes:
    """A length or an offset, wherever one stands, that says too much."""
    first, _ = _span(draw, data)
    number = draw(st.sampled_from([0, 1, 2**31, 2**32 - 1, 2**63 - 1, 2**64 - 1])).to_bytes(8, "little")
    return data[:first] + number + data[first + 8 :]


_DAMAGES: tuple[Callable[[st.DrawFn, bytes], bytes], ...] = (
    _flipped,
    _cut,
    _beheaded,
    _without,
    _blank,
    _twice,
    _foreign,
    _number,
)
