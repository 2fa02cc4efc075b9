"""Name and configuration of a tracker, as results are keyed."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

import numpy as np
import pytest

import irtrack
from irtrack.errors import InputError
from irtrack.registry.identity import tracker_config, tracker_name


@dataclass(frozen=True)
class Nest:
    inner: np.ndarray


def test_configurations_that_differ_are_told_apart() -> None:
    class Of:
        def __init__(self, value: object) -> None:
            self.value = value

    def told(value: object) -> str:
        return json.dumps(tracker_config(Of(value))["parameters"]["value"], allow_nan=False)  # type: ignore[arg-type]  # whatever has parameters will do

    long = np.zeros(5000)
    other = long.copy()
    other[2500] = 1  # where numpy's repr leaves out
    values = [long, other, long.astype(np.float32), long.reshape(50, 100), Nest(long), Nest(other), math.inf, -math.inf]
    assert len({told(value) for value in values}) == len(values)
    assert told(long) == told(np.zeros(5000))
    assert told({"b", "a"}) == told({"a", "b"})
    assert told(np.float32(0.5)) == told(0.5)
    for vague in (object(), [object()], np.array([object()])):
        with pytest.raises(InputError, match=r"value: object does not say what it is.*allowed"):
            told(vague)


def test_name_and_configuration_of_a_tracker() -> None:
    known = irtrack.make("kalman")
    assert tracker_name(known) == "kalman"
    again = irtrack.make("kalman", tracker_config(known)["parameters"])
    assert again == known

    class Plain:
        def __init__(self) -> None:
            self.gain = 2
            self.model = object

    assert tracker_config(Plain()) == {  # type: ignore[arg-type]  # whatever has parameters will do
        "tracker": tracker_name(Plain()),  # type: ignore[arg-type]  # whatever has parameters will do
        "parameters": {"gain": 2, "model": repr(object)},
    }
