"""Speeds of the shipped things, one `name: value unit` a line: `make bench`.

Medians on one thread; of a tracker's step and of a rendered frame the least of several rounds
(`bench_steps`). Ratios are against a plain numpy and scipy program that does the same work in the same
run, so that they mean something on any machine. docs/benchmarks.md holds goals and figures.
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
from time import perf_counter

import cv2
import numpy as np
from bench_bounds import bounds
from bench_detectors import detectors
from bench_full_chain import full_chain
from bench_many import many
from bench_steps import Steps, circle, tracking_frames
from bench_sweeps import metrics, sweeps
from scipy import ndimage

import irsim
import irtrack
from irsim.recording.formats.folder import DatasetFolder
from irtrack import external as peers

FRAMES = 60


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
    return irsim.load("sky", ["camera.size=[640,512]", f"frames={2 * FRAMES}"])


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


class Rendering:
    """The sky example in memory, beside the plain program: least mean time of a frame so far, s. What is painted once
    for eight frames is among it; measured in rounds, as the steps of trackers are (`bench_steps`)."""

    def __init__(self) -> None:
        scenario = sky()
        self._frames, self._naive = irsim.frames(scenario), NaiveSky(scenario)
        mean_s(self._frames, 3)  # textures
        self._ours_s = self._naive_s = math.inf

    def measure(self) -> None:
        self._ours_s = min(self._ours_s, mean_s(self._frames, 8))
        self._naive_s = min(self._naive_s, mean_s(map(self._naive.frame, range(3)), 3))

    def tell(self) -> None:
        report("render_sky_640x512", 1 / self._ours_s, "frames/s")
        report("render_sky_640x512_naive_numpy", 1 / self._naive_s, "frames/s")
        report("render_sky_640x512_speedup", self._naive_s / self._ours_s, "x")


def mean_s(items: Iterator[object], count: int) -> float:
    """Mean time of the next so many, s."""
    begin = perf_counter()
    for _ in range(count):
        next(items)
    return (perf_counter() - begin) / count


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


def pictures() -> None:
    """Encode and write 8-bit PNG pictures of a data set, level 1, rendering excluded."""
    images = [frame.image for frame in irsim.open_source(sky()).frames("display", 0, 20)]
    with tempfile.TemporaryDirectory() as folder:
        writer = DatasetFolder(Path(folder))
        seconds = median_s(lambda k: writer.picture(f"{k % 20:06}.png", images[k % 20]), FRAMES)
        report("write_png_640x512", 1 / seconds, "frames/s")


def growth() -> None:
    """256 runs of 100 steps of the growth model in one array, N = 100."""
    from irtrack.papers.growth import BOOTSTRAP, WSPF, Growth, run

    model = Growth.of(256, 0)
    for name, filter in (("bootstrap", BOOTSTRAP), ("wspf", WSPF)):
        seconds = median_s(lambda k, filter=filter: run(model, filter, k), 7, 1)  # type: ignore[misc]  # mypy cannot type a lambda's default
        report(f"growth_{name}_100_particles", 1e6 * seconds / model.states.size, "us/run-step")


def others() -> None:
    """The peers that are installed, in a box of 3 times the target; wall time, with the way there and back."""
    frames, box = tracking_frames(160, 120, 14, 10), irsim.Box(*circle(0), 14, 10)
    for name in peers.offered(*peers.PEERS):
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


def detection_and_many() -> None:
    """Detectors on whole frames, trackers of many on given detections, their metrics; bounds of targets."""
    for name, milliseconds in (*detectors(), *many(), *bounds()):
        report(name, milliseconds, "ms")


def call(name: str, *words: str) -> None:
    command = [str(Path(sys.executable).with_name(name)), *words]
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)


def main() -> None:
    cv2.setNumThreads(1)
    steps, drawn = Steps(), Rendering()
    for part in (
        partial(sweeps, report),  # first: in a process as small as one that `irtrack bench` starts
        partial(full_chain, report),
        others,
        growth,
        suppression,
        recording,
        pictures,
        partial(metrics, report),
        detection_and_many,
        start_up,
        check,
    ):
        part()
        steps.measure()
        drawn.measure()
    drawn.tell()
    steps.tell(report)


if __name__ == "__main__":
    main()
