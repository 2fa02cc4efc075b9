"""What goes its way before a scene that stands: where it is in each frame, told by what is there at other times."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np

from irsim.measure.around import around
from irsim.measure.defects import LEAST_NOISE
from irsim.measure.given import Values
from irsim.measure.over_time import median_of
from irsim.measure.picked import evenly
from irsim.types import MEDIAN_TO_SIGMA, Bools

_MEDIANS = 48
"""Frames over the whole length, whose median stands for a scene without what passes."""
_WIDTH = 0.7
"""Sigma, px, of the Gaussian by which points are told from noise: a usual blur."""
_PASSES = 1 / (2 * np.sqrt(np.pi) * _WIDTH)
"""Share of white noise's sigma that it passes."""
_SEEN = 6.0
"""Sigmas of the noise under that Gaussian: of 10^8 pixels none has so much by chance."""
_APART = 5
"""Nothing as bright lies within so many px of a detection."""
_MOST = 12
"""Detections of a frame, the brightest first, of warm and of cold ones."""
_FASTEST = 8.0
"""Px a frame."""
_GATE = 2.0
"""Px by which a detection may lie off the place at which it is expected."""
_MISSED = 3
"""Frames in a row in which it may not be seen."""
_BACK = 4
"""Detections back over which a speed is told."""


@dataclass
class Track:
    """Frames in which something was seen, its rows and columns there, px, and whether it stands out warm (1) or cold
    (-1)."""

    sign: int
    frames: list[int] = field(default_factory=list)
    places: list[tuple[float, float]] = field(default_factory=list)

    @property
    def travel(self) -> float:
        """How far it came from its first place at most, px."""
        places = np.array(self.places)
        return float(np.hypot(*(places - places[0]).T).max())

    def expected(self, frame: int) -> tuple[float, float, float]:
        """Row and column in a later frame, and how far off it may lie, px."""
        (row, column), last = self.places[-1], self.frames[-1]
        if len(self.places) == 1:
            return row, column, _FASTEST * (frame - last)
        earlier = max(-len(self.places), -1 - _BACK)
        ago = (frame - last) / (last - self.frames[earlier])
        down, across = row - self.places[earlier][0], column - self.places[earlier][1]
        return row + ago * down, column + ago * across, _GATE * (1 if len(self.places) > 2 else 2)


def tracks(frames: Values, bad: Bools, least: int, travel: float) -> list[Track]:
    """What moves alone before what stands in frames (T, rows, columns), seen `least` times and come `travel` px far."""
    open_tracks: list[Track] = []
    done: list[Track] = []
    for k, found in enumerate(_seen(frames, bad)):
        done += [track for track in open_tracks if k - track.frames[-1] > _MISSED]
        open_tracks = [track for track in open_tracks if k - track.frames[-1] <= _MISSED]
        left = list(found)
        for track in sorted(open_tracks, key=lambda track: -len(track.frames)):
            row, column, gate = track.expected(k)
            near = [(float(np.hypot(r - row, c - column)), r, c) for sign, r, c in left if sign == track.sign]
            if near and min(near)[0] <= gate:
                _, r, c = min(near)
                left.remove((track.sign, r, c))
                track.frames.append(k)
                track.places.append((r, c))
        open_tracks += [Track(sign, [k], [(r, c)]) for sign, r, c in left]
    whole = [track for track in done + open_tracks if len(track.frames) >= least]
    return [track for track in whole if track.travel >= travel]


def _seen(frames: Values, bad: Bools) -> Iterator[list[tuple[int, float, float]]]:
    """Sign, row and column of what stands out from the noise of its place, of each frame."""
    picked = evenly(len(frames), _MEDIANS)
    scene = median_of([frames[k] for k in picked]).astype(np.float32)
    change = median_of([np.abs(frames[k] - scene) for k in picked]).astype(np.float32)
    noise = np.maximum(MEDIAN_TO_SIGMA * around(change), LEAST_NOISE).astype(np.float32)
    square = np.ones((2 * _APART + 1,) * 2, np.uint8)
    for frame in frames:
        apart = frame - scene
        apart = np.where(bad, 0, (apart - np.median(apart)) / noise).astype(np.float32)
        soft = cv2.GaussianBlur(apart, (0, 0), _WIDTH) / _PASSES
        found = []
        for sign in (1, -1):
            signed = sign * soft
            seen = signed > _SEEN
            places = np.argwhere(seen & (signed == cv2.dilate(signed, square)) if seen.any() else seen)
            order = np.argsort(-signed[tuple(places.T)])[:_MOST]
            found += [(sign, float(row), float(column)) for row, column in places[order]]
        yield found
