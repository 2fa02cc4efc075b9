"""How much a pixel's noise varies, by what it was lit with."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, TypeVar

from irsim.camera.response import Response
from irsim.types import Floats

Signal = TypeVar("Signal", float, Floats)


class Variance(NamedTuple):
    """Of a noise, over all draws of the scene's seed.

    own      from pixel to pixel, whatever the light, squared units of NETD
    shared   what all pixels of a frame have alike, squared units of NETD
    gain     that of pixels' gains: of the squared signal of light, 1
    counted  how often electrons are counted and read: of the signal and the squared read noise, in electrons, 1
    """

    own: float = 0.0
    shared: float = 0.0
    gain: float = 0.0
    counted: float = 0.0

    @classmethod
    def together(cls, noises: Iterable[Variance]) -> Variance:
        """That of independent noises."""
        own = shared = gain = counted = 0.0
        for noise in noises:
            own, shared, gain, counted = own + noise[0], shared + noise[1], gain + noise[2], counted + noise[3]
        return cls(own, shared, gain, counted)

    def within(self, signal: Signal, response: Response) -> Signal:
        """From pixel to pixel of a frame, at a noiseless signal, in squared units of it: all but what they share."""
        light, lit = signal - response.zero, (signal + abs(signal)) / 2
        return self.own * response.noise**2 + self.gain * light**2 + self.counted * (lit + response.read**2)

    def whole(self, signal: Signal, response: Response) -> Signal:
        """Of a pixel, at a noiseless signal, in squared units of it."""
        return self.within(signal, response) + self.shared * response.noise**2
