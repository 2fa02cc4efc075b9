"""A picture that is brighter at one side than at the other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from irsim.types import Floats

_STEEP = 4.0
"""Sigmas of the noise by which a picture rises from side to side where it is worth a word."""


def gradient_notes(picture: Floats, noise: float) -> Iterator[str]:
    """That a picture (rows, columns) without texture rises, as a clear sky does: by a straight line through the means
    of its rows and columns."""
    for axis, ways in ((1, ("top to bottom", "bottom to top")), (0, ("left to right", "right to left"))):
        means = picture.mean(axis=axis)
        means -= means.mean()
        rise = float(np.polyfit(np.linspace(-0.5, 0.5, len(means)), means, 1)[0])
        if abs(rise) > _STEEP * noise:
            yield (
                f"the picture rises by {abs(rise):.3g} counts from {ways[rise < 0]}, which is no texture: the "
                "background is written without it; a sky has it of horizon_k and zenith_k"
            )
