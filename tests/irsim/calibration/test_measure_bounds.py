"""Noise before which something moves is an upper bound, and said to be one."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from test_measure_fit import apart
from typer.testing import CliRunner

import irsim
from irsim.cli.app import app
from irsim.measure import Measured, noise_lines
from irsim.measure.quiet import quiet_sigma

SLIDING = """\
frames: 60
seed: 2
camera: {preset: uncooled_lwir, size: [128, 96], netd_mk: 40, noise: [{kind: white}],
  motion: [{kind: pan, azimuth_deg_s: 2}]}
background: {kind: ground, spread_k: 3}
"""


def test_a_bound_stays_one() -> None:
    assert Measured(2.0, 0.0, 3.0, bound=True).map(lambda value: 2 * value) == Measured(4.0, 0.0, 6.0, bound=True)
    assert not Measured(2.0, 0.0, 3.0).map(lambda value: 2 * value).bound


def test_noise_of_a_scene_that_slides_is_said_to_be_a_bound(tmp_path: Path) -> None:
    """Of 40 mK; it was said to be 109 to 163."""
    scene = tmp_path / "scene.yaml"
    scene.write_text(SLIDING)
    camera = tmp_path / "camera.yaml"
    done = CliRunner().invoke(app, ["fit", str(scene), "-o", str(camera)])
    assert done.exit_code == 0, done.output
    assert "note: the noise is at most what is told of it" in done.stderr
    written = camera.read_text()
    netd = next(line for line in written.splitlines() if "netd_mk" in line)
    assert " # at most " in netd
    assert 40 <= float(netd.split()[-1]) <= 50
    assert "tvh: 1  # at most 1.05" in written
    told = json.loads(CliRunner().invoke(app, ["fit", str(scene), "--json"]).stdout)
    assert told["bounds"] == ["noise", "white"]
    assert told["figures"]["noise"][1] == 0


def test_rendered_and_fitted_again_a_bound_agrees() -> None:
    """The first knows a bound alone; of what it gives, which stands still, there is an interval."""
    first = irsim.fit(irsim.loads(SLIDING))
    second = irsim.fit(first.scenario)
    assert first.figures.noise.bound
    assert not second.figures.noise.bound
    assert not apart(first.figures, second.figures)


def test_noise_is_read_off_the_quietest_frequencies() -> None:
    """Beneath texture of 100 times its sigma that slides by 2.3 px a frame, and a pattern that stays, with lines."""
    rng = np.random.default_rng(1)
    wide = gaussian_filter(rng.normal(size=(96, 3000)), (1.2, 12))
    columns = np.arange(128)
    sliding = np.stack([wide[:, 23 * k + 10 * columns] for k in range(60)])
    pattern = rng.normal(0, 5, (96, 128)) + rng.normal(0, 5, (96, 1)) + rng.normal(0, 5, 128)
    noise = rng.normal(0, 3, sliding.shape)
    assert quiet_sigma(noise) == pytest.approx(3, rel=0.02)
    assert quiet_sigma(noise + pattern) == pytest.approx(3, rel=0.02)
    assert 2.9 <= quiet_sigma(noise + pattern + 300 / wide.std() * sliding) <= 3.3
    assert quiet_sigma(noise[:31]) == math.inf
    assert quiet_sigma(noise[:, :63]) == math.inf
    assert quiet_sigma(noise[:32, :64, :64]) == pytest.approx(3, rel=0.02)


def test_pixels_that_blink_beneath_a_scene_that_slides_are_said_not_to_be_told() -> None:
    """A hundred of them are there; next to none is seen, and that was said to be known within 1 in 1000."""
    blinking = "noise: [{kind: white}, {kind: bad_pixels, blinking: 0.008, blink_ratio: 20}]"
    text = SLIDING.replace("noise: [{kind: white}]", blinking)
    source = irsim.open_source(irsim.loads(text))
    report = irsim.measure_noise(np.stack([frame.image for frame in source.frames()]), source.rate_hz)
    assert report.slides
    assert any("pixels that blink are missed" in text for _, text in noise_lines(report))
    found = irsim.fit(irsim.loads(text))
    share = found.figures.flaws.blinking
    assert share.low <= 0.008 <= share.high == 1
    assert any(note.startswith("where the scene slides, pixels that blink are missed") for note in found.notes)
    assert "not told how many are blinking" in [text for _, text in found.summary()]


@pytest.mark.sampled
@pytest.mark.parametrize("size", [(24, 20), (20, 16)])
def test_in_tiny_pictures_noise_before_what_may_slide_is_a_bound_to_fit_as_to_noise(size: tuple[int, int]) -> None:
    """Of 40 mK; fit said 500."""
    source = irsim.open_source(irsim.loads(SLIDING.replace("[128, 96]", str([*size]))))
    frames = np.stack([frame.image for frame in source.frames()])
    report = irsim.measure_noise(frames, 30.0)
    assert not report.slides
    found = irsim.fit(source)
    assert found.figures.noise.bound
    assert found.figures.noise.high == pytest.approx(report.fine_most, rel=1e-3)
    assert any(note.startswith("in a picture of less than 28 px a side") for note in found.notes)
    even = irsim.fit(irsim.loads(SLIDING.replace("[128, 96]", str([*size])).replace("spread_k: 3", "spread_k: 0")))
    assert not even.figures.noise.bound
