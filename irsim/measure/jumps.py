"""Where the whole picture of a recording becomes another: a shutter before the lens, a splash screen, a cut."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import cv2
import numpy as np

from irsim.measure.region import Values
from irsim.types import Floats

_CELL = 8
"""Side of the cells, px, whose means are compared: noise that is new in each pixel is an eighth in them."""
_BEYOND = 12.0
"""Times the usual change from frame to frame beyond which a picture is another: 8 standard deviations where the change
is normal. The largest of three real sensors, in 100 frames each, are 1.6, 1.9 and 8.6 times the usual one, those of the
scenarios shipped 1.1 to 3.5."""
_FEW = 0.1
"""Share of the changes that may be as large: where more are, it is how the scene goes on."""
_LIVELY = 0.05
"""Share of the pixels that change between two frames, usually, where there is noise to hold a change against: in a
still compressed film 0.01 do, and nearly all at each key frame."""


def jumps(frames: Sequence[Values]) -> list[int]:
    """Frames, T of (rows, columns), whose picture is another than that of the frame before.

    A change is the median, over cells of the picture, of how much their means differ: what crosses fewer than half of
    them is none. It is a jump from 12 times the median change on, where no more than a tenth of all (or two) are: one
    frame behind a shutter is two of them. What is farther from the others than that in level or picture spoils all
    terms; less is within what they may be by chance. Where a camera that stands begins to turn, each frame is one; of a
    scene that slides most of the time none is.
    """
    if not lively(frames):
        return []
    rows, columns = (max(side // _CELL, 1) for side in frames[0].shape)
    cells = [_means(frame, rows, columns) for frame in frames]
    changes = np.array([np.median(np.abs(later - before)) for before, later in itertools.pairwise(cells)])
    usual = float(np.median(changes))
    found = np.flatnonzero(changes > _BEYOND * usual) + 1
    return found.tolist() if usual > 0 and len(found) <= max(2, _FEW * len(changes)) else []


def lively(frames: Sequence[Values] | Values) -> bool:
    """Whether pixels of frames, T of (rows, columns), change from frame to frame, as noise lets them."""
    changed = [np.count_nonzero(before != later) for before, later in itertools.pairwise(frames)]
    return bool(changed) and float(np.median(changed)) >= _LIVELY * frames[0].size


def _means(frame: Values, rows: int, columns: int) -> Floats:
    return np.asarray(cv2.resize(frame.astype(np.float64), (columns, rows), interpolation=cv2.INTER_AREA))
