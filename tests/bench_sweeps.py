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

        def sweep(cells: int, jobs: int = 1) -> tuple[float, float]:
            """(CPU time of this process, s; cells a second, from the first that is done)."""
            times: list[float] = []
            begin = process_time()
            with irtrack.run_bench(
                [clip],
                [Sleeper],
                results=Path(folder, f"{cells}-{jobs}.db"),
                seeds=cells,
                jobs=jobs,
                seen=lambda _: times.append(perf_counter()),
            ):
                pass
            return process_time() - begin, (len(times) - 1) / (times[-1] - times[0])

        sweep(FEW)  # what is imported on first use
        more, one = sweep(CELLS)
        less, _ = sweep(FEW + 1)
        report("bench_added_to_50_ms_cells", 100 * (more - less) / (CELLS - FEW - 1) / CELL_S, "%")
        report("bench_wall_added_to_50_ms_cells", 100 * (1 / one / CELL_S - 1), "%")
        report("bench_two_workers_speedup", sweep(CELLS, 2)[1] / one, "x")


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
