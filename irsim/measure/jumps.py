"""Where the whole picture of a recording becomes another: a shutter before the lens, a splash screen, a cut."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import cv2
import numpy as np

from irsim.measure.given import Values
from irsim.types import Floats

_CELL = 8
"""Side of the cells, px, whose means are compared: noise that is new in each pixel is an eighth in them."""
_BEYOND = 12.0
"""Times the usual change from frame to frame beyond which a picture is another: 8 standard deviations where the change
is normal. The largest of three real sensors, in 100 frames each, are 1.6, 1.9 and 8.6 times the usual one, those of the
scenarios shipped 1.1 to 3.5."""
_SURE = 10.0
"""Changes of which that usual one, their median, is known. Of m it is small by chance, too, so 1 + (10 / m)^2 times as
much is asked for: then a level alone, new in each frame or walking, makes a jump in 1 of 10^4 recordings or fewer,
however short. In the mean of more cells noise makes fewer."""
_FEW = 0.2
"""Share of the changes that may be as large: where more are, it is how the scene goes on."""
_FAINT = 0.02
"""Of what pixels change by, where they change at all: cells that usually change by less show no noise to compare with.
Those of white noise change by 0.13 of it, and by 0.03 where it is 0.25 counts, rounded; those of compressed films by
0 to 0.02, but by up to 2.8 times as much at each key frame (H.264 at crf 40; 4.9 at 45, 7 at its coarsest, 51)."""
_PLAIN = 5.0
"""Times what pixels change by, where they change at all, beyond which a picture is another even so: cuts between three
real films of one camera are 5.6 to 45 times that."""
_ASKED = 4096
"""Pixels, about, that are asked by how much they change: more change nothing but the time that it takes."""
_LIVELY = 0.05
"""Share of the pixels that change between two frames, usually, where there is noise to hold a change against: in a
still compressed film 0.01 do, and nearly all at each key frame."""


def jumps(frames: Sequence[Values]) -> list[int]:
    """Frames, T of (rows, columns), whose picture is another than that of the frame before.

    A change is the median, over cells of the picture, of how much their means differ: what crosses fewer than half of
    them is none. It is a jump beyond 12 times the median change (13.4 times in 30 frames, 22 in 12, 145 in 4), where no
    more than a fifth of all (or two) are: one frame behind a shutter is two of them, so a tenth of all may be such.
    Where cells usually stand still, as in a quiet or a compressed film, it is one beyond 5 times what pixels change by
    where they do: 5 counts where that is one.

    What changes less is not seen. Where noise is new in each pixel, a level that is off by less than 1.5 times their
    temporal noise (`pair`) goes unnoticed (1.7 in 30 frames, 2.8 in 12, 17 in 4): in one frame of T it adds up to
    1.5 `pair` / sqrt(T) to `t`, in half of them half of it, which is more than chance does. Where a camera that stands
    begins to turn, each frame is a jump; of a scene that slides most of the time none is.
    """
    if len(frames) < 2:
        return []
    rows, columns = (max(side // _CELL, 1) for side in frames[0].shape)
    cells = [_means(frame, rows, columns) for frame in frames]
    changes = np.array([np.median(np.abs(later - before)) for before, later in itertools.pairwise(cells)])
    usual, pixel = float(np.median(changes)), _pixel_change(frames)
    sure = _BEYOND * (1 + (_SURE / len(changes)) ** 2)
    least = _PLAIN * pixel if usual < _FAINT * pixel else sure * usual
    found = np.flatnonzero(changes > least) + 1
    return found.tolist() if len(found) <= max(2, _FEW * len(changes)) else []


def lively(frames: Sequence[Values] | Values) -> bool:
    """Whether pixels of frames, T of (rows, columns), change from frame to frame, as noise lets them."""
    changed = [np.count_nonzero(before != later) for before, later in itertools.pairwise(frames)]
    return bool(changed) and float(np.median(changed)) >= _LIVELY * frames[0].size


def _means(frame: Values, rows: int, columns: int) -> Floats:
    return np.asarray(cv2.resize(frame.astype(np.float64), (columns, rows), interpolation=cv2.INTER_AREA))


def _pixel_change(frames: Sequence[Values]) -> float:
    """By how much pixels usually change between frames, those that do; 0 where none does."""
    medians = []
    for before, later in itertools.pairwise(frames):
        changed = np.flatnonzero(before != later)
        if len(changed):
            changed = changed[:: max(len(changed) // _ASKED, 1)]
            medians.append(np.median(np.abs(later.flat[changed].astype(np.float64) - before.flat[changed])))
    return float(np.median(medians)) if medians else 0.0
