"""Noise of real sensors is told from noise that no camera has, and from that of other sorts."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

import irsim
from irsim.cli.app import app
from irsim.errors import InputError
from irsim.measure import (
    CAMERAS,
    Figures,
    Measured,
    judge_sorts,
    measure_figures,
    noise_figures,
)
from irsim.types import Floats

REAL = Path(__file__).resolve().parents[4] / "shared" / "real"
real = pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")

PRESET = """\
frames: 100
camera: {preset: PRESET, size: [128, 96]}
background: {kind: ground, spread_k: 0}
"""


@pytest.mark.sampled
@real
@pytest.mark.parametrize(
    ("name", "rate_hz", "sort"),
    [("raw14_lwir", 30.0, "cooled"), ("raw14_mwir", 30.0, "uncorrected"), ("raw16_lepton", 9.0, "uncooled")],
)
def test_real_sensors_are_of_their_sort_alone(name: str, rate_hz: float, sort: str) -> None:
    with np.load(REAL / name / "frames.npz") as file:
        assert judge_sorts(measure_figures(file["frames"], rate_hz)).fitting == (sort,)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("preset", "sort"), [("cooled_mwir", "cooled"), ("cooled_lwir", "cooled"), ("uncooled_lwir", "uncooled")]
)
def test_presets_are_of_their_sort_alone(preset: str, sort: str) -> None:
    scene = irsim.Rendering(irsim.loads(PRESET.replace("PRESET", preset)))
    figures = measure_figures(np.stack([frame.image for frame in scene.frames()]), scene.rate_hz)
    judged = judge_sorts(figures, sort)
    assert [v for v in judged.verdicts if not v.inside and v.figure != "level"] == []
    assert not set(judged.fitting) - {sort}


@pytest.mark.sampled
@pytest.mark.parametrize("blur", [0.0, 1.0, 2.0])
def test_white_and_blurred_noise_is_that_of_no_camera(blur: float) -> None:
    rng = np.random.default_rng(0)

    def frame() -> Floats:
        noise = rng.normal(0, 20, (96, 128))
        return np.asarray(cv2.GaussianBlur(noise, (0, 0), blur) if blur else noise)

    figures = measure_figures(np.stack([1000 + frame() for _ in range(60)]), 30.0)
    assert judge_sorts(figures).fitting == ()


def test_the_command_compares_noise(tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(PRESET.replace("PRESET", "uncooled_lwir"))
    good = CliRunner().invoke(app, ["realism", str(scene), "--camera", "uncooled", "--json"])
    assert good.exit_code == 0, good.output
    assert json.loads(good.stdout)["cameras"] == ["uncooled"]
    bad = CliRunner().invoke(app, ["realism", str(scene), "--camera", "cooled"])
    assert bad.exit_code == 1
    assert "its noise is like: uncooled" in bad.stdout
    none = CliRunner().invoke(app, ["realism", str(scene), "--camera", "cheap"])
    assert isinstance(none.exception, InputError)
    assert f"allowed: {', '.join(CAMERAS)}" in str(none.exception)


def test_without_a_sort_noise_is_compared_with_all_and_status_is_0(tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(PRESET.replace("PRESET", "uncooled_lwir"))
    told = CliRunner().invoke(app, ["realism", str(scene), "frames=100"])
    assert told.exit_code == 0, told.output
    assert "looks like: no class of real recordings" in told.stdout
    assert "its noise is like: uncooled" in told.stdout
    (kept,) = [line for line in told.stdout.splitlines() if line.startswith("  not cooled: ")]
    assert "correlation" in kept
    assert "(allowed -0.05 to 0.05)" in kept
    assert "  not uncooled" not in told.stdout
    found = json.loads(CliRunner().invoke(app, ["realism", str(scene), "frames=100", "--json"]).stdout)
    assert found["cameras"] == ["uncooled"]
    value, low, high = found["correlation"]
    assert 0.5 < low < value < high < 1
    assert "correlation" in found["outside"]["cooled"]
    assert "uncooled" not in found["outside"]


def test_where_a_scene_moves_the_picture_is_judged_all_the_same() -> None:
    moving = ["realism", "clouds", "frames=12", "--like", "cloud"]
    why = "its noise cannot be judged, for the scene moves; allowed: a still camera"
    alone = CliRunner().invoke(app, moving)
    assert alone.exit_code == 0, alone.output
    assert alone.stdout.splitlines()[-2:] == ["looks like: cloud", why]
    for form in ([], ["--json"]):
        asked = CliRunner().invoke(app, [*moving, "--camera", "cooled", *form])
        assert isinstance(asked.exception, InputError)
        assert str(asked.exception) == f"clouds: {why}"
        assert asked.stdout == ""
    with pytest.raises(InputError, match=why):
        irsim.measure_realism(irsim.open_source("clouds", ["frames=12"]), camera="cooled")
    assert json.loads(CliRunner().invoke(app, [*moving, "--json"]).stdout)["noise_unknown"] == why


def white() -> Figures:
    """Figures of white noise."""
    return measure_figures(np.random.default_rng(1).normal(100, 1, (20, 32, 32)).round().astype(np.uint16), 30.0)


def test_an_interval_of_no_width_says_what_that_means() -> None:
    """Rows that are known to better than is printed, and a memory that was not found, so that none is told."""
    one, none = Measured(1.0, 1.0, 1.0), Measured(0.0, 0.0, 0.0)
    close = Measured(3.0, 2.999, 3.001)
    figures = replace(white(), memory=None, memory_frames=None, noise=one, row=none, even_rows=close)
    lines = list(judge_sorts(figures).lines("like", "none"))
    assert lines[0] == "figure      measured  95 % interval (all but correlation: in units of a pixel's noise)"
    assert lines[1] == "correlation     0.00  none: taken for this, for nothing else was found"
    assert "row             3.00  known to better than 0.01" in lines


def test_the_interval_of_rows_holds_that_of_what_even_rows_lie_above_odd_ones() -> None:
    """sqrt(3^2 + 4^2) is 5, and from below 0 to above it the least is the rows' own."""
    figures = replace(white(), noise=Measured(1.0, 1.0, 1.0), row=Measured(3.0, 2.0, 5.0))
    told = [
        noise_figures(replace(figures, even_rows=even))["row"]
        for even in (Measured(-4.0, -12.0, -1.5), Measured(-4.0, -12.0, 1.5), None)
    ]
    assert [(row.value, row.low, row.high) for row in told] == [(5.0, 2.5, 13.0), (5.0, 2.0, 13.0), (3.0, 2.0, 5.0)]


def test_a_correlation_is_never_more_than_all_of_it() -> None:
    """Of a share of the noise that may be all, less what it forgets in a frame; it was told from 0.63 to 1.09."""
    memory, frames, alone = Measured(2.15, 1.77, 2.34), Measured(10.7, 7.5, 12.9), Measured(0.0, 0.0, 0.31)
    figures = replace(white(), noise=Measured(2.14, 1.75, 2.32), white=alone, memory=memory, memory_frames=frames)
    told = noise_figures(figures)["correlation"]
    assert told.value == pytest.approx(math.exp(-1 / 10.7))
    assert told.low == pytest.approx(1.77**2 / (1.77**2 + 0.31**2) * math.exp(-1 / 7.5))
    assert told.high == pytest.approx(math.exp(-1 / 12.9))
