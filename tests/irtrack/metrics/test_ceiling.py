"""The ceiling of detectors: by hand, and which sources have one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

import irsim
from irtrack.metrics.ceiling import MOST_FRAMES, Ceiling, has_ceiling

SCENE = """
frames: 70
camera: {size: [64, 48], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - {id: a, shape: {kind: point, scr: 4}, path: {kind: straight, start: [20, 30], speed: 0.1, range_m: 3000}}
"""


def test_pd_is_that_of_a_disc_with_one_test() -> None:
    """Two targets, of d 0 and 3: chance, and Kay's formula, at the share of discs that hold a false alarm."""
    ceiling = Ceiling(np.array([0.0, 9.0]), np.array([0.01, 0.02]))
    expected = (0.01 + norm.sf(norm.isf(0.02) - 3)) / 2
    np.testing.assert_allclose(ceiling.pd_at(np.array([0.0, 1.0, 1e4])), [0, expected, 1])
    figures = ceiling.figures()
    assert figures["pd_1"] == pytest.approx(expected)
    assert figures["pd"] is figures["false_alarms"] is None


def test_a_run_samples_its_frames() -> None:
    source = irsim.Rendering(irsim.loads(SCENE))
    ceiling = Ceiling.of(source.scenario, list(source.truths()))
    assert MOST_FRAMES / 2 < len(ceiling.d2) <= MOST_FRAMES
    np.testing.assert_allclose(ceiling.share, np.pi * 9 / (64 * 48))
    assert (ceiling.d2 > 1).all()


def test_rendered_scenes_with_targets_have_a_ceiling() -> None:
    assert has_ceiling(irsim.Rendering(irsim.loads(SCENE)))
    assert not has_ceiling(irsim.Rendering(irsim.loads(SCENE.partition("targets:")[0])))
    assert not has_ceiling(object())
