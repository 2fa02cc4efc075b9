"""Planted detectors: each breaks one property and no other."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
from planted_contract import TINY, Cache

from irsim.types import Frame
from irtrack.detectors.bandpass import DoG
from irtrack.types import Detections


class Sound(DoG):
    """A shipped detector whose memory is `after` of the last one, and whose answer is that of `says`."""

    def step(self, state: Any, frame: Frame) -> tuple[Any, Detections]:
        found = super().step(None, frame)[1]
        said = self.says(state, frame, found)
        return self.after(state, frame), said

    def after(self, state: Any, frame: Frame) -> Any:
        return None

    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        return found


def moved(found: Detections, x: Any, y: Any = 0.0) -> Detections:
    return replace(found, centers=found.centers + np.stack(np.broadcast_arrays(x, y, found.scores)[:2], axis=1))


class Illegal(Sound):
    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        odd = frame.image.size < 2400 and len(found) > 0
        return moved(found, np.nan) if odd else found


COUNTER = itertools.count()


class Random(Sound):
    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        return moved(found, TINY * next(COUNTER))


class Hashes(Sound):
    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        return moved(found, TINY * (hash("target") % 100_003))


class Peeks(Sound):
    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        whole = frame.image.base
        return found if whole is None or whole.ndim != 3 else moved(found, TINY * float(whole[-1, 0, 0]))


class Counts(Sound):
    def after(self, state: Any, frame: Frame) -> Any:
        return [0] if state is None else state

    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        if state is None:
            return found
        state[0] += 1
        return moved(found, TINY * state[0])


class Forgets(Sound):
    def after(self, state: Any, frame: Frame) -> Any:
        return state or Cache()

    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        return found if state is None or state.warm else moved(found, TINY)


BEGUN = [0.0]


class Shares(Sound):
    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        if state is None:
            BEGUN[0] = float(frame.image[0, 0])
        return moved(found, TINY * BEGUN[0])

    def after(self, state: Any, frame: Frame) -> Any:
        return 1


class Scribbles(Sound):
    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        if frame.image.flags.writeable:
            frame.image[0, 0] = 0
        return found


class Contiguous(Sound):
    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        return found if frame.image.flags.c_contiguous else moved(found, 1.0)


class Clock(Sound):
    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        return moved(found, 1.0) if frame.time > 1000 else found


class Blind(Sound):
    """Sees nothing of an SCR below 28."""

    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        return found.take(found.scores > 0.8 * found.scores.max(initial=0))


class Rooted(Sound):
    """Pulled to the middle of the frame."""

    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        rows, columns = frame.image.shape
        pull = 0.1 * (np.array([(columns - 1) / 2, (rows - 1) / 2]) - found.centers)
        return moved(found, *pull.T)


class Leans(Sound):
    """To the right."""

    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        return moved(found, 1.0)


class Raster(Sound):
    """Of detections near each other the first from the top stays."""

    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        kept: list[int] = []
        for row in np.lexsort(found.centers.T).tolist():
            apart = np.hypot(*(found.centers[kept] - found.centers[row]).T)
            if not (apart < 12).any():
                kept.append(row)
        return found.take(np.array(sorted(kept), dtype=np.int64))


class Absolute(Sound):
    """Goes by a level of counts."""

    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        return moved(found, 1.0, 1.0) if np.median(frame.image) > 3000 else found


class Ghosts(Sound):
    """Sees a target in a frame of one grey level."""

    def says(self, state: Any, frame: Frame, found: Detections) -> Detections:
        if np.ptp(frame.image) or frame.image.shape != (96, 128):
            return found
        return Detections(np.array([[64.0, 48.0]]), np.array([[5.0, 5.0]]), np.array([9.0]), np.eye(2)[None])


PLANTED: dict[str, type[Sound]] = {
    "legal": Illegal,
    "deterministic": Random,
    "elsewhere": Hashes,
    "causal": Peeks,
    "pure": Counts,
    "resumes": Forgets,
    "alone": Shares,
    "gentle": Scribbles,
    "layout": Contiguous,
    "timeless": Clock,
    "finds": Blind,
    "shift": Rooted,
    "flip": Leans,
    "order": Raster,
    "gain": Absolute,
    "empty": Ghosts,
}
