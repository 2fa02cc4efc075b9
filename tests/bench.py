"""Speeds of the shipped things, one `name: value unit` a line: `make bench`.

Medians on one thread. Ratios are against a plain numpy and scipy program that does the same work in
the same run, so that they mean something on any machine. docs/benchmarks.md holds goals and figures.
"""

from __future__ import annotations

import os

os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))

import math
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from time import perf_counter, process_time

import cv2
import numpy as np
from bench_full_chain import full_chain
from bench_sweeps import metrics, sweeps
from scipy import ndimage

import irsim
import irtrack
from irtrack import peers

FRAMES = 60
STEPS = 2000


def report(name: str, value: float, unit: str) -> None:
    print(f"{name}: {value:.3g} {unit}", flush=True)


def median_s(step: Callable[[int], object], count: int, warm_up: int = 3) -> float:
    """Median time of step(k), s; the first calls do not count."""
    times = []
    for k in range(count + warm_up):
        begin = perf_counter()
        step(k)
        times.append(perf_counter() - begin)
    return statistics.median(times[warm_up:])


def iterator_step(items: Iterator[object]) -> Callable[[int], object]:
    return lambda _: next(items)


def sky() -> irsim.Scenario:
    return irsim.load("sky", ["camera.size=[640,512]", f"frames={FRAMES + 10}"])


class NaiveSky:
    """The frames of a sky scenario the plain way: whole float64 arrays, one operation after another.

    A gradient, cloud layers that drift by sub-pixel interpolation (transmittance and emission), one
    target as a Gaussian, fixed pattern, white noise, noise with memory, and 14-bit counts.
    """

    def __init__(self, scenario: irsim.Scenario) -> None:
        columns, rows = scenario.camera.size
        self.rng = np.random.default_rng(0)
        self.shape = rows, columns
        self.kinds = [noise.kind for noise in scenario.camera.noise]
        layers = len(getattr(scenario.background, "clouds", ()))
        self.fields = [ndimage.gaussian_filter(self.rng.random(self.shape), 8) for _ in range(2 * layers)]
        self.gradient = np.repeat(np.linspace(1.0, 2.0, rows)[:, None], columns, axis=1)
        self.fixed = 0.01 * self.rng.standard_normal(self.shape)
        self.memory = np.zeros(self.shape)

    def frame(self, k: int) -> np.ndarray:
        image = self.gradient.copy()
        for transmittance, emission in zip(self.fields[::2], self.fields[1::2], strict=True):
            shift = (0.1 * k, 0.3 * k)
            image = image * ndimage.shift(transmittance, shift, order=1, mode="grid-wrap")
            image = image + ndimage.shift(emission, shift, order=1, mode="grid-wrap")
        y, x = np.mgrid[: self.shape[0], : self.shape[1]]
        image = image + 0.2 * np.exp(-((x - 100 - k) ** 2 + (y - 100) ** 2) / 8)
        for kind in self.kinds:
            if kind == "fixed_pattern":
                image = image + self.fixed
            elif kind == "ar1":
                self.memory = 0.9 * self.memory + 0.44 * self.rng.standard_normal(self.shape)
                image = image + 0.01 * self.memory
            else:
                image = image + 0.01 * self.rng.standard_normal(self.shape)
        counts: np.ndarray = np.clip(np.round(image * 5000), 0, 2**14 - 1)
        return counts.astype(np.uint16)


def rendering() -> None:
    scenario = sky()
    ours = median_s(iterator_step(irsim.frames(scenario)), FRAMES)
    naive = median_s(NaiveSky(scenario).frame, FRAMES // 3)
    report("render_sky_640x512", 1 / ours, "frames/s")
    report("render_sky_640x512_naive_numpy", 1 / naive, "frames/s")
    report("render_sky_640x512_speedup", naive / ours, "x")


def recording() -> None:
    source = irsim.open_source(sky())
    source.frame(0)  # textures are painted once
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sky.mcap"
        begin = perf_counter()
        irsim.record(source, path)
        report("render_and_record_sky_640x512", len(source) / (perf_counter() - begin), "frames/s")
        recorded = irsim.open_recording(path)
        report("read_640x512", 1e3 * median_s(iterator_step(recorded.frames()), FRAMES), "ms/frame")
        report("read_640x512_any_frame", 1e3 * median_s(lambda k: recorded.frame(37 * k % FRAMES), FRAMES), "ms")


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


def growth() -> None:
    """256 runs of 100 steps of the growth model in one array, N = 100."""
    from irtrack.growth import BOOTSTRAP, WSPF, Growth, run

    model = Growth.of(256, 0)
    for name, filter in (("bootstrap", BOOTSTRAP), ("wspf", WSPF)):
        seconds = median_s(lambda k, filter=filter: run(model, filter, k), 7, 1)  # type: ignore[misc]
        report(f"growth_{name}_100_particles", 1e6 * seconds / model.states.size, "us/run-step")


def tracking() -> None:
    large, small = tracking_frames(160, 120, 14, 10), tracking_frames(320, 240, 5, 5)
    others = ("template", "kalman", "fusion_wspf", "svd_pf", "ekf", "optical_flow", "camshift_kalman", "mean_shift")
    box = irsim.Box(*circle(0), 14, 10)
    ours, naive = step_ms("grey_pf", {}, large, box), naive_grey_step_ms(large, box)
    report("grey_pf_160x120_step", ours, "ms")
    report("grey_pf_160x120_step_naive_numpy", naive, "ms")
    report("grey_pf_160x120_step_speedup", naive / ours, "x")
    for name in (*others, "background_restrained_pf"):
        report(f"{name}_160x120_step", step_ms(name, {}, large, box), "ms")
    report(
        "grey_pf_10000_particles_160x120_step",
        step_ms("grey_pf", {"particles": 10_000}, large, box),
        "ms",
    )
    for name in ("cascade_pf", "product_pf", "mean_shift_pf"):
        report(f"{name}_320x240_step", step_ms(name, {}, small, irsim.Box(*circle(0), 5, 5)), "ms")


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
    for k in range(1, FRAMES):
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


def step_ms(name: str, parameters: dict[str, object], frames: list[irsim.Frame], box: irsim.Box) -> float:
    """Median time of the processor in a step, which other programs on it do not lengthen."""
    from irsim.rng import stream

    tracker = irtrack.make(name, parameters)
    state = tracker.init(frames[0], box, stream(0, name, "target", 0))
    times = []
    for k in range(1, STEPS):
        frame, rng = frames[k % len(frames)], stream(0, name, "target", k)
        begin = process_time()
        state, _ = tracker.step(state, frame, rng)
        times.append(process_time() - begin)
    return 1e3 * statistics.median(times)


def others() -> None:
    """The peers that are installed, in a box of 3 times the target; wall time, with the way there and back."""
    frames, box = tracking_frames(160, 120, 14, 10), irsim.Box(*circle(0), 14, 10)
    for name in peers.offered():
        tracker = irtrack.make(name, {"context": 3})
        state = tracker.init(frames[0], box, np.random.default_rng(0))
        seconds = median_s(partial(shown, tracker, state, frames), 60)
        report(f"{name}_160x120_step", 1e3 * seconds, "ms")


def shown(tracker: irtrack.Tracker, state: object, frames: list[irsim.Frame], k: int) -> object:
    return tracker.step(state, frames[k + 1], np.random.default_rng(0))


def suppression() -> None:
    """Five components of a 320x240 frame of clouds."""
    from irsim.rng import stream
    from irtrack.features.svd import largest_parts

    rng = np.random.default_rng(0)
    clouds = ndimage.gaussian_filter(rng.standard_normal((240, 320)), 12)
    image = (3000 + 20000 * clouds + 8 * rng.standard_normal(clouds.shape)).astype(np.uint16)
    seconds = median_s(lambda k: largest_parts(image, 5, stream(k)).less(5), 200)
    report("svd_suppression_320x240", 1e3 * seconds, "ms")
    naive = median_s(lambda k: np.linalg.svd(image.astype(np.float32), full_matrices=False), 20)
    report("svd_suppression_320x240_speedup", naive / seconds, "x")


def start_up() -> None:
    for name in ("irsim", "irtrack"):
        report(f"{name}_help", help_s(name), "s")


def help_s(name: str) -> float:
    return median_s(lambda _: call(name, "--help"), 7, 1)


def check() -> None:
    """All properties of a tracker, profile ci, by the clock: its worker is no child whose CPU time could be asked."""
    begin = perf_counter()
    call("irtrack", "check", "grey_pf")
    report("irtrack_check_grey_pf", perf_counter() - begin, "s")


def call(name: str, *words: str) -> None:
    command = [str(Path(sys.executable).with_name(name)), *words]
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)


def main() -> None:
    cv2.setNumThreads(1)
    sweeps(report)  # first: in a process as small as one that `irtrack bench` starts
    rendering()
    full_chain(report)
    tracking()
    others()
    growth()
    suppression()
    recording()
    metrics(report)
    start_up()
    check()


if __name__ == "__main__":
    main()
