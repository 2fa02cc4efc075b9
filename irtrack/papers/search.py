"""Search for settings that the papers leave open, on development seeds: `python -m irtrack.papers.search FILE`.

Every tracker is judged alike: all combinations of its open settings run on the same scenes and seeds, and the one of
least cost is chosen. The cost is the mean of min(error, threshold) / threshold over all frames, runs and scenes, with
the threshold beyond which a frame is off target, so that each frame counts from 0, on target, to 1, off target. FILE
keeps the cost of each combination (JSON); the runs are kept beside it in FILE.db, and are not repeated.
"""

from __future__ import annotations

import itertools
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from irsim.recording.output import atomic_text
from irtrack.papers.experiment import Run, Scene
from irtrack.papers.rules import bounded_share
from irtrack.papers.runs import DEVELOPMENT, SceneRuns, run_plan

SEEDS = DEVELOPMENT[:4]
SCENES = tuple(
    Scene(f"{name} search", f"sources/{name}", ("frames=100",))
    for name in ("cheng-sky", "cheng-ground", "li-aircraft", "li-pedestrian")
)
"""Scenes of the papers that state their tracker's settings only in part, their first 100 frames."""


@dataclass(frozen=True)
class Search:
    """Search over all combinations of the values of each setting of a tracker, its other settings being fixed."""

    tracker: str
    settings: Mapping[str, Sequence[float | str]]
    fixed: str = ""

    def specs(self) -> list[str]:
        """Return the tracker spec of each combination."""
        chosen = itertools.product(*self.settings.values())
        head = [self.tracker, *filter(None, [self.fixed])]
        return [
            ":".join(head + [f"{key}={value}" for key, value in zip(self.settings, each, strict=True)])
            for each in chosen
        ]


SCALES = (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 1.0)
ACCELERATIONS = (0.03, 0.1, 0.2, 0.3, 0.5, 1.0)
RATES = (0.0, 0.02, 0.05, 0.1, 0.2)
SEARCHES = {
    "grey_pf, Gaussian kernel": Search(
        "grey_pf", {"kernel_scale": SCALES, "lam": (20, 40), "alpha": (0.01, 0.02, 0.05, 0.1)}, "kernel=gaussian"
    ),
    "grey_pf, Epanechnikov kernel": Search(
        "grey_pf", {"lam": (20, 40), "alpha": (0.01, 0.02, 0.05, 0.1)}, "kernel=epanechnikov"
    ),
    "background_restrained_pf": Search(
        "background_restrained_pf", {"kernel_scale": SCALES, "lam": (20, 40)}, "kernel=gaussian"
    ),
    "kalman, centroid": Search("kalman", {"acceleration": ACCELERATIONS}, "measurement=centroid"),
    "kalman, correlation": Search("kalman", {"acceleration": ACCELERATIONS, "update": RATES}, "measurement=ncc"),
    "kalman, mean shift": Search("kalman", {"acceleration": ACCELERATIONS}, "measurement=mean_shift"),
    "ekf, centroid": Search("ekf", {"acceleration": ACCELERATIONS}, "measurement=centroid"),
    "template": Search("template", {"update": RATES}),
}


def costs(specs: Sequence[str], found: Mapping[str, SceneRuns]) -> dict[str, dict[str, Any]]:
    """Return the cost of each spec, 0 .. 1, its cost on each scene, and its number of lost runs, best first.

    A failed run costs 1.
    """
    rows = {}
    for spec in specs:
        by_scene = {name: [_cost(run) for run in each.runs[spec].values()] for name, each in found.items()}
        means = {name: round(float(np.mean(each)), 4) for name, each in by_scene.items()}
        runs = [run for each in found.values() for run in each.runs[spec].values()]
        lost = sum(run is None or run.score.lost is True for run in runs)
        rows[spec] = {"cost": round(float(np.mean(list(means.values()))), 4), "lost": lost, "runs": len(runs)} | means
    return dict(sorted(rows.items(), key=lambda row: float(row[1]["cost"])))


def _cost(run: Run | None) -> float:
    value = None if run is None else bounded_share.of(run)
    return 1.0 if value is None else value


def search(
    path: Path,
    searches: Mapping[str, Search] = SEARCHES,
    scenes: Sequence[Scene] = SCENES,
    seeds: Sequence[int] = SEEDS,
    jobs: int = 1,
) -> dict[str, Any]:
    """Run all searches, write their costs to `path`, and return them."""
    specs = {name: each.specs() for name, each in searches.items()}
    every = {spec: spec for each in specs.values() for spec in each}
    found = run_plan(dict.fromkeys(scenes, every), path.with_suffix(".db"), seeds, jobs)
    table = {
        "scenes": {scene.name: [scene.path, *scene.overrides] for scene in scenes},
        "seeds": list(seeds),
        "searches": {name: costs(each, found) for name, each in specs.items()},
    }
    with atomic_text(path) as file:
        file.write(json.dumps(table, indent=1) + "\n")
    return table


if __name__ == "__main__":
    for title, rows in search(Path(sys.argv[1]))["searches"].items():
        spec, best = next(iter(rows.items()))
        print(f"{title}: {len(rows)} evaluations, best {spec}: cost {best['cost']}, lost {best['lost']}")
