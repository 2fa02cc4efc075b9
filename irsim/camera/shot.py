"""The noise of counting electrons."""

from __future__ import annotations

from typing import ClassVar

import cv2
import numpy as np

from irsim._native import COMPILED, kernels
from irsim.camera.noise_base import FrameContext, Noise
from irsim.camera.response import Response
from irsim.camera.scratch import scratch
from irsim.camera.temporal_sigma import grain_address
from irsim.camera.variance import Variance
from irsim.rng import bit_generator, kernel_arguments, normals
from irsim.types import Floats

EXACT_E = 200.0
"""Below so many electrons the Poisson law is drawn as it is; above, its skewness is under 0.07."""


class Shot(Noise):
    """Shot noise of the electrons, and the read noise with it. For a detector of kind electrons.

    Variance S + read noise^2 in electrons: a Poisson number below 200 electrons, above them its normal
    limit. All that is normal is one draw, with what other noises have new in each pixel. What a full well holds does
    not vary.
    """

    stationary: ClassVar[bool] = True

    @property
    def needs_electrons(self) -> bool:
        return True

    def count(self, signal: Floats, response: Response, frame_context: FrameContext, sigma: float) -> None:
        variance, well = response.read**2 + sigma**2, response.well
        if COMPILED:
            found = kernels.add_shot(*kernel_arguments(*grain_address(frame_context)), signal, variance, well, EXACT_E)
            if not found:
                return
            pairs = np.frombuffer(found)
            dark, held = pairs[::2].astype(np.intp), pairs[1::2].astype(np.float32)
        else:
            dark = np.flatnonzero(signal < EXACT_E)
            held = signal.reshape(-1)[dark]
            drawn = normals(
                frame_context.shape, *grain_address(frame_context), out=scratch(frame_context.shape, "drawn")
            )
            shaken = np.where((signal >= well) | (signal < EXACT_E), np.float32(0), signal)
            cv2.accumulateProduct(np.sqrt(shaken + np.float32(variance)), drawn, signal)
        if dark.size:
            words = bit_generator(frame_context.seed, "noise", self.name, "uniform", frame_context.index).random_raw(
                signal.size
            )
            uniform = ((words[dark] >> np.uint64(11)) + 0.5) * 2.0**-53
            signal.reshape(-1)[dark] += poisson(np.maximum(held, 0), uniform).astype(np.float32) - held

    def share(self, frame_context: FrameContext, fixed: bool) -> Variance:
        return Variance(counted=1.0)


def poisson(means: Floats, uniform: Floats) -> Floats:
    """Poisson numbers, (n,) float64, of `means` (0 to a few hundred) at quantiles `uniform` within 0..1.

    The smallest k whose distribution function reaches the quantile, by summing the probabilities
    m^k e^-m / k! from 0 on.
    """
    found = np.zeros(means.shape)
    left = np.arange(means.size)
    term = np.exp(-np.asarray(means, np.float64))
    mean, wanted, total = np.asarray(means, np.float64), np.asarray(uniform, np.float64), term.copy()
    k = 0
    while left.size:
        going = (total < wanted) & ((k < mean) | (term > 0))
        left, mean, wanted, term, total = left[going], mean[going], wanted[going], term[going], total[going]
        k += 1
        found[left] = k
        term = term * mean / k
        total = total + term
    return found
