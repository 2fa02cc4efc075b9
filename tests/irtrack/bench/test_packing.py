"""Arrays packed as bytes: what comes back is what went in."""

from __future__ import annotations

import json
import zlib

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from irtrack.bench.records import pack, unpack

KINDS = st.one_of(arrays.integer_dtypes(), arrays.floating_dtypes(sizes=(32, 64)), arrays.boolean_dtypes())
SHAPES = arrays.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=5)


@given(st.dictionaries(st.text(max_size=8), KINDS.flatmap(lambda kind: arrays.arrays(kind, SHAPES)), max_size=4))
def test_every_array_comes_back_bit_for_bit(given: dict[str, np.ndarray]) -> None:
    found = unpack(pack(given))
    assert list(found) == list(given)
    for name, array in given.items():
        assert (found[name].dtype, found[name].shape) == (array.dtype, array.shape)
        assert found[name].tobytes() == array.tobytes()
        assert not found[name].flags.writeable


def test_a_view_in_any_order_and_words_come_back() -> None:
    grid = np.arange(12.0).reshape(3, 4)
    given = {"falling": grid[::-1, 1:], "turned": grid.T, "words": np.array(["tracking", "lost", ""])}
    found = unpack(pack(given))
    for name, array in given.items():
        np.testing.assert_array_equal(found[name], array)


def test_the_format_is_a_zlib_stream_with_a_json_header() -> None:
    """A reader in another language needs no more than this."""
    data = zlib.decompress(pack({"a": np.array([[1, 2]], "<i2"), "b": np.array([0.5], "<f8")}))
    end = 4 + int.from_bytes(data[:4], "little")
    assert json.loads(data[4:end]) == [["a", "<i2", [1, 2]], ["b", "<f8", [1]]]
    assert data[end:] == bytes([1, 0, 2, 0]) + np.float64(0.5).tobytes()


def test_a_flipped_bit_is_an_error_or_changes_nothing() -> None:
    """Some bits say in one of two ways what stands there; all others break the stream or its checksum."""
    array = np.sin(np.arange(40.0)).round(2)
    blob = pack({"a": array})
    broken = 0
    for at in range(8 * len(blob)):
        flipped = bytearray(blob)
        flipped[at // 8] ^= 1 << at % 8
        try:
            found = unpack(bytes(flipped))
        except ValueError:
            broken += 1
        else:
            np.testing.assert_array_equal(found["a"], array)
    assert broken > 0.9 * 8 * len(blob)
