"""Fixed pattern beside what drifts: as unsure as what the drift leaves in the mean of the frames."""

from __future__ import annotations

import pytest

import irsim
from irsim.measure.interval import Measured, without

SCENE = """
frames: 40
seed: {seed}
camera:
  size: [128, 96]
  range_k: [270, 320]
  netd_mk: 60
  noise:
    - {{kind: white}}
    - {{kind: fixed_pattern, pixel: 1.0, row: 0.3, column: 0.3}}
    - {{kind: drift, pixel: 4, row: 0, column: 0, time_constant_s: 60}}
background: {{kind: ground, spread_k: 0}}
"""


def test_fixed_pattern_beside_strong_drift_is_in_its_interval() -> None:
    held = {"pixel": 0, "row": 0, "column": 0}
    for seed in range(6):
        scene = irsim.loads(SCENE.format(seed=seed))
        netd = scene.camera.response().noise
        figures = dict(irsim.fit(scene).figures.measured())
        for name, ratio in (("pixel", 1.0), ("row", 0.3), ("column", 0.3)):
            held[name] += figures[name].low <= ratio * netd <= figures[name].high
    assert min(held.values()) >= 5


def test_a_variance_without_a_part_of_it_is_as_unsure_as_both() -> None:
    rest = without(Measured(10.0, 7.0, 12.0), Measured(4.0, 0.0, 7.0))
    assert rest.value == 6
    assert rest.low == pytest.approx(6 - 18**0.5)
    assert rest.high == pytest.approx(6 + 20**0.5)
