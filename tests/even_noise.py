"""The detector's own noise on an even picture, for the tests of what is measured."""

from __future__ import annotations

from typing import Any

import numpy as np

from irsim.detector import NOISES, Moment, Noise
from irsim.detector.response import Electrons, Setting
from irsim.types import Floats


def rendered(seed: int, shape: tuple[int, int, int], *noises: dict[str, Any]) -> Floats:
    """(T, rows, columns) of the detector's own noise terms on an even picture; NETD is 10."""
    frames = np.full(shape, 1000.0, np.float32)
    response = Electrons().response(Setting("mwir", 14, 40.0, (220.0, 400.0)))
    for number, given in enumerate(noises):
        noise = NOISES.parse({"id": f"n{number}", **given})
        assert isinstance(noise, Noise)
        for k, frame in enumerate(frames):
            zero = np.zeros(shape[1:], np.float32)
            moment = Moment(k, shape[1:], 30.0, seed)
            noise.add(zero, response, moment)
            frame += zero * np.float32(10 / response.noise)
            steady = noise.steady(moment)
            if steady is not None:
                frame += 10 * steady
    return frames
