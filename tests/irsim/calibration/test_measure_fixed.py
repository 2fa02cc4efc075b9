"""Fixed pattern beside what drifts: as unsure as what the drift leaves in the mean of the frames."""

from __future__ import annotations

import numpy as np
import pytest
from intervals import held

import irsim
from irsim.measure import measure_figures
from irsim.measure.interval import Measured, without
from irsim.measure.lines import crossed

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


UPRIGHT = """
frames: 16
seed: {seed}
camera: {{size: [160, 120], noise: [{{kind: noise_3d, tvh: 1, h: {h}}}]}}
background: {{kind: {background}}}
occluders: [{{kind: bar, id: pole, center_px: [80, 60], size_px: [9, 140], range_m: 300, temperature_k: 300}}]
"""


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("background", "h", "seeds"), [("sky, horizon_k: 285, zenith_k: 250", 0.0, 3), ("ground, spread_k: 0", 0.2, 6)]
)
def test_a_pole_higher_than_the_picture_is_no_noise_of_columns(background: str, h: float, seeds: int) -> None:
    """Its edges alone would make 4 NETD of columns, and of the even ones beside the odd ones."""
    found = []
    for seed in range(seeds):
        scene = irsim.loads(UPRIGHT.format(seed=seed, h=h, background=background))
        frames = np.stack([frame.image for frame in irsim.Rendering(scene).frames()])
        figures = measure_figures(frames, scene.camera.rate_hz, passing=False)  # nothing passes
        assert figures.column is not None
        assert any(
            "all across the picture" in note and "columns are told beside them" in note for note in figures.notes
        )
        found.append(figures.column)
        assert not figures.turned
        assert figures.column.high < (h + 0.12) * scene.camera.response().noise
    if h:
        held(found, h * scene.camera.response().noise, widest=0.45)


def test_noise_alone_has_no_edges() -> None:
    for side, most in ((8, 4), (16, 4), (32, 1)):
        pictures = np.random.default_rng(side).normal(size=(500, side, side))
        assert sum(bool(crossed(picture)) for picture in pictures) <= most


def test_a_step_in_the_least_of_pictures_leaves_finite_figures() -> None:
    frames = np.random.default_rng(0).normal(1000, 4, (16, 8, 8))
    frames[:, 3:] += 100
    for name, value in measure_figures(frames, 30.0).measured():
        assert np.isfinite(value.value), name
        assert not np.isnan([value.low, value.high]).any(), name


def test_a_variance_without_a_part_of_it_is_as_unsure_as_both() -> None:
    rest = without(Measured(10.0, 7.0, 12.0), Measured(4.0, 0.0, 7.0))
    assert rest.value == 6
    assert rest.low == pytest.approx(6 - 18**0.5)
    assert rest.high == pytest.approx(6 + 20**0.5)
