"""Track before detect: its likelihood ratio by hand, its posterior against a filter on a grid, its detection rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tracker_scenes import blob

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.registry.table import make
from irtrack.trackers.apf_tbd import APFTBD, START_EXISTENCE, APFTBDState
from irtrack.trackers.gnn import GNN

POINT = {"psf": 1.0, "whiten": "none", "snr_limit": 10_000, "amplitude_sd": 0, "speed_sd": 0, "start_speed_sd": 0}
ROWS, COLUMNS, PITCH, MARGIN = 18, 22, 0.25, 3.0


def noisy(k: int, at: tuple[float, float] | None, scr: float, shape: tuple[int, int] = (ROWS, COLUMNS)) -> Frame:
    """A point of deviation 1 px and height `scr` standard deviations in white noise of 20 counts."""
    rng = np.random.default_rng([k, shape[0]])
    y, x = np.mgrid[: shape[0], : shape[1]]
    point = 0.0 if at is None else scr * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / 2)
    counts = np.rint(1000 + 20 * (rng.standard_normal(shape) + point)).astype(np.uint16)
    return Frame(counts, k, k / 30, 14)


@pytest.mark.parametrize("box", [Box(80, 60, 14, 10), Box(80, 60, 40, 28), Box(80, 60, 5, 5)])
def test_likelihood_ratio_is_the_product_over_pixels(box: Box) -> None:
    frame, tracker = blob(0, count=1)[0][0], APFTBD()
    state = tracker.init(frame, box, stream(0, 0))
    start, rng = state.start, np.random.default_rng(1)
    z = tracker.whitened(frame.image, start)
    assert start.block == {14: 1, 40: 3, 5: 1}[round(box.w)]
    particles = np.c_[rng.uniform(-10, 170, 12), rng.uniform(-10, 130, 12), np.zeros((12, 2)), rng.uniform(1, 5, 12)]
    found = tracker.log_ratios(z, particles, start)
    for (x, y, *_, amplitude), lw in zip(particles, found.lw, strict=True):
        u, v = ((c - (start.block - 1) / 2) / start.block for c in (x, y))
        total = 0.0
        for row in range(z.shape[0]):
            for column in range(z.shape[1]):
                if abs(row - np.floor(v + 0.5)) <= start.y[-1] and abs(column - np.floor(u + 0.5)) <= start.x[-1]:
                    sx, sy = start.psf
                    h = np.exp(-((column - u) ** 2) / (2 * sx**2) - (row - v) ** 2 / (2 * sy**2))
                    total += amplitude * h * float(z[row, column]) - amplitude**2 * h**2 / 2
        assert lw == pytest.approx(total, rel=1e-4, abs=1e-4)
    outside = tracker.log_ratios(z, np.array([[-300.0, 20, 0, 0, 3], [np.float64(900), 400, 0, 0, 3]]), start)
    assert (outside.visible == 0).all()


class GridFilter:
    """Exact filter of the hidden Markov model: a place on a fine grid, which walks at random, or no target."""

    def __init__(self, tracker: APFTBD, state: APFTBDState, box: Box) -> None:
        self.tracker, self.start, self.amplitude = tracker, state.start, state.level
        self.x = np.arange(-MARGIN - 0.5 + PITCH / 2, COLUMNS - 0.5 + MARGIN, PITCH)
        self.y = np.arange(-MARGIN - 0.5 + PITCH / 2, ROWS - 0.5 + MARGIN, PITCH)
        rows, columns = (self._normal(*axis, tracker.start_sd) for axis in ((self.y, box.cy), (self.x, box.cx)))
        self.p = rows[:, None] * columns
        self.p *= START_EXISTENCE / self.p.sum()
        inside = ((self.y > -0.5) & (self.y < ROWS - 0.5))[:, None] & ((self.x > -0.5) & (self.x < COLUMNS - 0.5))
        self.births = inside / inside.sum()
        self.walks = [self._normal(axis[:, None], axis[None], tracker.position_sd) * PITCH for axis in (self.y, self.x)]

    @staticmethod
    def _normal(at: np.ndarray, mean: np.ndarray | float, sd: float) -> np.ndarray:
        density: np.ndarray = np.exp(-((at - mean) ** 2) / (2 * sd**2)) / (np.sqrt(2 * np.pi) * sd)
        return density

    def step(self, image: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the probability that a target exists, and its mean place (2,) px if it does."""
        exists = self.p.sum()
        self.p = (1 - self.tracker.death) * (self.walks[0] @ self.p @ self.walks[1].T)
        self.p += self.tracker.birth * (1 - exists) * self.births
        x, y = np.meshgrid(self.x, self.y)
        zero = np.zeros(x.size)
        particles = np.stack([x.ravel(), y.ravel(), zero, zero, zero + self.amplitude], axis=1)
        found = self.tracker.log_ratios(self.tracker.whitened(image, self.start), particles, self.start)
        empty = 1 - (1 - self.tracker.death) * exists - self.tracker.birth * (1 - exists)
        self.p = self.p * (np.exp(found.lw) * (found.visible > 0)).reshape(x.shape)
        self.p /= self.p.sum() + empty
        return float(self.p.sum()), np.array([(self.p * x).sum(), (self.p * y).sum()]) / self.p.sum()


@pytest.mark.parametrize("auxiliary", [True, False])
def test_posterior_is_that_of_the_hidden_markov_model(auxiliary: bool) -> None:
    """The target walks, is gone in frames 6 to 8, comes back elsewhere, and is gone from frame 13 on."""
    tracker = make(
        "apf_tbd",
        POINT | {"particles": 4000, "births": 4000, "birth_place": "frame", "position_sd": 0.8, "auxiliary": auxiliary},
    )
    assert isinstance(tracker, APFTBD)
    places = [(8 + 0.7 * k, 9 - 0.3 * k) for k in range(6)] + [None] * 3 + [(5.3, 12 - 0.5 * k) for k in range(4)]
    frames = [noisy(k, at, 2.5) for k, at in enumerate([*places, None, None])]
    box = Box(8, 9, 5, 5)
    state = tracker.init(frames[0], box, stream(0, "test", 0))
    exact, seen = GridFilter(tracker, state, box), []
    for k, frame in enumerate(frames[1:], 1):
        state, _ = tracker.step(state, frame, stream(0, "test", k))
        existence, place = exact.step(frame.image)
        assert state.existence == pytest.approx(existence, abs=0.05)
        if existence > 0.5:
            assert state.weights @ state.particles[:, :2] == pytest.approx(place, abs=0.12)
        seen.append(existence > 0.5)
    assert True in seen[:5]
    assert False in seen[5:8]
    assert True in seen[8:12]
    assert not seen[-1]


def test_existence_needs_a_prior() -> None:
    """Without births a target that was lost stays lost; without deaths one that is hidden for a frame is not."""
    frames = [noisy(k, (10, 9) if k not in (4, 5) else None, 4.0) for k in range(12)]

    def existences(**parameters: float) -> list[float]:
        tracker = make("apf_tbd", POINT | parameters)
        state, found = tracker.init(frames[0], Box(10, 9, 5, 5), stream(0, 0)), []
        for k, frame in enumerate(frames[1:], 1):
            state, _ = tracker.step(state, frame, stream(0, k))
            found.append(state.existence)
        return found

    assert min(existences()[:3]) > 0.99
    assert max(existences()[3:5]) < 0.1
    assert existences()[-1] > 0.99
    assert existences(birth=0.0)[-1] < existences()[-1]


@pytest.mark.slow
def test_detects_fainter_targets_than_detection_then_tracking() -> None:
    """Pd after 15 frames at Pfa .1, 40 sequences each, against SCR; `gnn` on matched-filter detections beside it."""

    def scores(scr: float, seed: int) -> tuple[float, float]:
        rng = np.random.default_rng(seed)
        begin, speed = rng.uniform(14, 34, 2), rng.uniform(-0.5, 0.5, 2)
        ends = [tuple(begin + k * speed) if scr > 0 else None for k in range(16)]
        frames = [noisy(1000 * seed + k, at, scr, (48, 48)) for k, at in enumerate(ends)]
        still = {"position_sd": 0.1, "speed_sd": 0.1, "start_speed_sd": 0.4}
        tracker = make("apf_tbd", still | {"psf": 1.0, "whiten": "none", "birth_place": "frame", "particles": 2000})
        assert isinstance(tracker, APFTBD)
        state = tracker.init(frames[0], Box(24, 24, 5, 5), stream(seed, 0))
        state = replace(state, start=replace(state.start, gain=1.0, sign=1.0), level=2.0, existence=0.0)
        many = GNN(detector="matched_filter:threshold=2.5:most=20")
        tracks = many.init(frames[0], stream(seed, 0))
        for k, frame in enumerate(frames[1:], 1):
            state, _ = tracker.step(state, frame, stream(seed, k))
            tracks, _ = many.step(tracks, frame, stream(seed, k))
        table = tracks.tracks
        counts = np.bitwise_count(table.hits) * table.level * table.confirmed
        return state.existence, float(counts.max(initial=0.0))

    false = np.array([scores(0.0, seed) for seed in range(40)])
    least = np.quantile(false, 0.9, axis=0)
    rates = {}
    for scr in (1.0, 1.5, 2.0, 3.0):
        rates[scr] = (np.array([scores(scr, seed) for seed in range(100, 140)]) > least).mean(axis=0)
    print({scr: rate.round(2).tolist() for scr, rate in rates.items()})
    for before, after in rates.values():
        assert before >= after - 0.1
    assert rates[1.0][0] > rates[1.0][1] + 0.2
    assert rates[1.5][0] > rates[1.5][1]
    assert min(rates[3.0]) > 0.95
