"""Bounds from measured noise: near those of the scenario, said so, and refused where there is nothing to measure."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from command_line import Run

import irsim
from irsim.recording.writer import header_of, writing

SCENE = """
frames: 40
seed: 2
camera: {size: [96, 72], netd_mk: 14, psf_px: 0.8, range_k: [270, 310]}
background: {kind: sky, horizon_k: 290, zenith_k: 285}
targets:
  - id: jet
    shape: {kind: point, contrast_k: 14}
    path: {kind: straight, start: [20, 26], speed: 1.13, heading_deg: 20, range_m: 3000}
"""


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording with truth and without its scenario."""
    rendering, path = irsim.Rendering(irsim.loads(SCENE)), tmp_path_factory.mktemp("rec") / "plain.mcap"
    with writing(path, header_of(rendering), None) as writer:
        for frame, truth in rendering.pairs():
            writer.add(frame, truth)
        writer.finish()
    return path


def test_bounds_are_near_those_of_the_scenario(plain: Path) -> None:
    found, sigma = irsim.measured_bounds(irsim.open_recording(plain))
    exact = irsim.bounds(irsim.loads(SCENE))
    assert [(row.index, row.target) for row in found] == [(row.index, row.target) for row in exact]
    for name in ("sd_x", "sd_y", "sd_x_background", "d"):
        own, true = (np.median([getattr(row, name) for row in rows]) for rows in (found, exact))
        assert own == pytest.approx(true, rel=0.12), name
    variance = irsim.Moments(irsim.loads(SCENE)).variance(0, fixed=False)
    assert sigma == pytest.approx(float(np.sqrt(np.median(variance))), rel=0.1)
    assert {field.name for field in fields(found[0])} >= {"sd_xy", "region"}


def test_the_command_says_so(plain: Path, run: Run) -> None:
    done = run("bounds", str(plain), "--frames", "0:20", cwd=plain.parent)
    assert done.returncode == 0
    assert "holds no scenario: bounds from measured noise, sigma" in done.stderr
    assert "target     jet: 20 frames, medians" in done.stdout
    refused = run("bounds", str(plain), "--clutter", cwd=plain.parent)
    assert refused.returncode == 2
    assert "holds no scenario; allowed without: --frames" in refused.stderr
    unknown = run("bounds", str(plain), "--target", "jat", cwd=plain.parent)
    assert "target: there is no 'jat'; allowed: jet" in unknown.stderr


def test_a_recording_without_truth_is_refused(footage: Path) -> None:
    with pytest.raises(irsim.InputError, match="holds no scenario and no truth; allowed: a recording with one of them"):
        irsim.measured_bounds(irsim.open_recording(footage))
