"""Planted trackers to which a changed picture is not the same one."""

from __future__ import annotations

import numpy as np
from sound_tracker import Sound, State, lagging, moved

from irsim.types import Frame
from irtrack.types import Estimate


class Rooted(Sound):
    """Pulled to the frame's middle in x and in y alike: mirrored and transposed it stays so, shifted it does not."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        rows, columns = frame.image.shape
        return moved(estimate, *(0.07 * np.subtract(((columns - 1) / 2, (rows - 1) / 2), estimate.center)))


class Leans(Sound):
    """To the lower right, by as much in x as in y."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, 1.0, 1.0)


class Wide(Sound):
    """Thinks that pictures are wider than high."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        rows, columns = frame.image.shape
        return estimate if columns >= rows else lagging(estimate, 1.8)


class Absolute(Sound):
    """Goes by a level of grey that the background of its first scenes has."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        low = np.median(frame.image) / 2 ** (frame.bits - 8)
        return lagging(estimate, 1.8) if 55 < low < 150 else estimate


class Stretched(Sound):
    """Goes by a contrast of so many greys."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        contrast = abs(state.contrast) / 2 ** (frame.bits - 8)
        return lagging(estimate, 1.8) if contrast < 90 else estimate


class Hot(Sound):
    """Likes hot targets."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if state.contrast > 0 else lagging(estimate, 1.8)


class Shallow(Sound):
    """Takes all pictures for 8 bits."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return lagging(estimate, 1.8) if frame.bits > 8 else estimate


class Distracted(Sound):
    """Looks into the corners."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        off = np.abs(frame.image.astype(np.float64) - np.median(frame.image)) > abs(state.contrast) / 2
        rows, columns = off.shape
        corners = [off[y : y + 20, x : x + 24] for y in (0, rows - 20) for x in (0, columns - 24)]
        return lagging(estimate, 1.8) if max(corner.sum() for corner in corners) > 40 else estimate
