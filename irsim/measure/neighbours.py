"""How alike neighbouring pixels are: where a scene is seen they are, in what a detector adds of itself they are not."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from irsim.measure.memory import centred
from irsim.types import MEDIAN_TO_SIGMA, Floats

_TOGETHER = 0.1
"""Correlation of neighbouring pixels' changes above which they change together, where there are many pixels."""
_BEYOND_CHANCE = 5.0
"""So many standard errors of a correlation of pixels are no chance."""
_LINES_BEYOND_CHANCE = 4.0
"""The same of rows and columns, of which there are few: chance has so many in 1 of 30 000."""

_SHARPER = 2.0
"""Noise that is blurred is at most so much sharper than a Gaussian blur of the same correlation leaves it: by a box of
3 x 3 px 1.2 times, by a median 1.3, by a bilateral filter 1.3; beside sharp noise, waves that move made it 2 to 9."""
_ROUNDED = 2 / math.sqrt(12)
"""Sharp noise, counts, that need not be of rounding."""


@dataclass(frozen=True, slots=True)
class Changes:
    """How alike neighbouring pixels change.

    fine        sigma of what is sharp in changes from frame to frame, as `fine_sigma` has it
    together    whether they change together, from frame to frame or over half of the frames: something moves, or noise
                is blurred over pixels
    moving      whether it can be told that something moves
    """

    fine: float
    together: bool
    moving: bool


def changes(frames: Floats) -> Changes:
    """Of a region's frames (T, rows, columns); what moves slowly shows only over half of the frames.

    Two things tell what moves from noise, however blurred: neighbours agree the more, the farther apart the frames; or
    there is sharp noise beside the change that is smooth. A blur to the correlation r leaves of a sigma no more
    than (6 - 8 r + 2 r^4) / 6 under the mask of `fine_sigma`, if it is Gaussian.
    """
    chance = max(_TOGETHER, _BEYOND_CHANCE / float(np.sqrt(frames[0].size)))  # fixed noise may change once: one picture
    fine = fine_sigma(frames)
    following, sigma = _changed(frames, 1)
    far, _ = _changed(frames, max(len(frames) // 2, 1))
    blurred = sigma * (6 - 8 * following + 2 * following**4) / 6
    both = following > chance and fine > max(_SHARPER * blurred, _ROUNDED)
    return Changes(fine, max(following, far) > chance, far - following > chance or both)


def fine_sigma(frames: Floats) -> float:
    """Sigma of noise that is white in time and place, whatever smooth things move in (T, rows, columns).

    From differences of neighbouring frames under the mask [1 -2 1] x [1 -2 1], which passes no plane:
    J. Immerkaer, "Fast noise variance estimation", Computer Vision and Image Understanding 64 (1996).
    The median of absolute values stands for sigma; the mask gives 6 sigma, a difference sqrt(2).
    """
    changes = np.diff(np.asarray(frames, np.float64), axis=0)
    bent = np.diff(np.diff(changes, n=2, axis=1), n=2, axis=2)
    return float(MEDIAN_TO_SIGMA * np.median(np.abs(bent)) / (6 * np.sqrt(2)))


def _changed(frames: Floats, lag: int) -> tuple[float, float]:
    """Of changes over `lag` frames, without lines: neighbours' correlation, the greater of both axes, and sigma, over
    sqrt(2)."""
    change = centred(frames[lag:] - frames[:-lag])
    power = float(np.square(change).mean())
    if power == 0:
        return 0.0, 0.0
    along = float((change[:, :, 1:] * change[:, :, :-1]).mean())
    across = float((change[:, 1:] * change[:, :-1]).mean())
    return max(along, across) / power, float(np.sqrt(power / 2))


def alike(picture: Floats) -> tuple[str, ...]:
    """Which of the fixed terms "v", "h" and "vh" of a still region (rows, columns) hold more than a detector's pattern.

    Pixels, rows and columns of a detector differ independently: correlations of neighbours are 0, give or take
    1/sqrt(n). Those of a scene are blurred, and its slopes go on. Of pixels, all four neighbours are
    looked at, lines taken out; of rows and columns the next two, so that even and odd ones do not count. What
    makes pixels alike is in rows and columns, too.
    """
    rest = centred(picture[None])[0]
    pairs = (
        (rest[:, 1:], rest[:, :-1]),
        (rest[1:], rest[:-1]),
        (rest[1:, 1:], rest[:-1, :-1]),
        (rest[1:, :-1], rest[:-1, 1:]),
    )
    power = max(float(np.square(rest).mean()), np.finfo(np.float64).tiny)
    if np.mean([float((one * other).mean()) for one, other in pairs]) / power > _BEYOND_CHANCE / np.sqrt(
        len(pairs) * rest.size
    ):
        return "v", "h", "vh"
    return tuple(term for term, axis in (("v", 1), ("h", 0)) if _lines_alike(picture.mean(axis=axis)))


def _lines_alike(levels: Floats) -> bool:
    apart = levels - levels.mean()
    power = max(float(np.square(apart).mean()), np.finfo(np.float64).tiny)
    correlation = np.mean([float((apart[lag:] * apart[:-lag]).mean()) for lag in (1, 2)]) / power
    return bool(correlation > _LINES_BEYOND_CHANCE / np.sqrt(2 * len(levels)))
