"""What a step of each tracker costs: part of `make bench`.

A step is measured in several rounds between the other parts, and the least of the rounds' medians is told: what else
goes on in the machine, for seconds at a time, only ever lengthens it (so `timeit` of the standard library, too).
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from functools import partial
from time import process_time
from typing import Any
from unittest.mock import patch

import numpy as np

import irsim
import irtrack
from irsim.rng import stream
from irtrack.features.highpass import HighPass

STEPS = 200
"""In a round."""

Report = Callable[[str, float, str], None]


def tracking_frames(columns: int, rows: int, w: int, h: int) -> list[irsim.Frame]:
    """A bright target of w x h px that circles before noise."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:rows, :columns]
    frames = []
    for k in range(100):
        cx, cy = circle(k)
        blob = 90 * np.exp(-(((x - cx) / (0.36 * w)) ** 2 + ((y - cy) / (0.36 * h)) ** 2))
        image = np.clip(80 + blob + 6 * rng.standard_normal((rows, columns)), 0, 255).astype(np.uint8)
        frames.append(irsim.Frame(image, k, k / 30, 8))
    return frames


def circle(k: int) -> tuple[float, float]:
    angle = 2 * math.pi * k / 100
    return 80 + 30 * math.cos(angle), 60 + 30 * math.sin(angle)


class Steps:
    """Each tracker's least median of a step so far, ms of the processor's time, which other programs on it do not
    lengthen."""

    def __init__(self) -> None:
        large, box = tracking_frames(160, 120, 14, 10), irsim.Box(*circle(0), 14, 10)
        small, spot = tracking_frames(320, 240, 5, 5), irsim.Box(*circle(0), 5, 5)
        self._cases: dict[str, Callable[[], float]] = {
            "grey_pf_160x120_step": partial(step_ms, "grey_pf", {}, large, box),
            "grey_pf_160x120_step_naive_numpy": partial(naive_grey_step_ms, large, box),
            "grey_pf_10000_particles_160x120_step": partial(step_ms, "grey_pf", {"particles": 10_000}, large, box),
        }
        for name in (
            *("template", "kalman", "fusion_wspf", "svd_pf", "ekf", "optical_flow", "camshift_kalman", "mean_shift"),
            *("background_restrained_pf", "pdaf", "h_infinity", "lbp_mean_shift", "hog_pf", "adaboost_pf"),
            *("upf", "likelihood_pf", "histogram_moments", "ensemble"),
        ):
            self._cases[f"{name}_160x120_step"] = partial(step_ms, name, {}, large, box)
        for name in ("cascade_pf", "product_pf", "mean_shift_pf", "apf_tbd"):
            self._cases[f"{name}_320x240_step"] = partial(step_ms, name, {}, small, spot)
        for label, parameters in (("", {}), ("_still_camera", {"register_frames": False})):
            self._cases[f"imm_mf_320x240_step{label}"] = partial(step_ms, "imm_mf", parameters, small, spot)
        self._cases["cascade_pf_320x240_step_whole_high_pass"] = partial(whole_high_pass_ms, "cascade_pf", small, spot)
        self._least_ms = dict.fromkeys(self._cases, math.inf)

    def measure(self) -> None:
        """A further round."""
        for name, case in self._cases.items():
            self._least_ms[name] = min(self._least_ms[name], case())

    def tell(self, report: Report) -> None:
        for name, ms in self._least_ms.items():
            report(name, ms, "ms")
        ours = self._least_ms["grey_pf_160x120_step"]
        report("grey_pf_160x120_step_speedup", self._least_ms["grey_pf_160x120_step_naive_numpy"] / ours, "x")


def step_ms(name: str, parameters: dict[str, Any], frames: list[irsim.Frame], box: irsim.Box) -> float:
    """Median over a round."""
    tracker = irtrack.make(name, parameters)
    state = tracker.init(frames[0], box, stream(0, name, "target", 0))
    times = []
    for k in range(1, STEPS):
        frame, rng = frames[k % len(frames)], stream(0, name, "target", k)
        begin = process_time()
        state, _ = tracker.step(state, frame, rng)
        times.append(process_time() - begin)
    return 1e3 * statistics.median(times)


def whole_high_pass_ms(name: str, frames: list[irsim.Frame], box: irsim.Box) -> float:
    """The same, the whole frame high-passed, not what is looked at only."""
    with patch.object(HighPass, "view", HighPass.__call__):
        return step_ms(name, {}, frames, box)


def naive_grey_step_ms(frames: list[irsim.Frame], box: irsim.Box) -> float:
    """Median time of a plain program that does a step of `grey_pf`, a particle at a time."""
    rng = np.random.default_rng(0)
    half_w, half_h, count = int(box.w / 2), int(box.h / 2), 100
    y, x = np.mgrid[-half_h:half_h, -half_w:half_w]
    kernel = np.exp(-(x**2 + y**2) / (2 * (half_w**2 + half_h**2))).ravel()
    kernel /= kernel.sum()

    def histogram(image: np.ndarray, cx: float, cy: float) -> np.ndarray:
        left, top = round(cx) - half_w, round(cy) - half_h
        part = image[top : top + 2 * half_h, left : left + 2 * half_w]
        return np.bincount(part.ravel().astype(int) * 32 // 256, kernel, 32)

    reference = histogram(frames[0].image, box.cx, box.cy)
    places = np.array([box.cx, box.cy]) + rng.standard_normal((count, 2))
    before, weights, distances = places, np.full(count, 1 / count), np.zeros(count)
    times = []
    for k in range(1, len(frames) // 2):
        image = frames[k].image
        begin = process_time()
        chosen = rng.choice(count, count, p=weights)
        noise = np.clip(10 * distances[chosen], 0.5, 6)[:, None] * rng.standard_normal((count, 2))
        places, before = 2 * places[chosen] - before[chosen] + noise, places[chosen]
        places = np.clip(places, [half_w, half_h], [image.shape[1] - half_w, image.shape[0] - half_h])
        rho = np.array([np.sqrt(histogram(image, cx, cy) * reference).sum() for cx, cy in places])
        distances = np.sqrt(np.maximum(1 - rho, 0))
        weights = np.exp(-10 * distances**2)
        weights /= weights.sum()
        center = weights @ places
        reference = 0.95 * reference + 0.05 * histogram(image, *center)
        np.cov(places.T, aweights=weights)
        times.append(process_time() - begin)
    return 1e3 * statistics.median(times)
