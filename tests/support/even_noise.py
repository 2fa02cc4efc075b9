"""Noise of the camera on a uniform picture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from irsim.camera import NOISES
from irsim.camera.noise import add_temporal_noise
from irsim.camera.noise_base import FrameContext, Noise
from irsim.camera.response import Response
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.types import Floats

UNTOUCHED = 2**16 - 1
"""A count that no dead pixel of the tests has."""


def effect(noise: Noise, frame_context: FrameContext, response: Response, level: float) -> Floats:
    """Return the effect of a noise on a uniform picture, NETD, (rows, cols) float64."""
    signal = np.full(frame_context.shape, level, np.float32)
    gains = noise.gain_deviation(frame_context)
    if gains is not None:
        signal += (signal - np.float32(response.zero)) * gains
    add(noise, signal, frame_context, response)
    counts = np.full(frame_context.shape, UNTOUCHED, np.uint16)
    noise.replace_counts(counts, response, frame_context)
    done = np.where(counts == UNTOUCHED, signal.astype(np.float64), (counts - response.offset) * response.gain)
    return (done - level) / response.noise


def add(noise: Noise, signal: Floats, frame_context: FrameContext, response: Response) -> None:
    """Add the noise to a signal, (rows, cols) float32."""
    lines, steady = noise.line_noise(frame_context), noise.fixed_pattern(frame_context)
    noise.draw_electrons(signal, response, frame_context, 0.0)
    add_temporal_noise(signal, noise.temporal_sigma(frame_context) * response.noise, frame_context)
    noise.add(signal, response, frame_context)
    for pattern, weight in noise.correlated_noise(frame_context):
        signal += np.float32(weight * response.noise) * pattern
    signal += np.float32(response.noise) * (0 if steady is None else steady)
    signal += np.float32(response.noise) * (0 if lines is None else np.add.outer(*lines))


def pattern(noise: Noise, frame_context: FrameContext) -> Floats:
    """Return the noise that does not depend on the light, NETD, (rows, cols) float32."""
    sum_of_all = np.zeros(frame_context.shape, np.float32)
    add(
        noise,
        sum_of_all,
        frame_context,
        replace(ElectronSensor().response(SensorSettings("mwir", 14, 40.0, (220.0, 400.0))), noise=1.0),
    )
    return sum_of_all


def rendered(seed: int, shape: tuple[int, int, int], *noises: dict[str, Any]) -> Floats:
    """Return noise terms on a uniform picture, (frames, rows, columns); the NETD is 10. Each has its own seed, as white
    noise of all terms has one address."""
    frames = np.full(shape, 1000.0, np.float32)
    response = ElectronSensor().response(SensorSettings("mwir", 14, 40.0, (220.0, 400.0)))
    for number, given in enumerate(noises):
        noise = NOISES.parse({"id": f"n{number}", **given})
        assert isinstance(noise, Noise)
        for k, frame in enumerate(frames):
            frame += 10 * effect(noise, FrameContext(k, shape[1:], 30.0, seed + 1_000_003 * number), response, 0.0)
    return frames
