"""Speed of the whole chain beside a plain numpy program of the same content: part of `make bench`.

Two evolving cloud layers, five bodies and every kind of noise, 640x512. CPU time, not wall time: other
programs on the machine do not count.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from scipy import ndimage

import irsim
import irsim._native
from irsim.render.frame import Renderer

SCENARIO = Path(__file__).with_name("full_chain.yaml")
FRAMES = 250
"""Two states of the nearer clouds are painted for so many."""
ROUNDS = 5
"""Each speed is taken so often, in turns: the least time is the program's own, what others do on the machine adds to it
(as the documentation of Python's timeit says). The medians tell how much that was."""
LONG = 10_000
"""Frames over which memory is watched."""
LOOPS = 1_000_000
"""Turns of a loop, some 50 ms."""
SMALL = ("camera.size=[320,240]",)
"""The middle of the picture, where two of the five bodies come by. The truth of the others is worked out too."""
HALVED = (
    *SMALL,
    "camera.ifov_mrad=0.3",
    "targets.jet.path.points=[[30,47],[160,122],[290,75]]",
    "targets.jet.path.speed=0.8",
    "targets.liner.path.start=[50,188]",
    "targets.liner.path.speed=0.6",
    "targets.heli.path.start=[250,164]",
    "targets.heli.path.speed=0.6",
    "targets.drone.path.start=[50,117]",
    "targets.drone.path.speed=0.75",
    "targets.drone.path.amplitude_px=10",
    "targets.gull.path.start=[200,47]",
    "targets.gull.path.speed=0.5",
)
"""The whole picture on as few pixels: all five bodies in it, half as large."""

Report = Callable[[str, float, str], None]


class NaiveChain:
    """The same frames the plain way: whole float64 arrays, one operation after another, nothing kept."""

    def __init__(self, columns: int, rows: int) -> None:
        self.rng = np.random.default_rng(0)
        self.shape = rows, columns
        self.states = [[self._cloud() for _ in range(4)] for _ in range(2)]
        self.gradient = np.repeat(np.linspace(1.0, 2.0, rows)[:, None], columns, axis=1)
        self.fixed, self.gain, self.drift = (0.01 * self.rng.standard_normal(self.shape) for _ in range(3))
        self.memory = np.zeros(self.shape)

    def _cloud(self) -> np.ndarray:
        return np.asarray(ndimage.gaussian_filter(self.rng.random(self.shape), 8, mode="wrap"))

    def frame(self, k: int) -> np.ndarray:
        image = self.gradient.copy()
        share = (k % 100) / 100
        for early_t, late_t, early_e, late_e in self.states:
            shift = (0.1 * k, 0.3 * k)
            passed = ndimage.shift((1 - share) * early_t + share * late_t, shift, order=1, mode="grid-wrap")
            light = ndimage.shift((1 - share) * early_e + share * late_e, shift, order=1, mode="grid-wrap")
            image = image * passed + light
        for body in range(5):
            self._draw(image, 40 + 100 * body, 60 + 70 * body + k)
        return self._detect(1e6 * np.clip(image, 0, 4))

    def _draw(self, image: np.ndarray, row: int, column: int) -> None:
        """Fifteen convex parts of four edges, nine samples a pixel, then the blur."""
        y, x = (np.mgrid[:144, :144] + 0.5) / 3
        cover = np.zeros((144, 144))
        for part in range(15):
            inside = np.ones_like(cover, dtype=bool)
            for angle in part + np.arange(4) * np.pi / 2:
                inside &= (x - 24 - part) * np.cos(angle) + (y - 24) * np.sin(angle) < 6
            cover = np.where(inside, 1 + part / 15, cover)
        soft = ndimage.gaussian_filter(cover.reshape(48, 3, 48, 3).mean(axis=(1, 3)), 0.5)
        patch = image[row : row + 48, column : column + 48]
        patch += soft[: patch.shape[0], : patch.shape[1]]

    def _detect(self, signal: np.ndarray) -> np.ndarray:
        normal, (rows, columns) = self.rng.standard_normal, self.shape
        signal = signal * (1 + 0.001 * self.gain)
        signal = signal + np.sqrt(signal + 400.0**2) * normal(self.shape)  # shot and read
        self.memory = 0.98 * self.memory + 0.2 * normal(self.shape)  # AR(1)
        signal = signal + 1e3 * (self.memory + self.fixed + self.drift)
        signal = signal + 1e3 * (0.2 * normal() + 0.2 * normal((rows, 1)) + 0.2 * normal((1, columns)))
        signal = signal + 1e3 * normal(self.shape)  # tvh
        signal = signal + np.where(np.arange(rows) % 2, 200.0, -200.0)[:, None]  # odd and even rows
        counts: np.ndarray = np.clip(np.round(signal / 427), 0, 2**14 - 1)
        return counts.astype(np.uint16)


def cpu_s(step: Callable[[int], object], count: int = FRAMES, warm_up: int = 8) -> float:
    """Mean CPU time of step(k), s: what is drawn once for many frames counts; the first calls do not."""
    for k in range(warm_up):
        step(k)
    begin = process_time()
    for k in range(warm_up, warm_up + count):
        step(k)
    return (process_time() - begin) / count


def full_chain(report: Report) -> None:
    scenario = irsim.load(str(SCENARIO))
    begin = process_time()
    renderer = Renderer(scenario)
    renderer.frame(0)
    report("full_chain_640x512_first_frame", process_time() - begin, "s")
    changed = {"320x240": SMALL, "320x240_five_in_view": HALVED}
    renderers = {"640x512": renderer, **{name: Renderer(irsim.load(str(SCENARIO), of)) for name, of in changed.items()}}
    takes = {name: partial(cpu_s, each.frame) for name, each in renderers.items()}
    takes["640x512_naive_numpy"] = partial(cpu_s, NaiveChain(*scenario.camera.size).frame, 10, 1)
    rounds = [{name: take() for name, take in takes.items()} for _ in range(ROUNDS)]
    least, middle = ({name: how([each[name] for each in rounds]) for name in takes} for how in (min, statistics.median))
    for name in takes:
        report(f"full_chain_{name}", 1 / least[name], "frames/s of one core")
        report(f"full_chain_{name}_median", 1 / middle[name], f"frames/s of one core, the median of {ROUNDS} rounds")
    whole = least["640x512"]
    report("full_chain_640x512_speedup", least["640x512_naive_numpy"] / whole, "x")
    if irsim._native.COMPILED:
        plain = plain_s()
        report("full_chain_640x512_compiled_speedup", plain / whole, "x the same without compiled loops")
    for name, seconds in stages(renderer):
        report(f"full_chain_640x512_share_of_{name}", 100 * seconds / whole, "%")
    recorded(report)
    by_two(report)
    memory(report)


def plain_s() -> float:
    """CPU time of a frame without compiled loops, s: in a program of its own."""
    environment = {**os.environ, "IRSIM_PLAIN": "1"}
    return float(subprocess.run([sys.executable, __file__], env=environment, stdout=subprocess.PIPE, check=True).stdout)


def stages(renderer: Renderer) -> Iterator[tuple[str, float]]:
    """Name and CPU time, s, of the parts of a frame."""
    bodies = cpu_s(lambda k: list(renderer.pieces(k)))
    scene = cpu_s(renderer.scene)
    lights = [renderer.light(k) for k in range(4)]
    yield "bodies", bodies
    yield "backgrounds_and_truth", scene - bodies
    copying = cpu_s(lambda k: lights[k % 4].copy())
    yield "detector", cpu_s(lambda k: renderer.sensor.expose(lights[k % 4].copy(), k, spent=True)) - copying


def recorded(report: Report) -> None:
    source = irsim.open_source(irsim.load(str(SCENARIO), [f"frames={FRAMES}"]))
    source.frame(0)
    took = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(ROUNDS):
            begin = process_time()
            irsim.record(source, Path(folder) / f"{number}.mcap")
            took.append(process_time() - begin)
    report("full_chain_640x512_recorded", len(source) / min(took), "frames/s of one core")


def by_two(report: Report) -> None:
    """Wall time of one process over that of two, without the file. Beside it, how far the machine has two cores: the
    same of two programs that share nothing, and of two loops that touch no memory, which two threads of one core do no
    faster than one. Speed changes from second to second, on both cores alike or on one: of each its best turn is told,
    as of speeds, and the median of what turns next to each other gave."""
    turns, timed, ahead = 10, 512, 320  # ahead: more than the workers' queues, which they filled during other turns
    started = 64  # by then the workers have
    frames = started + (turns + 1) * (ahead + timed)
    scenario = irsim.load(str(SCENARIO), [f"frames={frames}"])
    one, two = (irsim.frames(scenario, jobs=jobs) for jobs in (1, 2))

    def took(step: Callable[[int], None], count: int, before: int) -> float:
        step(before)
        begin = perf_counter()
        step(count)
        return perf_counter() - begin

    with two_programs(frames) as programs:
        pass_over(two, started)
        rendered = partial(pass_over, one), partial(pass_over, two), partial(together, programs, "frames")
        looped = partial(together, programs[:1], "loop"), partial(together, programs, "loop")
        times = np.array(
            [
                [took(step, timed, ahead) for step in rendered] + [took(step, LOOPS, 1) for step in looped]
                for _ in range(turns)
            ]
        )
    alone, by_both, by_programs, loop, loops = times.T
    for name, slower, faster, unit in (
        ("full_chain_640x512_two_processes", alone, by_both, "x one"),
        ("full_chain_640x512_two_programs", alone, by_programs, "x one, of programs that share nothing"),
        ("two_loops", loop, loops, "x one"),
    ):
        report(name, float(slower.min() / faster.min()), unit)
        report(f"{name}_median", float(np.median(slower / faster)), f"{unit}, the median of {turns} turns")


@contextmanager
def two_programs(frames: int) -> Iterator[Sequence[Connection]]:
    """Two programs that each render so many frames of their own, or loop, as they are asked to (`together`)."""
    context = multiprocessing.get_context("spawn")
    pipes = [context.Pipe() for _ in range(2)]
    running = [context.Process(target=program, args=(theirs, frames)) for _, theirs in pipes]
    for process in running:
        process.start()
    programs = [ours for ours, _ in pipes]
    try:
        together(programs, "frames", 16)  # they have begun
        yield programs
    finally:
        for process in running:
            process.kill()
            process.join()


def together(programs: Sequence[Connection], what: str, count: int) -> None:
    """Programs do so much, each its share, at the same time."""
    for each in programs:
        each.send((what, count // len(programs)))
    for each in programs:
        each.recv()


def program(asked: Connection, frames: int) -> None:
    rendered = irsim.frames(irsim.load(str(SCENARIO), [f"frames={frames}"]))
    works: dict[str, Callable[[int], None]] = {"frames": partial(pass_over, rendered), "loop": loop}
    while True:
        what, count = asked.recv()
        works[what](count)
        asked.send(None)


def loop(count: int) -> None:
    """Sums that stay in the processor's own registers and nearest cache."""
    total = 0
    for k in range(count):
        total += k * k & 255


def pass_over(frames: Iterator[object], count: int) -> None:
    for _ in range(count):
        next(frames)


def memory(report: Report) -> None:
    """What the process grows by, after its first third, over LONG frames."""
    scenario = irsim.load(str(SCENARIO), ["camera.size=[160,120]", f"frames={LONG}"])
    peaks = []
    for k, _ in enumerate(irsim.frames(scenario)):
        if k in (LONG // 3, LONG - 1):
            peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    report(f"full_chain_160x120_growth_over_{LONG}_frames", (peaks[1] - peaks[0]) / 1024, "MB")


if __name__ == "__main__":
    print(cpu_s(Renderer(irsim.load(str(SCENARIO))).frame))
