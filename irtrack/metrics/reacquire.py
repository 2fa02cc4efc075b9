"""How soon a tracker is back on a target that was hidden or away."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Return:
    """A target's coming back into sight.

    at       position of the first frame in which it counts again
    watched  how many frames it then counts, until it is hidden again or the track ends
    after    frames from `at` until the tracker is on it (0: at once); None where it was not, while it was watched
    """

    at: int
    watched: int
    after: int | None


def returns(off: np.ndarray, shown: np.ndarray) -> list[Return]:
    """Every time that the target comes back into sight; off, shown (n,) bool as for `irtrack.metrics.loss.loss`.

    The time to reacquire is counted in frames in which the target counts: "back within 5 frames" is
    ``after is not None and after <= 5``. A target that shows from the first frame on has not come back.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], shown, [False]]).astype(np.int8)))
    found = []
    for begin, end in edges.reshape(-1, 2).tolist():
        if begin == 0:
            continue
        on = np.flatnonzero(~off[begin:end])
        found.append(Return(begin, end - begin, int(on[0]) if len(on) else None))
    return found
