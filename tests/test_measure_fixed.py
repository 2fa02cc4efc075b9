"""Fixed pattern beside what drifts: as unsure as what the drift leaves in the mean of the frames."""

from __future__ import annotations

import pytest

import irsim
from irsim.measure.interval import Measured, without

SCENE = """
frames: 100
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


def test_a_fit_beside_strong_drift_agrees_with_what_went_in_and_with_a_fit_of_its_own_renders() -> None:
    for seed in range(4):
        scene = irsim.loads(SCENE.format(seed=seed))
        netd = scene.camera.response().noise
        fitted = irsim.fit(scene)
        again = irsim.fit(irsim.loads(fitted.text, overrides=[f"seed={seed + 100}"]))
        for name, ratio in (("pixel", 1.0), ("row", 0.3), ("column", 0.3)):
            first, second = getattr(fitted.figures, name), getattr(again.figures, name)
            assert first.low <= ratio * netd <= first.high
            assert first.low <= second.high
            assert second.low <= first.high


def test_a_variance_without_a_part_of_it_is_as_unsure_as_both() -> None:
    rest = without(Measured(10.0, 7.0, 12.0), Measured(4.0, 0.0, 7.0))
    assert rest.value == 6
    assert rest.low == pytest.approx(6 - 18**0.5)
    assert rest.high == pytest.approx(6 + 20**0.5)
