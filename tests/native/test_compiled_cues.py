"""Cues of windows and high-passed pictures in C against their plain twins, to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from irtrack.features.quantise import Quantiser
from tracker_loops import pictures, plain, quantisers, seeds, windows

from irsim.types import Image
from irtrack._native import COMPILED
from irtrack.features import cues, highpass
from irtrack.features.window import Window

pytestmark = pytest.mark.skipif(not COMPILED, reason="no compiler was at hand")


@given(pictures(), windows(), quantisers(), st.integers(1, 9), st.sampled_from([20, 400]), st.integers(1, 30), seeds)
def test_cues(
    image: Image, window: Window, levels: Quantiser, edge_bins: int, places: int, count: int, seed: int
) -> None:
    """Windows of all sizes on, across and off the frame's edge, and rings around them, to the last bit."""
    rng = np.random.default_rng(seed)
    field, pattern = cues.Field(image, levels, edge_bins), cues.Pattern.of(window, places)
    centers = rng.uniform(-20, 50, (count, 6))[:, :2] if seed % 3 else rng.uniform(12, 18, (count, 2))
    scales = rng.uniform(0.5, 2, (count, 2))
    box, margin = (*centers[0].tolist(), *rng.uniform(1, 20, 2).tolist()), int(rng.integers(0, 12))

    def counted() -> list[object]:
        cue, visible = field.windows(pattern, centers, scales)
        ring = field.ring(box, margin)
        return [each.tolist() for each in (cue.grey, cue.gradient, visible, ring.grey, ring.gradient)]

    ours = counted()
    with plain():
        assert ours == counted()


@pytest.mark.parametrize("loops", [nullcontext, plain])
def test_cues_at_no_place_are_none(loops: Callable[[], AbstractContextManager[None]]) -> None:
    field = cues.Field(np.zeros((9, 9), np.uint8), Quantiser(0, 256, 2), 8)
    centers = np.array([[np.nan, 4], [np.inf, 4], [-np.inf, np.nan], [1e300, -1e300], [4, 4]])
    pattern = cues.Pattern.of(Window(3, 3, (0.0, 0.0)), 400)
    with loops():
        cue, visible = field.windows(pattern, centers, np.ones((5, 2)))
        none, _ = field.windows(pattern, centers[:0], np.ones((0, 2)))
    assert cue.grey[:, 0].tolist() == [0, 0, 0, 0, 1]
    assert visible.tolist() == [0, 0, 0, 0, pytest.approx(1)]
    assert not cue.gradient.any()
    assert none.grey.shape == (0, 2)


@given(pictures(), st.integers(1, 40), st.integers(3, 16), st.booleans(), st.sampled_from([0.5, 2.7, 55.0, 1e6]), seeds)
def test_high_passed_pictures(image: Image, L: int, m: int, full: bool, gain: float, seed: int) -> None:
    """Wholes and parts, with neighbourhoods beyond the frame and of more samples than there is a loop for."""
    kernel = highpass.full_kernel(L) if full else highpass.ring_kernel(L, m)
    high_pass = highpass.HighPass(kernel, 1, gain)
    whole = high_pass(image)
    first, end = np.sort(np.random.default_rng(seed).integers(0, np.array(image.shape) + 1, (2, 2)), axis=0)
    part = slice(first[0], end[0]), slice(first[1], end[1])
    assert high_pass.view(image)[part].tolist() == whole[part].tolist()
    with plain():
        assert high_pass(image).tolist() == whole.tolist()
