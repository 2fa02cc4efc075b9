"""Values that are pickled by their fields come back whole."""

from __future__ import annotations

import copy
import pickle
from dataclasses import dataclass, fields

import numpy as np
import pytest

from irsim.types import Box, Frame, TargetTruth, Truth

TARGET = TargetTruth("jet", (1.0, 2.5), Box(1.0, 2.0, 3.0, 4.0), occluders=("oak",), visible=0.25, scr=None)


class Bird(Box):
    """A kind of box."""


@dataclass(frozen=True)
class Ringed(Box):
    """One with a field of its own."""

    ring: str = ""


@pytest.mark.parametrize(
    "value",
    [
        *(Box(1.0, 2.0, 3.0, 4.0), Bird(0.0, 0.0, 1.0, 1.0), Ringed(0.0, 0.0, 1.0, 1.0, "red")),
        *(TARGET, Truth(3, 0.1, (TARGET,))),
    ],
)
def test_a_value_comes_back_equal_and_of_its_kind(value: object) -> None:
    for back in (pickle.loads(pickle.dumps(value)), copy.deepcopy(value), copy.copy(value)):
        assert back == value
        assert type(back) is type(value)


def test_a_frame_comes_back_with_its_picture() -> None:
    frame = Frame(np.arange(6, dtype=np.uint16).reshape(2, 3), 7, 0.14, 14)
    back = pickle.loads(pickle.dumps(frame))
    assert np.array_equal(back.image, frame.image)
    assert back.image.dtype == frame.image.dtype
    for field in fields(Frame)[1:]:
        assert getattr(back, field.name) == getattr(frame, field.name)
