"""Runs of an artificial tracker on a still target, for the tests of the papers' page."""

from __future__ import annotations

import numpy as np

import irsim
import irtrack
from irtrack.metrics import Reference, Trace, score_trace
from irtrack.metrics.attributes import ATTRIBUTES
from irtrack.papers.experiment import Run
from irtrack.papers.runs import SceneRuns

TINY = """
about: a spot
frames: 14
camera: {size: [64, 48]}
background: {kind: ground, spread_k: 0.2}
targets:
  - id: dot
    shape: {kind: hot_spot, size_m: [4, 3], temperature_k: 330}
    path: {kind: straight, start: [20, 20], speed: 1}
"""


def run_at(offset: float, statuses: str = "tracking", frames: int = 30, visible: np.ndarray | None = None) -> Run:
    """A track that is `offset` px to the right of a still target, from the frame after the start on."""
    indices = np.arange(frames)
    truth = Reference(
        indices,
        np.full((frames, 2), 50.0),
        np.full((frames, 2), 6.0),
        np.ones(frames) if visible is None else visible,
        np.zeros(frames),
        np.zeros((frames, len(ATTRIBUTES)), dtype=bool),
    )
    estimates = [irtrack.Estimate((50.0 + offset * (k > 0), 50.0), (6, 6), statuses, 0.5) for k in indices]
    track = irtrack.Track(
        source="s",
        source_hash="h",
        tracker="t",
        config={},
        target="dot",
        start=0,
        start_box=irsim.Box(50, 50, 6, 6),
        input="display",
        scene_seed=0,
        tracker_seed=0,
        indices=indices,
        times=indices / 25,
        estimates=tuple(estimates),
        step_ms=np.full(frames, 2.0),
        cpu_ms=np.full(frames, 2.0),
    )
    trace = Trace.of(track, truth)
    return Run(score_trace(trace), trace)


def runs_of(scene: str, **runs: list[Run | None]) -> dict[str, SceneRuns]:
    source = irsim.Rendering(irsim.loads(TINY), scene)
    return {scene: SceneRuns(source, {label: dict(enumerate(each)) for label, each in runs.items()}, {})}
