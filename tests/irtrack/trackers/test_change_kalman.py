"""The learned backdrop, several filters that share plots, and the tracker on both."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from irtrack.features.foreground import gathered, peaks
from tracker_scenes import follow

from irsim.types import Box, Floats, Frame
from irtrack.features.background import Backdrop
from irtrack.filters.association import Rules, Tracks, advance
from irtrack.registry.table import make

CORNER = (slice(0, 1), slice(0, 1))
RULES = Rules(acceleration=0.1, measurement_sd=1.0, partial=30.0, beside=12.0, gate=13.8, seen=0.5)


def texture(seed: int, rows: int = 140, columns: int = 180) -> Floats:
    """Smooth random ground of deviation 25 about 100 counts."""
    rough = np.random.default_rng(seed).standard_normal((rows, columns))
    smooth = np.asarray(cv2.GaussianBlur(rough, (0, 0), 3), np.float64)
    return 100 + 25 * smooth / float(smooth.std())


def counts(picture: Floats) -> npt.NDArray[np.uint8]:
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("dx", "dy"), [(0.0, 0.0), (0.4, -0.3), (6.0, 4.0), (-5.0, 2.6)], ids=str)
def test_a_moved_camera_and_its_gain_are_found(dx: float, dy: float) -> None:
    ground = texture(1)
    matrix = np.array([[1, 0, dx], [0, 1, dy]])
    moved = cv2.warpAffine(ground, matrix, ground.shape[::-1], flags=cv2.INTER_CUBIC)
    inner = (slice(15, -15), slice(15, -15))
    first, second = counts(ground)[inner], counts(10 + 0.9 * moved)[inner]
    backdrop, look = Backdrop.begin(first, CORNER).lay(second, True)
    assert look.moved == pytest.approx((dx, dy), abs=0.1)
    assert backdrop.gain == pytest.approx(0.9, abs=0.03)
    assert max(abs(s) for s in look.shift) <= 0.5  # the canvas goes along by whole pixels
    off = np.abs(look.picture - look.mean)[10:-10, 10:-10]
    assert np.median(off) < 1.5  # of ground of 25


def test_noise_alone_does_not_move_a_still_camera() -> None:
    rng = np.random.default_rng(2)
    first, second = (counts(100 + 6 * rng.standard_normal((120, 160))) for _ in range(2))
    _, look = Backdrop.begin(first, CORNER).lay(second, True)
    assert look.moved == (0, 0)


def test_the_luckiest_of_all_shifts_is_no_jump() -> None:
    """Before an even sky: 200 frames of noise and nothing else, the backdrop learned from the three before."""
    rng = np.random.default_rng(5)
    even = np.zeros((96, 128), np.float32)
    for _ in range(50):
        backdrop = Backdrop.begin(counts(50 + 3.5 * rng.standard_normal(even.shape)), CORNER)
        for _ in range(4):
            backdrop, look = backdrop.lay(counts(50 + 3.5 * rng.standard_normal(even.shape)), True)
            assert max(map(abs, look.moved)) < 1.1
            backdrop = backdrop.learn(look, even, 0.1, None)


def test_the_backdrop_is_the_running_mean_of_what_was_seen() -> None:
    """1 / (n + 1) until that is below the rate: 100, then 103 and 106 at rates 1/2 and 1/3 make 103."""
    hole = (slice(10, 14), slice(10, 14))
    backdrop = Backdrop.begin(np.full((30, 40), 100, np.uint8), hole)
    none = np.zeros((30, 40), np.float32)
    for grey in (103, 106):
        _, look = backdrop.lay(np.full((30, 40), grey, np.uint8), False)
        backdrop = backdrop.learn(look, none, 0.1, hole)
    assert backdrop.mean[0, 0] == pytest.approx(103)
    assert np.all(backdrop.mean[hole] == pytest.approx(100))  # filled from its edge, and not learned
    _, look = backdrop.lay(np.full((30, 40), 106, np.uint8), False)
    assert look.known[0, 0]
    assert not look.known[hole].any()
    # The first look at what was never seen is taken as it is.
    assert backdrop.learn(look, none, 0.1, None).mean[12, 12] == pytest.approx(106)


def test_a_peak_lies_between_pixels_where_the_foreground_does() -> None:
    y, x = np.mgrid[:40, :50]
    at = (20.3, 15.8)
    sure = np.clip(4 - np.hypot(x - at[0], y - at[1]), 0, 1).astype(np.float32)
    centers, heights = peaks(gathered(0.5 + sure / 2, (2.0, 2.0)), (2, 2), 0.05, 10)
    assert centers == pytest.approx(np.array([at]), abs=0.1)
    assert 0.5 < heights[0] < 1
    assert len(peaks(gathered(np.full((40, 50), 0.5, np.float32), (2.0, 2.0)), (2, 2), 0.05, 10)[0]) == 0


def tracks(*places: tuple[float, float, float, float], missed: int = 0) -> Tracks:
    made = Tracks.of(np.array(places), np.repeat(np.eye(4)[None], len(places), 0), np.ones(len(places)), 20)
    made.missed[0] = missed
    return made


def test_a_plot_of_the_company_is_not_the_targets() -> None:
    """One plot 2 px from both predictions: the companion was seen in the last frame, the target was not."""
    before = tracks((50, 50, 1, 0), (55, 50, 0, 0), missed=1)
    after = advance(before, np.array([[53.0, 50.0]]), np.array([1.0]), (0.0, 0.0), RULES)
    assert after.missed.tolist() == [2, 0]
    assert after.mean[0] == pytest.approx([51, 50, 1, 0])  # goes on along its way


def test_all_plots_are_shared_out_at_once() -> None:
    """The nearest plot to the first, 1 px off, is the only one for the second; the first takes the other."""
    before = tracks((50, 50, 0, 0), (53, 50, 0, 0))
    after = advance(before, np.array([[51.0, 50.0], [48.0, 50.0]]), np.ones(2), (0.0, 0.0), RULES)
    assert after.mean[0, 0] < 50
    assert after.mean[1, 0] < 53
    assert len(after.mean) == 2


def test_what_is_left_of_a_hidden_target_does_not_pull_it() -> None:
    before = tracks((50, 50, 1, 0))
    part, whole = (
        advance(before, np.array([[50.0, 50.0]]), np.array([height]), (0.0, 0.0), RULES) for height in (0.6, 1.0)
    )
    assert part.mean[0] == pytest.approx([51, 50, 1, 0])
    assert part.missed[0] == 0
    assert whole.mean[0, 0] < 51


def test_tracks_go_along_with_the_scene_and_ghosts_end() -> None:
    before = tracks((50, 50, 0, 0))
    born = advance(before, np.array([[50.0, 50.0], [90.0, 20.0]]), np.ones(2), (0.0, 0.0), RULES)
    assert len(born.mean) == 2
    after = advance(born, np.array([[53.0, 50.0]]), np.ones(1), (3.0, 0.0), RULES)
    assert after.mean[0, :2] == pytest.approx([53, 50])
    assert len(after.mean) == 1


def hiding(seed: int, pan: float = 0.0) -> tuple[list[Frame], list[tuple[float, float]], list[bool]]:
    """A spot no brighter than its ground, hidden behind a bar for some frames; another beside it that is not."""
    wide = texture(seed, 120, 260)
    rng = np.random.default_rng([seed, 1])
    y, x = np.mgrid[:120, :160]
    frames, at, seen = [], [], []
    for k in range(60):
        left = pan * k
        picture = cv2.warpAffine(wide, np.array([[1.0, 0, -20 - left], [0, 1, 0]]), (160, 120), flags=cv2.INTER_CUBIC)
        cx, cy = 30 + 1.5 * k, 50.0
        for row in (cy, cy + 25):
            picture = np.where(np.hypot(x - cx + left, y - row) < 4.5, 135.0, picture)
        bar = (np.abs(x - 75 + left) < 10) & (np.abs(y - 50) < 9)
        picture = np.where(bar, 60.0, picture)
        frames.append(Frame(counts(picture + 2 * rng.standard_normal(picture.shape)), k, k / 30, 8))
        at.append((cx - left, cy))
        seen.append(abs(cx - 75) > 15)
    return frames, at, seen


@pytest.mark.parametrize("pan", [0.0, 0.7], ids=["still", "panned"])
def test_it_waits_behind_a_bar_and_is_back_on_its_target(pan: float) -> None:
    for seed in range(3):
        frames, at, seen = hiding(seed, pan)
        estimates = follow(make("change_kalman"), frames, Box(*at[0], 9, 9))
        errors = np.hypot(*(np.array([e.center for e in estimates]) - at[1:]).T)
        assert errors[np.array(seen[1:])].max() < 3
        hidden = [e.status for e, (x, _) in zip(estimates, at[1:], strict=True) if abs(x - 75 + pan * 30) < 2]
        assert hidden
        assert "tracking" not in hidden[1:]


@pytest.mark.parametrize("switched", [{"register_frames": False}], ids=["register_frames"])
def test_a_panned_scene_needs_registration(switched: dict[str, Any]) -> None:
    frames, at, _ = hiding(0, 0.7)
    estimates = follow(make("change_kalman", switched), frames, Box(*at[0], 9, 9))
    assert np.hypot(*np.subtract(estimates[-1].center, at[-1])) > 5
