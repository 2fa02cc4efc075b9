"""The detector's own noise on an even picture, for the tests of what is measured."""

from __future__ import annotations

from typing import Any

import numpy as np

from irsim.detector import NOISES, Moment, Noise
from irsim.detector.response import Electrons, Response, Setting
from irsim.types import Floats

UNTOUCHED = 2**16 - 1
"""A count that no dead pixel of the tests has."""


def effect(noise: Noise, moment: Moment, response: Response, level: float) -> Floats:
    """What a noise makes of an even picture, less that picture, in units of NETD, (rows, cols) float64."""
    signal = np.full(moment.shape, level, np.float32)
    gains = noise.gains(moment)
    if gains is not None:
        signal += (signal - np.float32(response.zero)) * gains
    noise.add(signal, response, moment)
    pattern, weight = noise.lasting(moment) or (np.float32(0), 1.0)
    steady = noise.steady(moment)
    signal += np.float32(response.noise) * (weight * pattern + (0 if steady is None else steady))
    counts = np.full(moment.shape, UNTOUCHED, np.uint16)
    noise.replace(counts, response, moment)
    done = np.where(counts == UNTOUCHED, signal.astype(np.float64), (counts - response.offset) * response.gain)
    return (done - level) / response.noise


def rendered(seed: int, shape: tuple[int, int, int], *noises: dict[str, Any]) -> Floats:
    """(T, rows, columns) of the detector's own noise terms on an even picture; NETD is 10."""
    frames = np.full(shape, 1000.0, np.float32)
    response = Electrons().response(Setting("mwir", 14, 40.0, (220.0, 400.0)))
    for number, given in enumerate(noises):
        noise = NOISES.parse({"id": f"n{number}", **given})
        assert isinstance(noise, Noise)
        for k, frame in enumerate(frames):
            frame += 10 * effect(noise, Moment(k, shape[1:], 30.0, seed), response, 0.0)
    return frames
