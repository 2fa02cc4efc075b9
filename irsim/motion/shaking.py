"""Random shaking as a sum of sinusoids, known at any frame without the frames before."""

from __future__ import annotations

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.types import Floats

AT_ONCE = 1024
"""Frames worked out together: of a million at once the sinusoids would fill gigabytes."""


def shaking(rms_px: float, angular: Floats, phases: Floats, frames: Floats, context: SceneContext) -> Floats:
    """(n, 3) rad at frame numbers (n,): azimuth and elevation, each of that root mean square at zoom 1; no roll.

    angular (2, waves) rad/s and phases (2, waves), rad, of sinusoids that have equal power. Its spectrum is how the
    frequencies are spread: M. Shinozuka and C.-M. Jan, J. Sound Vib. 25, 111 (1972).
    """
    seconds = np.asarray(frames, dtype=np.float64)[:, None, None] / context.rate_hz
    amplitude = rms_px * context.geometry.ifov_rad * np.sqrt(2 / angular.shape[-1])
    turned = np.zeros((len(seconds), 3))
    for first in range(0, len(seconds), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        turned[some, :2] = amplitude * np.cos(angular * seconds[some] + phases).sum(axis=-1)
    return turned
