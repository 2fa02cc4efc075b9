"""Response of a focal plane to light, its quantisation to counts, and its response time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from irsim._native import COMPILED, kernels
from irsim.camera.buffers import Int16Image
from irsim.physics.radiometry import Scale
from irsim.types import Counts, Curve, Floats

MAX_COUNTS = 2**16 - 1
"""The highest count of 16 bits."""

MAX_ADDED = kernels.MOST_ADDED if COMPILED else 0
"""Largest number of images that `kernels.counts_of` adds to a signal in the pass that quantises it."""

LEAST_WEIGHT = 1e-3
"""Total weight of the oldest frames below which they are replaced by one frame."""

Lines = tuple[Floats, Floats]
"""A number for each row, (rows,) float32, and for each column, (cols,), whose sum is added to each pixel."""


@dataclass(frozen=True)
class Response(Scale):
    """Signal S = `linear` L + `root` sqrt(L) + `zero` of in-band radiance L, W/m²/sr (a `Scale`), and its quantisation.

    well       signal at which a pixel saturates
    noise      signal of one NETD; netd_mk  the NETD, mK
    gain       signal per count; offset  the count of signal 0; full  the highest count
    electrons  True if the signal is in electrons, False if it is in counts, with gain 1
    read       read noise, signal
    """

    well: float
    noise: float
    netd_mk: float
    gain: float
    offset: float
    full: int
    electrons: bool
    read: float

    @property
    def top(self) -> float:
        """The highest signal that counts represent: of a full well or of the highest count."""
        return min(self.well, (self.full - self.offset) * self.gain)

    @property
    def bottom(self) -> float:
        """The lowest signal that counts represent: that of count 0."""
        return -self.offset * self.gain

    @property
    def curve(self) -> Curve:
        """Coefficients (linear, root, zero) of the curve from radiance to counts, without saturation."""
        return self.linear / self.gain, self.root / self.gain, self.offset + self.zero / self.gain

    def signal(
        self, light: Floats, out: Floats | None = None, gain: Int16Image | None = None, most: float = math.inf
    ) -> Floats:
        """Return the noiseless signal of in-band radiance, (rows, cols) float32, W/m²/sr.

        out    memory for the result, which may be the light itself
        gain   (rows, cols) relative deviation of each pixel's gain
        most   the signal at which pixels saturate
        """
        signal = np.empty_like(light) if out is None else out
        if COMPILED and light.dtype == np.float32 and light.flags.c_contiguous:
            deviation = (None, 0.0) if gain is None else gain
            kernels.signal_of(light, signal, self.linear, self.root, self.zero, most, *deviation)
            return signal
        if self.root:
            if light.min() < 0:  # negative by rounding only
                light = np.maximum(light, np.float32(0))
            cv2.addWeighted(light, self.linear, cv2.sqrt(light), self.root, self.zero, dst=signal)
        else:
            cv2.addWeighted(light, self.linear, light, 0, self.zero, dst=signal)
        if gain is not None:  # the dark current does not depend on the gain
            cv2.accumulateProduct(signal - np.float32(self.zero), gain.to_float(), signal)
        if most < math.inf:
            np.minimum(signal, np.float32(most), out=signal)
        return signal

    def at(self, light: float) -> float:
        """Return the noiseless signal of an in-band radiance, W/m²/sr, 0 or more."""
        return self.linear * light + self.root * math.sqrt(light) + self.zero

    def light_step(self, light: float, step: float) -> float:
        """Return the additional radiance, W/m²/sr, that raises the signal at radiance `light` by `step`, 0 or more.

        The equation a x + b sqrt(x) = c is solved by sqrt(x) = 2 c / (b + sqrt(b² + 4 a c)). The slope of the curve
        would not do, as it is infinite at radiance 0.
        """
        if step == 0:
            return 0.0
        signal = self.at(light) - self.zero + step
        after = 2 * signal / (self.root + math.sqrt(self.root**2 + 4 * self.linear * signal))
        return step / (self.linear + self.root / (after + math.sqrt(light)))  # x - light without cancellation

    def counts(
        self,
        signal: Floats,
        out: Counts | None = None,
        added: Sequence[Int16Image] = (),
        lines: Lines | None = None,
    ) -> Counts:
        """Return the counts of a signal plus images and lines. The signal is overwritten.

        Counts are rounded to the nearest (halves to even) and clipped to the bit depth: they saturate and never wrap
        around. `out` is written past the processor's caches, as it is read later.
        """
        counts = np.empty(signal.shape, np.uint16) if out is None else out
        compiled = COMPILED and signal.dtype == np.float32 and signal.flags.c_contiguous
        together = added[-MAX_ADDED:] if compiled else ()
        for values, unit in added[: len(added) - len(together)]:
            cv2.scaleAdd(values.astype(np.float32), unit, signal, dst=signal)
        if compiled:
            flat = [part for pair in together for part in pair]
            down, across = lines or (None, None)
            kernels.counts_of(
                signal, counts, 1 / self.gain, self.offset, self.full, out is not None, down, across, *flat
            )
            return counts
        if lines is not None:
            signal += np.add.outer(*lines)
        most = np.float32(MAX_COUNTS * self.gain)
        if cv2.norm(signal, cv2.NORM_INF) > most:  # the conversion to integers would wrap
            np.clip(signal, -most, most, out=signal)
        cv2.addWeighted(signal, 1 / self.gain, signal, 0, self.offset, dst=counts, dtype=cv2.CV_16U)
        if self.full < MAX_COUNTS:
            cv2.threshold(counts, self.full, 0, cv2.THRESH_TRUNC, dst=counts)
        return counts


class ResponseTime:
    """First-order low-pass of light by the thermal time constant of a microbolometer.

    y[k] = a y[k-1] + (1 - a) x[k] with a = exp(-1 / (rate time constant)): the light of a frame is constant over its
    period and is read at its end. The sum begins `len(weights)` - 1 frames before, in the steady state of that frame;
    before frame 0 the light is that of frame 0. Cached frames change no result.
    """

    def __init__(self, time_constant_s: float, rate_hz: float) -> None:
        self.weights = response_weights(time_constant_s, rate_hz)
        self._kept: dict[int, Floats] = {}

    @property
    def has_memory(self) -> bool:
        """True where a frame depends on the light of earlier frames."""
        return len(self.weights) > 1

    def light(self, index: int, scene: Callable[[int], Floats]) -> Floats:
        """Return the low-pass filtered light of frame `index`, (rows, cols) float32; `scene` gives that of any
        frame."""
        if not self.has_memory:
            return scene(index)
        wanted = [max(index - back, 0) for back in range(len(self.weights))]
        known = self._kept  # read once: another thread may replace it
        lights = self._kept = {frame: known[frame] if frame in known else scene(frame) for frame in wanted}
        total = np.zeros_like(lights[index])
        for frame, weight in zip(wanted, self.weights, strict=True):
            cv2.scaleAdd(lights[frame], float(weight), total, dst=total)
        return total


def response_weights(time_constant_s: float, rate_hz: float) -> Floats:
    """Return the weights, sum 1, of the light of the present frame, the frame before, and so on."""
    kept = math.exp(-1 / (rate_hz * time_constant_s)) if time_constant_s else 0.0
    if kept <= LEAST_WEIGHT:
        return np.ones(1)
    frames = math.ceil(math.log(LEAST_WEIGHT) / math.log(kept))
    return np.append((1 - kept) * kept ** np.arange(frames), kept**frames)
