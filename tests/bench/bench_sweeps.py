"""What a bench adds to the trackers' own time, and what a second worker brings: part of `make bench`.

The tracker sleeps, so that other programs on the machine hardly count.
"""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time, sleep
from typing import Any

from recording_fakes import Noise

import irsim
import irtrack
from irtrack.metrics import Reference, score

CELLS, FEW = 60, 10
CELL_S = 0.05

Report = Callable[[str, float, str], None]


class Sleeper:
    """A tracker whose one step takes CELL_S and no work."""

    def start(self, frame: Any, box: Any) -> None:
        self.box = box

    def step(self, frame: Any) -> Any:
        sleep(CELL_S)
        return self.box


def sweeps(report: Report) -> None:
    with tempfile.TemporaryDirectory() as folder:
        clip = Path(folder, "clip.mcap")
        irsim.record(Noise(count=2), clip)

        def sweep(cells: int, jobs: int = 1) -> tuple[float, float, float]:
            """Per cell, from the first that is done: (wall time, CPU time of this process, time in the tracker), s."""
            done: list[tuple[float, float]] = []
            with irtrack.run_bench(
                [clip],
                [Sleeper],
                results=Path(folder, f"{cells}-{jobs}.db"),
                seeds=cells,
                jobs=jobs,
                seen=lambda _: done.append((perf_counter(), process_time())),
            ) as results:
                steps_ms = [cell.score.ms_mean for cell in results.cells() if cell.score and cell.score.ms_mean]
            wall, cpu = ((last - first) / (cells - 1) for first, last in zip(done[0], done[-1], strict=True))
            return wall, cpu, statistics.fmean(steps_ms) / 1e3

        sweep(FEW)  # what is imported on first use
        wall, cpu, asleep = sweep(CELLS)
        report("bench_added_to_50_ms_cells", 100 * cpu / CELL_S, "%")
        report("bench_wall_added_to_50_ms_cells", 100 * (wall - asleep) / CELL_S, "%")
        report("bench_two_workers_speedup", wall / sweep(CELLS, 2)[0], "x")


def metrics(report: Report) -> None:
    frames = 10_000
    track = irtrack.run("template", Noise(count=frames))
    truths = list(Noise(count=frames).truths())
    times = []
    for _ in range(7):
        reference = Reference.of(truths, track.target)
        begin = process_time()
        score(track, reference)
        times.append(process_time() - begin)
    report("metrics_of_10000_frames", 1e3 * statistics.median(times), "ms")
