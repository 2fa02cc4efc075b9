"""Bad pixels get the values of a good one beside them, on the level of their own row and column."""

from __future__ import annotations

import numpy as np
import pytest
from intervals import held

import irsim
from irsim.measure import Figures, measure_figures
from irsim.measure.patched import patched
from irsim.types import Bools, Floats

NEAR = 16
"""How far along a line is looked, px."""


def striped(shape: tuple[int, int], seed: int) -> Floats:
    """Rows and columns of their own, by 50 counts."""
    rng = np.random.default_rng(seed)
    return np.asarray(1000 + 50 * (rng.standard_normal((shape[0], 1)) + rng.standard_normal(shape[1])))


def some(shape: tuple[int, int], share: float, seed: int) -> Bools:
    return np.asarray(np.random.default_rng(seed).random(shape) < share)


@pytest.mark.parametrize("shape", [(40, 60), (1100, 1300)])  # the larger is copied in another way
@pytest.mark.parametrize("share", [0.001, 0.02, 0.2])
def test_rows_and_columns_are_the_pixels_own(shape: tuple[int, int], share: float) -> None:
    level, bad = striped(shape, 1), some(shape, share, 2)
    bad[3, 3] = True
    frames = np.where(bad, 9e4, level) + np.arange(3.0)[:, None, None]
    kept = frames.copy()
    found = patched(frames, bad)
    np.testing.assert_allclose(found, level + np.arange(3.0)[:, None, None], atol=1e-8)
    np.testing.assert_array_equal(frames, kept)


def test_what_changes_in_time_is_that_of_the_good_pixel() -> None:
    frames = np.random.default_rng(3).normal(1000, 10, (50, 20, 30)) + 50 * np.arange(30.0)
    bad = np.zeros((20, 30), np.bool_)
    bad[7, 0] = True
    found = patched(frames, bad)[:, 7, 0]
    changes = found - found.mean()
    beside = [frames[:, y, x] - frames[:, y, x].mean() for y, x in ((6, 0), (8, 0), (7, 1))]
    assert min(np.abs(changes - each).max() for each in beside) < 1e-9


@pytest.mark.parametrize("bottom", [0, 60000])
def test_whole_counts_stay_whole_and_within_their_kind(bottom: int) -> None:
    """Columns of 0 and 5000 counts by turns, of which the nearest good one may be of the other kind."""
    frames = np.full((4, 32, 32), bottom, np.uint16)
    frames[:, :, 1::2] += 5000
    level, bad = frames[0].copy(), some((32, 32), 0.1, 5)
    frames[:, bad] = 333
    found = patched(frames, bad)
    assert found.dtype == np.uint16
    np.testing.assert_array_equal(found, np.broadcast_to(level, found.shape))
    assert np.array_equal(patched(frames.astype(np.float32) + 0, bad), found)
    assert patched(frames, np.zeros_like(bad)) is frames


def test_counts_end_where_their_kind_does() -> None:
    frames = np.full((2, 40, 9), 65000, np.uint16)
    frames[:, :, 4] = 65535
    frames[:, 20, 5] = 65535  # the good one beside, by chance as high as the column that is 535 higher
    bad = np.zeros((40, 9), np.bool_)
    bad[19:22, 4] = bad[20, 3] = True
    assert patched(frames, bad)[0, 20, 4] == 65535


def test_an_edge_farther_off_is_not_looked_at() -> None:
    """A wall that fills most of the picture's height ends well below the bad pixel, and tells nothing of its column."""
    picture = np.full((120, 40), 1000.0)
    picture[30 + NEAR :, 20:] += 700
    bad = np.zeros((120, 40), np.bool_)
    bad[20:25, 20] = True
    for side in (19, 21):
        assert np.abs(patched(np.stack([picture] * 3), bad)[:, 20:25, side - 1 : side + 1] - 1000).max() == 0


def fitted(seed: int, noises: str, netd_mk: float) -> Figures:
    scene = f"""
    frames: 60
    seed: {seed}
    camera: {{size: [96, 80], band: lwir, netd_mk: {netd_mk}, noise: [{{kind: white}}, {noises}]}}
    background: {{kind: ground, spread_k: 0}}
    """
    return measure_figures(np.stack([frame.image for frame, _ in irsim.frames(irsim.loads(scene))]), 30, passing=False)


BAD = "{kind: bad_pixels, dead: 0.008, hot: 0.008, blinking: 0.004, cluster: 1}"


def test_bad_pixels_make_odd_and_even_columns_no_fixed_pattern() -> None:
    """Of 13.4 pixels in a thousand came a fixed pattern of 0.13 NETD, and columns 2 % less apart."""
    with_bad = [fitted(seed, f"{{kind: odd_even, along: columns, ratio: -0.671}}, {BAD}", 150) for seed in range(4)]
    unit = np.mean([found.noise.value for found in with_bad])
    held([each.pixel for each in with_bad if each.pixel], 0.0)
    held([each.column for each in with_bad if each.column], 0.0)
    held([each.even_columns for each in with_bad if each.even_columns], -0.671 * float(unit))


def test_bad_pixels_add_nothing_to_the_pattern_of_pixels() -> None:
    """Columns of as much as the noise, which are what is left on patched pixels, made 0.3 of it 0.32."""
    noises = "{kind: fixed_pattern, pixel: 0.3, column: 1, row: 0.1}"
    for seed in range(3):
        alone, beside = (fitted(seed, each, 60).pixel for each in (noises, f"{noises}, {BAD}"))
        assert alone is not None
        assert beside is not None
        assert beside.value == pytest.approx(alone.value, rel=0.02)
