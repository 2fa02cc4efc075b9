"""No shipped detector lies above the ideal matched filter on flat ground."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

import irsim
from irtrack.detectors import DETECTORS, FilterDetector, make_detector
from irtrack.metrics.ceiling import Ceiling
from irtrack.metrics.detection import DetectionFigures
from irtrack.replay.many import run_detector

SCENE = """
frames: 60
camera: {size: [128, 96], psf_px: 0.8, elevation_deg: -30, netd_mk: 100, noise: [{kind: white}]}
background: {kind: ground, spread_k: 0.05}
targets:
"""
TARGET = "  - {{id: t{0}, shape: {{kind: point, contrast_k: {2}}}, path: {{kind: straight, start: {1}, speed: 0.3}}}}\n"
PLACES = ([20.2, 20.4], [64.5, 24.1], [100.8, 18.3], [24.6, 70.9], [60.3, 66.6], [96.1, 72.5])
RATES = np.array([0.1, 1.0, 10.0])
SEEDS = 3


@pytest.fixture(scope="module", params=[2.0, 2.7], ids=["faint", "clear"])
def scenes(request: pytest.FixtureRequest) -> list[tuple[irsim.Rendering, Ceiling]]:
    """Return scenes of six points in ground without much structure, and their ceilings."""
    text = SCENE + "".join(TARGET.format(k, place, request.param) for k, place in enumerate(PLACES))
    sources = [irsim.Rendering(irsim.loads(text, [f"seed={seed}"])) for seed in range(SEEDS)]
    return [(each, Ceiling.of(each.scenario, list(each.truths()))) for each in sources]


def shares(name: str, source: irsim.Rendering) -> np.ndarray:
    """Return the probability of detection of a detector with a low threshold at `RATES`."""
    detector = make_detector(name, {"threshold": 1.5, "most": 2000})
    figures = DetectionFigures.of(list(source.truths()), run_detector(detector, source, input="counts"), 30.0)
    return np.array([figures.pd_at(rate) for rate in RATES])


def test_no_detector_is_above_the_ceiling(scenes: list[tuple[irsim.Rendering, Ceiling]]) -> None:
    """By 3 standard errors of a share of 1,080 looks; the best detector has a third of the ceiling or more."""
    ceiling = np.mean([each.pd_at(RATES) for _, each in scenes], axis=0)
    looks = SEEDS * 60 * len(PLACES)
    assert 0.02 < ceiling[0] < 0.98
    best = np.zeros(len(RATES))
    for name, kind in DETECTORS.items():
        if issubclass(kind, FilterDetector):
            found = np.mean([shares(name, source) for source, _ in scenes], axis=0)
            print(f"{name:16} {found.round(3)} ceiling {ceiling.round(3)}")
            error = np.array([sqrt(max(pd * (1 - pd), 1 / looks) / looks) for pd in ceiling])
            assert (found <= ceiling + 3 * error).all(), name
            best = np.maximum(best, found)
    assert (best > 0.3 * ceiling).all()
