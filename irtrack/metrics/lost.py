"""Track loss, by the one definition that all tables cite."""

from __future__ import annotations

import numpy as np

from irsim.types import SHOWN, Floats

OFF_PX = 5.0
"""Centre error up to which no frame counts as off target, even for the smallest target, px."""

OFF_IN_A_ROW = 10
"""Number of successive frames off target that make a loss."""

LOSS_RULE = (
    f"A frame is off target when the centre error exceeds the largest of {OFF_PX:g} px, the diagonal of the true box "
    "and the accuracy of the truth (imported labels have one, rendered truth is exact). A track is lost when it is off "
    f"in {OFF_IN_A_ROW} frames in a row among those in which at least {SHOWN:.0%} of the target is visible; the loss "
    "is dated to the first of them. Frames in which the target is hidden or absent neither count nor break the row; "
    "where truth does not know how much is visible, the target counts as visible."
)
"""Definition in words, for tables."""


def off_beyond(diagonals: Floats, accuracy: Floats) -> Floats:
    """Return the centre error above which a frame is off target, (n,) px: max(5 px, true diagonal, accuracy)."""
    return np.maximum(OFF_PX, np.fmax(diagonals, accuracy))


def off_frames(errors: Floats, diagonals: Floats, accuracy: Floats) -> np.ndarray:
    """Return whether the centre error (n,) px is strictly above `off_beyond`, (n,) bool; False where it is nan."""
    return np.asarray(errors > off_beyond(diagonals, accuracy))


def loss(off: np.ndarray, shown: np.ndarray) -> int | None:
    """Return the position of the frame that the loss is dated to; None where the track is not lost.

    `off` (n,) bool: True where a frame is off target; `shown` (n,) bool: True where the target is visible, so that
    the frame counts. See `LOSS_RULE`.
    """
    row = 0
    first = 0
    for position in np.flatnonzero(shown):
        if not off[position]:
            row = 0
            continue
        if row == 0:
            first = int(position)
        row += 1
        if row == OFF_IN_A_ROW:
            return first
    return None
