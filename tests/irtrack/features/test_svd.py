"""Background suppression by singular values, and `svd_pf`."""

from __future__ import annotations

import numpy as np
import pytest
from tracker_scenes import follow

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.features.svd import candidates, largest_parts, standardised
from irtrack.trackers.svd_pf import SVDPF


def clouds(seed: int, drift: float = 0.0) -> np.ndarray:
    """(60, 80) counts of a background of four smooth products and white noise of 5."""
    rng = np.random.default_rng([seed, round(10 * drift)])
    y, x = np.mgrid[:60, :80]
    waves = sum(200 / j * np.sin((x - drift) / (9 - j) + j) * np.cos(y / (11 - j) + seed) for j in range(1, 5))
    return np.asarray(2000 + waves + 5 * rng.standard_normal(x.shape))


def test_an_image_of_rank_one_is_all_background() -> None:
    """(1, 2, 3)' (10, 20): one part, s = sqrt(14) sqrt(500), and nothing is left; a pixel more is left."""
    image = np.outer([1, 2, 3], [10, 20]).astype(np.uint8)
    parts = largest_parts(image, 1, stream(0))
    assert np.linalg.norm(parts.right) == pytest.approx(np.sqrt(14 * 500))
    assert np.abs(parts.less(1)).max() < 1e-4
    assert np.array_equal(parts.less(0), image)


def test_largest_parts_are_those_of_the_exact_svd() -> None:
    image = np.clip(np.rint(clouds(1)), 0, 65535).astype(np.uint16)
    left, values, right = np.linalg.svd(image.astype(np.float64))
    parts = largest_parts(image, 4, stream(1))
    for k in (1, 2, 4):
        exact = image - (left[:, :k] * values[:k]) @ right[:k]
        assert np.abs(parts.less(k) - exact).max() < 0.5  # counts, of noise of 5
        # No matrix of rank k comes nearer than the exact one (Eckart, Young).
        assert np.linalg.norm(exact) - 1e-3 <= np.linalg.norm(parts.less(k)) <= 1.001 * np.linalg.norm(exact)


def test_z_of_normal_noise_has_unit_deviation() -> None:
    noise = np.random.default_rng(2).standard_normal((240, 320)).astype(np.float32)
    z = standardised(7 + 3 * noise, (3, 3), 1.0)
    assert np.std(z) == pytest.approx(1, rel=0.06)
    assert np.array_equal(standardised(7 + 3 * noise, (3, 3), -1.0), -z)
    assert not standardised(np.full((20, 30), 9, np.float32), (3, 3), 1.0).any()


def test_candidates_by_hand() -> None:
    """Three peaks above 5, one of them beside a higher one; the parabola through 6, 10, 8 peaks at 1/6 px."""
    z = np.zeros((20, 30), np.float32)
    z[5, 9:12] = 6, 10, 8
    z[15, 20] = 7
    z[10, 3] = 4
    z[0, 29] = 6
    centers, heights = candidates(z, (3, 3), 5.0, 10)
    assert heights.tolist() == [10, 7, 6]
    assert centers[0] == pytest.approx([10 + 1 / 6, 5])
    assert centers[1:].tolist() == [[20, 15], [29, 0]]
    assert len(candidates(z, (3, 3), 5.0, 2)[1]) == 2
    assert candidates(z, (3, 3), 11.0, 10)[0].shape == (0, 2)


def dim(seed: int, gone: range = range(0), jump: float = 0.0) -> tuple[list[Frame], np.ndarray]:
    """A 3x3 px target of 8 times the noise on drifting clouds, absent in some frames, and its centres (n, 2)."""
    frames, at = [], []
    for k in range(30):
        x, y = 15 + 1.3 * k + (jump if k >= gone.stop > 0 else 0.0), 20 + 0.6 * k
        v, u = np.mgrid[:60, :80]
        target = 40 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / 2) * (k not in gone)
        frames.append(Frame(np.rint(clouds(seed, 0.3 * k) + target).astype(np.uint16), k, k / 30, 14))
        at.append((x, y))
    return frames, np.array(at)


def error(tracker: SVDPF, frames: list[Frame], at: np.ndarray, last: int = 8) -> float:
    found = follow(tracker, frames, Box(at[0, 0], at[0, 1], 3, 3))
    return float(np.median(np.hypot(*(np.array([e.center for e in found[-last:]]) - at[-last:]).T)))


def test_a_wrong_prediction_is_corrected() -> None:
    seed = 1
    frames, at = dim(seed, gone=range(12, 15))
    assert error(SVDPF(), frames, at) < 1
    during = follow(SVDPF(), frames[:15], Box(at[0, 0], at[0, 1], 3, 3))
    assert np.hypot(*np.subtract(during[-1].center, at[14])) < 6
    # It reappears 35 px away: a candidate of the whole frame corrects the prediction.
    frames, at = dim(seed, gone=range(12, 16), jump=35)
    assert error(SVDPF(wrong_after=3), frames[:20], at[:20], last=2) < 1
    assert error(SVDPF(wrong_after=1000), frames[:20], at[:20], last=2) > 5
    # Two hits of three that are demanded; one that is demanded.
    assert error(SVDPF(wrong_after=3), frames[:18], at[:18], last=1) > 5
    assert error(SVDPF(wrong_after=3, confirm=1), frames[:18], at[:18], last=1) < 1


def test_tentative_target_by_hand() -> None:
    """M = 2 of N = 3; at rest a hit is within 3 hypot(sqrt(2), 2) = 7.3 px; after two misses another one is taken."""
    tracker, none = SVDPF(confirm=2, confirm_of=3), np.empty((0, 2))
    found = tracker._tentative(None, np.array([[10.0, 10.0], [50.0, 50.0]]))
    assert found is not None
    assert found.last.tolist() == [10, 10]
    hit = tracker._tentative(found, np.array([[50.0, 50.0], [14.0, 13.0]]))
    assert hit is not None
    assert hit.hits == (True, True)
    assert hit.state().tolist() == [14, 13, 4, 3]
    missed = tracker._tentative(found, none)
    assert missed is not None
    assert missed.hits == (True, False)
    other = tracker._tentative(missed, np.array([[50.0, 50.0]]))
    assert other is not None
    assert (other.hits, other.last.tolist()) == ((True,), [50, 50])
    assert tracker._tentative(missed, none) is None


def test_without_suppression_clouds_hide_the_target() -> None:
    frames, at = dim(0)
    assert error(SVDPF(components=0), frames, at) > 5
    assert error(SVDPF(), frames, at) < 1
