"""The template tracker where its template tells nothing."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.types import Box, Frame
from irtrack.trackers.template import Template


@pytest.mark.parametrize("window", [None, 6])
@pytest.mark.parametrize("box", [Box(23.5, 42.5, 8.0, 6.0), Box(2.0, 2.0, 8.0, 6.0)])
def test_without_structure_it_stays(box: Box, window: int | None) -> None:
    """A saturated target that fills its box: all places match alike, and the first of them is none to go to."""
    image = np.random.default_rng(1).normal(60, 3, (64, 80)).clip(0, 255).astype(np.uint8)
    left, top, right, bottom = (round(edge + 0.5) for edge in box.edges)
    image[max(top, 0) : bottom, max(left, 0) : right] = 200
    tracker, rng = Template(window=window), np.random.default_rng(0)
    state = tracker.init(Frame(image, 0, 0.0, 8), box, rng)
    for index in range(1, 4):
        state, estimate = tracker.step(state, Frame(image, index, index / 30, 8), rng)
        assert estimate.center == pytest.approx((box.cx, box.cy), abs=0.01)
