"""Sprites drawn over an image, and their clutter: C kernels against their plain twins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from irsim._native import COMPILED
from irsim.geometry.sprite import Sprite
from irsim.render import composite as compose
from irsim.render import contrast
from irsim.types import Box

pytestmark = pytest.mark.skipif(not COMPILED, reason="nothing is compiled")

PLAIN = pytest.MonkeyPatch()
WIDE, HIGH = 70, 60
SIZE = st.integers(1, 12)
PLACE = st.integers(-15, 75)


def picture(seed: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    return np.random.default_rng(seed).uniform(1, 2, (HIGH, WIDE)).astype(np.float32)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), SIZE, SIZE, PLACE, PLACE)
@example(1, 4, 5, 0, 0)
@example(1, 4, 5, WIDE - 4, HIGH - 5)
@example(1, 4, 5, WIDE, 3)
@example(1, 4, 5, 3, HIGH)
@example(1, 4, 5, -4, 3)
@example(1, 4, 5, 3, -5)
@example(1, 12, 12, 66, -6)
def test_a_sprite_is_laid_alike(seed: int, wide: int, high: int, x: int, y: int) -> None:
    rng = np.random.default_rng(seed)
    cover, alpha, emission = rng.uniform(0, 1, (3, high, wide))
    box = Box.from_pixels(x, y, wide, high)
    sprite = Sprite(x, y, cover, alpha, emission, (x, y), (x, y), box, 1000.0, float(cover.sum()))
    ours, theirs = picture(seed), picture(seed)
    sums = compose.draw_over(ours, sprite)
    with PLAIN.context() as patch:
        patch.setattr(compose, "COMPILED", False)
        expected = compose.draw_over(theirs, sprite)
    np.testing.assert_array_equal(ours, theirs)
    assert sums == pytest.approx(expected, rel=1e-12)


@settings(max_examples=80, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(-60, 130),
    st.floats(-60, 130),
    st.sampled_from([0.0, 1.0, 7.0]) | st.floats(0, 150),
    st.sampled_from([0.0, 1.0, 7.0]) | st.floats(0, 150),
    st.sampled_from([0.0, 0.1]),
    st.booleans(),
)
@example(1, 35.0, 30.0, 4.0, 4.0, 0.0, False)
@example(1, 35.0, 30.0, 500.0, 500.0, 0.0, False)  # neither ring nor guard is left
@example(1, 35.0, 30.0, 70.0, 4.0, 0.0, False)
@example(1, 35.0, 30.0, 4.0, 4.0, 0.0, True)  # an even ring
@example(1, -20.4, 30.0, 4.0, 4.0, 0.0, False)  # only its ring is in the picture
@example(1, -100.0, 30.0, 4.0, 4.0, 0.0, False)
def test_the_ratio_is_the_same(seed: int, cx: float, cy: float, w: float, h: float, noise: float, even: bool) -> None:
    light = np.full((HIGH, WIDE), 2.0, dtype=np.float32) if even else picture(seed)
    ours = contrast.scr(light, Box(cx, cy, w, h), lambda level, box: noise * level)
    with PLAIN.context() as patch:
        patch.setattr(contrast, "COMPILED", False)
        theirs = contrast.scr(light, Box(cx, cy, w, h), lambda level, box: noise * level)
    if math.isinf(theirs):  # of nothing but rounding, whose sign is anyone's
        assert math.isinf(ours)
        return
    assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-12, nan_ok=True)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
def test_boxes_that_are_no_numbers_do_not_crash(bad: float) -> None:
    for box in (Box(bad, 3.0, 4.0, 4.0), Box(3.0, 3.0, bad, 4.0), Box(bad, bad, bad, bad)):
        assert isinstance(contrast.scr(picture(0), box), float)
