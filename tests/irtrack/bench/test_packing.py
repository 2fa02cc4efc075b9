"""Arrays packed as bytes and unpacked again."""

from __future__ import annotations

import json
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from irtrack.bench import records
from irtrack.bench.records import pack, unpack

KINDS = st.one_of(arrays.integer_dtypes(), arrays.floating_dtypes(sizes=(32, 64)), arrays.boolean_dtypes())
SHAPES = arrays.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=5)


@settings(max_examples=30, deadline=None)
@given(st.dictionaries(st.text(max_size=8), KINDS.flatmap(lambda kind: arrays.arrays(kind, SHAPES)), max_size=4))
def test_every_array_comes_back_bit_for_bit(given: dict[str, np.ndarray]) -> None:
    found = unpack(pack(given))
    assert list(found) == list(given)
    for name, array in given.items():
        assert (found[name].dtype, found[name].shape) == (array.dtype, array.shape)
        assert found[name].tobytes() == array.tobytes()
        assert not found[name].flags.writeable


def test_the_format_is_a_zlib_stream_with_a_json_header() -> None:
    """A reader in another language needs no more than this."""
    data = zlib.decompress(pack({"a": np.array([[1, 2]], "<i2"), "b": np.array([0.5], "<f8")}))
    end = 4 + int.from_bytes(data[:4], "little")
    assert json.loads(data[4:end]) == [["a", "<i2", [1, 2]], ["b", "<f8", [1]]]
    assert data[end:] == bytes([1, 0, 2, 0]) + np.float64(0.5).tobytes()


def test_a_small_trace_does_not_unpack_to_a_large_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(records, "MOST_BYTES", 1 << 20)
    with pytest.raises(ValueError, match="more than 1 MB"):
        unpack(zlib.compress(bytes(2 << 20)))
