"""The noise that a recorded frame has itself, told from what is seen in the frame."""

from __future__ import annotations

import cv2
import numpy as np

from irsim.types import Floats, Image

MEDIAN_OF_NOISE = 0.583
"""The median of what normal noise of deviation 1 leaves, without its sign, above the median of the 3 x 3 about it:
of a million drawn pixels, 0.582 to 0.584. Below the 0.674 of the noise itself, as a pixel in nine is that median."""
MOST_SIGMAS = 3.5
"""What stands out farther is no noise. Of normal noise that is 1 in 2000. About twice the root of 3, so that what is
folded into half of it (`folded`), evenly spread, has the noise's deviation."""
ENOUGH = 0.1
"""The share of a frame's pixels that say how strong its noise is. Clipped ones, and black bars about a picture, have
none and are left out; where nearly all is clipped, the rest is things and not noise."""


def own_noise(counts: Image, full: int) -> Floats:
    """What of each pixel's count is noise, (rows, cols) float32 counts; full: the highest count there is.

    It is what the pixel differs by from the median of the 3 x 3 about it: of white noise 97 %, little of what optics
    have blurred. Small objects and edges stand out from that median, too, but farther than noise does, and are folded.
    """
    grain = counts.astype(np.float32) - cv2.medianBlur(counts, 3)
    unclipped = (counts > 0) & (counts < full)
    most = MOST_SIGMAS * _sigma(grain[unclipped] if unclipped.mean() > ENOUGH else grain.reshape(-1))
    farther = np.abs(grain) > most
    grain[farther] = folded(grain[farther], most)
    return grain


def folded(grain: Floats, most: float) -> Floats:
    """The same up to +-`most`; beyond, to and fro between +-`most` / 2.

    Nowhere does it jump or get flat. So a pixel of something bright keeps its own noise about another value, which may
    have been turned over; cut off at `most`, it would have none, and with another's in its place it would blink where
    it stands out by about `most`.
    """
    off = np.abs(grain)
    back = most - np.abs(off - most)
    to_and_fro = np.abs(np.mod(off - 1.5 * most, 2 * most) - most) - 0.5 * most
    return np.copysign(1, grain) * np.where(off < 1.5 * most, back, to_and_fro)


def _sigma(grain: Floats) -> float:
    """Deviation of the noise, counts, by the median of what (n,) pixels stand out by: small things move it little."""
    # Noise may be finer than whole counts: those of n lie evenly from n - 1/2 to n + 1/2. So it is above 0 always.
    below = np.cumsum(np.bincount(np.abs(grain).astype(np.intp))) / grain.size
    median = np.interp(0.5, np.append(0.0, below), np.append(0.0, np.arange(below.size) + 0.5))
    return float(median) / MEDIAN_OF_NOISE
