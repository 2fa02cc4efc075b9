"""The stress scenarios: severity 0 is benign, and every step makes its cause worse, by truth."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import irsim
from irsim.config.yaml_text import read_yaml
from irsim.scenario.catalog import shipped
from irsim.types import Floats
from irtrack.bench import run_bench

STRESSES = {name: path for name, path in shipped("stress").items() if "severities" in read_yaml(path).value}
SEVERITIES = range(6)
BENIGN_SEEDS = 3
TRACKERS = ["grey_pf", "template", "kalman"]


@lru_cache
def at(name: str, severity: int) -> irsim.Rendering:
    return irsim.Rendering(irsim.load(f"stress/{name}", [f"severity={severity}"]), name)


@lru_cache
def seen(rendering: irsim.Rendering) -> tuple[irsim.TargetTruth, ...]:
    """The followed target's truths."""
    truths = [truth.target(rendering.follow or "") for truth in rendering.truths()]
    return tuple(truth for truth in truths if truth is not None)


def centers(rendering: irsim.Rendering) -> Floats:
    return np.array([truth.center for truth in seen(rendering)])


def hidden(rendering: irsim.Rendering) -> float:
    """Frames' worth of the target that cannot be seen."""
    return sum(1 - (truth.visible or 0) for truth in seen(rendering))


def first_scr(rendering: irsim.Rendering) -> float:
    return -(seen(rendering)[0].scr or 0)


def noise(rendering: irsim.Rendering) -> float:
    """Standard deviation of the change from one frame to the next, counts."""
    first, second = (rendering.frame(k).image.astype(float) for k in (0, 1))
    return float(np.std(second - first))


def spread(rendering: irsim.Rendering) -> float:
    """Standard deviation over the first picture, counts: false targets differ from the ground as the target does."""
    return float(np.std(rendering.frame(0).image.astype(float)))


def turning(rendering: irsim.Rendering) -> float:
    """Mean change of direction from frame to frame, rad."""
    steps = np.diff(centers(rendering), axis=0)
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    return float(np.abs(np.diff(heading)).mean())


def shaking(rendering: irsim.Rendering) -> float:
    """Root mean square of what the target's way in the picture has that no smooth way has, px."""
    way = centers(rendering)
    return float(np.sqrt(np.mean(np.diff(way, 2, axis=0) ** 2)))


def deforming(rendering: irsim.Rendering) -> float:
    """Mean change of the box's width from frame to frame, px."""
    return float(np.abs(np.diff([truth.box.w for truth in seen(rendering)])).mean())


def beside(rendering: irsim.Rendering) -> float:
    """Frames in which another target's box meets it."""
    return sum(bool(truth.crossing) for truth in seen(rendering))


def missing(rendering: irsim.Rendering) -> float:
    return float(rendering.scenario.frames - len(rendering))


CAUSES: dict[str, Callable[[irsim.Rendering], float]] = {
    "noise": noise,
    "clutter": spread,
    "scr": first_scr,
    "occlusion": hidden,
    "occlusion-length": hidden,
    "occlusion-fraction": hidden,
    "manoeuvre": turning,
    "crossing": beside,
    "deformation": deforming,
    "jitter": shaking,
    "drops": missing,
}


def test_every_stress_has_its_cause_measured() -> None:
    assert STRESSES.keys() == CAUSES.keys()


@pytest.mark.sampled
@pytest.mark.parametrize("name", STRESSES)
def test_every_severity_makes_its_cause_worse(name: str) -> None:
    measured = [CAUSES[name](at(name, severity)) for severity in SEVERITIES]
    assert all(worse > better for better, worse in pairwise(measured)), measured


def test_what_the_files_say_in_numbers_is_so() -> None:
    for name in ("occlusion", "occlusion-length", "occlusion-fraction"):
        assert hidden(at(name, 0)) == pytest.approx(0, abs=1e-3)
    assert beside(at("crossing", 0)) == missing(at("drops", 0)) == 0
    for severity, (length, fraction) in enumerate([(5, 0.5), (10, 0.8), (15, 1), (30, 1), (50, 1)], 1):
        assert_hidden("occlusion", severity, length, fraction)
    for severity, length in enumerate([5, 10, 20, 35, 50], 1):
        assert_hidden("occlusion-length", severity, length, 0.9)
    for severity, fraction in enumerate([0.4, 0.6, 0.8, 0.9, 1], 1):
        assert_hidden("occlusion-fraction", severity, 35, fraction)
    for severity, scr in enumerate([40, 16, 9, 6, 4, 2]):
        assert -first_scr(at("scr", severity)) == pytest.approx(scr, rel=0.05)
    for severity, rms in enumerate([0, 0.5, 1, 2, 4, 8]):
        still, shaken = centers(at("jitter", 0)), centers(at("jitter", severity))
        assert np.std(shaken - still) == pytest.approx(rms, rel=0.35)  # 110 frames of 0.1 s memory
    for severity, share in enumerate([0, 0.15, 0.3, 0.45, 0.6, 0.75]):
        assert missing(at("drops", severity)) / 110 == pytest.approx(share, abs=3 * (share * (1 - share) / 110) ** 0.5)


def assert_hidden(name: str, severity: int, length: int, fraction: float) -> None:
    """From frame 40 on for so many frames at least that fraction of the target is hidden."""
    truths = seen(at(name, severity))[40 : 40 + length]
    assert all(1 - (truth.visible or 0) >= fraction - 0.01 for truth in truths)


def test_length_and_fraction_of_occlusion_are_one_scene() -> None:
    """So that severities of the one with values of the other make a grid: nine tenths for 35 frames is in both."""
    assert at("occlusion-length", 4).scenario.hash == at("occlusion-fraction", 4).scenario.hash
    assert at("occlusion-length", 0).frame(60).image.tobytes() == at("occlusion-fraction", 0).frame(60).image.tobytes()


@pytest.mark.parametrize("name", STRESSES)
def test_only_the_cause_differs(name: str) -> None:
    """A severity is its values in the table, and nothing else."""
    scenario = at(name, 4).scenario
    changed = irsim.change(irsim.load(f"stress/{name}"), {k: v[4] for k, v in scenario.severities.items()})
    assert changed.hash == scenario.hash


@pytest.mark.parametrize("name", STRESSES)
def test_the_target_is_in_view_from_first_to_last(name: str) -> None:
    for severity in (0, 5):
        truths = seen(at(name, severity))
        assert truths[0].visible == pytest.approx(1, abs=0.01) or name == "crossing"
        assert all(truth.in_view for truth in truths)


@pytest.mark.slow
def test_severity_0_is_easy(tmp_path: Path) -> None:
    """These trackers, which know little, hold it whatever the seed."""
    names = [f"stress/{name}" for name in STRESSES]
    results = run_bench(names, TRACKERS, results=tmp_path / "benign.db", seeds=BENIGN_SEEDS, jobs=2)
    cells = results.cells()
    assert len(cells) == len(names) * len(TRACKERS) * BENIGN_SEEDS
    assert not [(cell.source, cell.label) for cell in cells if cell.score is None or cell.score.lost]
