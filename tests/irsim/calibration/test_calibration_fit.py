"""A fit has the figures of the scenario, writes them under their keys, and renders again."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

import pytest
from typer.testing import CliRunner

import irsim
from irsim.backgrounds import Ground
from irsim.calibration import Estimate, Figures, Fit, PowerLaw, Region
from irsim.calibration.bad_pixel_figures import BadPixelFigures
from irsim.calibration.fit import fit
from irsim.calibration.scenario_writer import ScenarioWriter
from irsim.camera.bad_pixels import BadPixels
from irsim.cli.app import app
from irsim.errors import InputError
from irsim.physics.radiometry import radiance

SCENE = """\
frames: {frames}
seed: 3
camera: {{size: [160, 128], range_k: [270, 320], psf_px: 0.6, {camera}}}
background: {background}
"""
SMALL = "frames: 12\ncamera: {size: [64, 64]}\nbackground: {kind: ground, spread_k: 0}\n"
CAMERAS = {
    "white": "netd_mk: 60, noise: [{kind: white}, {kind: fixed_pattern, pixel: 0.5, column: 0.4, row: 0.3}]",
    "uncooled": "netd_mk: 80, noise: [{kind: white, ratio: 0.6}, {kind: ar1, ratio: 0.8, time_constant_s: 0.3}, "
    "{kind: ar1, id: level, over: frame, ratio: 1.0, time_constant_s: 0.5}, {kind: odd_even, ratio: -1.5}, "
    "{kind: fixed_pattern, pixel: 0.5, column: 0.3, row: 0.2}]",
    "lines": "netd_mk: 60, noise: [{kind: noise_3d, tvh: 1, tv: 0.3, th: 0.2, t: 0.2, vh: 0.4, v: 0.3, h: 0.2}, "
    "{kind: bad_pixels, dead: 0.001, hot: 0.002, blinking: 0.002, cluster: 1.0}]",
}
EVEN = "{kind: ground, spread_k: 0}"
TEXTURED = "{kind: ground, spread_k: 1, betas: [2.4, 2.8], correlation_mrad: 40}"


def text(camera: str, background: str = EVEN, frames: int = 60) -> str:
    return SCENE.format(camera=CAMERAS.get(camera, camera), background=background, frames=frames)


@lru_cache
def fitted(camera: str, background: str) -> Fit:
    return fit(irsim.loads(text(camera, background)))


@pytest.mark.parametrize(
    ("camera", "background", "true"),
    [
        ("white", TEXTURED, {"noise": 1.0, "white": 1.0, "column": 0.4, "row": 0.3}),
        ("white", EVEN, {"noise": 1.0, "white": 1.0, "pixel": 0.5, "column": 0.4, "row": 0.3, "memory": None}),
        ("uncooled", EVEN, {"noise": 1.0, "white": 0.6, "memory": 0.8, "pixel": 0.5, "even_rows": -1.5, "level": 1.0}),
        ("lines", EVEN, {"noise": 1.0, "row_noise": 0.3, "column_noise": 0.2, "level": 0.2, "pixel": 0.4}),
    ],
)
def test_true_figures_lie_in_their_intervals(camera: str, background: str, true: dict[str, float | None]) -> None:
    """Intervals are widened by half, as one in twenty does not hold the true value."""
    unit = irsim.loads(text(camera)).camera.response()
    found = fitted(camera, background).figures
    if background == TEXTURED:
        assert found.texture is not None
        assert found.texture.beta_x.low <= 2.4 <= found.texture.beta_x.high
        assert found.texture.beta_y.low <= 2.8 <= found.texture.beta_y.high
    for name, ratio in true.items():
        estimate: Estimate | None = getattr(found, name)
        if ratio is None:
            assert estimate is None, name
            continue
        assert estimate is not None, name
        reach = 0.25 * (estimate.high - estimate.low)
        assert estimate.low - reach <= ratio * unit.noise <= estimate.high + reach, (name, ratio * unit.noise, estimate)


def test_a_fit_renders_again() -> None:
    found = fitted("uncooled", EVEN)
    scene = found.scenario
    assert [noise.kind for noise in scene.camera.noise] == ["noise_3d", "ar1", "ar1", "odd_even"]
    assert scene.camera.netd_mk == pytest.approx(80, rel=0.05)
    assert scene.camera.range_k == (270.0, 320.0)
    assert "# Note: no point is seen: the blur is taken to be 0.6 px." in found.text
    assert irsim.loads(found.text) == scene
    again = dict(fit(scene).figures.estimates())
    for name, first in found.figures.estimates():
        if not name.startswith("flaws."):
            assert first.low <= again[name].high, name
            assert again[name].low <= first.high, name


def test_a_sliding_scene_has_an_upper_bound_of_noise() -> None:
    sliding = text("netd_mk: 30, motion: [{kind: pan, azimuth_deg_s: 0.8}]", TEXTURED, 40)
    found = fit(irsim.loads(sliding))
    assert found.figures.pixel is None
    assert found.figures.memory is None
    assert found.notes[0].startswith("the scene moves")
    assert found.figures.noise.bound
    unit = irsim.loads(sliding).camera.response()
    assert unit.noise <= found.figures.noise.high < 1.3 * unit.noise
    assert "noise" in found.as_json()["bounds"]


def test_photon_counting_cameras_are_written_with_electrons() -> None:
    found = fit(irsim.loads("frames: 30\ncamera: {preset: cooled_mwir, size: [96, 80]}\nbackground: {kind: sky}\n"))
    detector = found.scenario.camera.detector
    assert detector is not None
    assert detector.kind == "electrons"
    assert "# netd_mk: " in found.text


def counts(kelvin: float) -> float:
    """Return counts of a black body: 0 at 270 K, 16383 at 320 K, linear in radiance between."""
    cold, own, hot = (float(radiance("lwir", each)) for each in (270.0, kelvin, 320.0))
    return (2**14 - 1) * (own - cold) / (hot - cold)


def about(value: float) -> Estimate:
    return Estimate(value, 0.9 * value, 1.1 * value)


def test_figures_are_written_in_the_unit_of_their_key() -> None:
    flaws = BadPixelFigures(
        dead=about(0.001),
        hot=about(0.002),
        blinking=about(0.003),
        cluster=1.8,
        dead_level=0.25 * (2**14 - 1),
        hot_height=about(60.0),
        jump=about(40.0),
        on_frames=about(10.0),
        off_frames=about(75.0),
    )
    figures = Figures(
        frames=90,
        noise=about(4.0),
        white=about(4.0),
        psf=about(0.7),
        texture=PowerLaw(about(100.0), about(2.1), about(3.3), about(50.0), about(1.5)),
        mean=counts(291.5),
        histogram=tuple(counts(kelvin) for kelvin in (288.0, 290.0, 297.0)),
        flaws=flaws,
        region=Region(0, 0, 64, 64),
        notes=(),
    )
    source = "frames: 4\ncamera: {size: [64, 64], rate_hz: 25, bits: 14, band: lwir, range_k: [270, 320]}\n"
    writer = ScenarioWriter(irsim.Rendering(irsim.loads(f"{source}background: {{kind: sky}}\n")), figures)
    scene = irsim.loads("\n".join(writer.lines(4)))
    bad = next(noise for noise in scene.camera.noise if isinstance(noise, BadPixels))
    assert (bad.dead, bad.hot, bad.blinking, bad.cluster, bad.dead_level) == (0.001, 0.002, 0.003, 1.8, 0.25)
    assert (bad.hot_ratio, bad.blink_ratio, bad.on_s, bad.off_s) == pytest.approx((15.0, 10.0, 0.4, 3.0))
    ground = scene.background
    assert isinstance(ground, Ground)
    assert ground.mean_k == pytest.approx(291.5, abs=0.05)
    assert ground.betas == (2.1, 3.3)
    assert ground.correlation_mrad == pytest.approx(50 * scene.camera.ifov_mrad)
    assert ground.histogram == pytest.approx((288.0, 290.0, 297.0), abs=1e-3)
    per_kelvin = counts(292.0) - counts(291.0)
    assert ground.spread_k == pytest.approx(100 / per_kelvin, rel=0.01)
    assert scene.camera.netd_mk == pytest.approx(4000 / (counts(300.5) - counts(299.5)), rel=0.01)


def test_the_command_writes_a_scenario_that_renders(tmp_path: Path) -> None:
    scene, camera = tmp_path / "scene.yaml", tmp_path / "camera.yaml"
    scene.write_text(text("white"))
    done = CliRunner().invoke(app, ["fit", str(scene), "-o", str(camera), "--frames", "30"])
    assert done.exit_code == 0, done.output
    assert "render it: irsim render" in done.stdout
    assert "note: no point is seen" in done.stderr
    assert irsim.load(camera).frames == 30
    found = CliRunner().invoke(app, ["fit", str(camera), "--json", "--frames", "20", "--region", "0,0,64,64"])
    assert json.loads(found.stdout)["figures"]["noise"][0] > 0
    same = CliRunner().invoke(app, ["fit", str(scene), "-o", str(scene)])
    assert isinstance(same.exception, InputError)


def test_a_fit_replaces_nothing_but_an_unchanged_fit(tmp_path: Path) -> None:
    scene, camera = tmp_path / "scene.yaml", tmp_path / "camera.yaml"
    scene.write_text(SMALL)
    words = ["fit", str(scene), "-o", str(camera)]
    camera.write_text(fit(scene).text)
    assert CliRunner().invoke(app, words).exit_code == 0
    fit_text = camera.read_text()
    for changed, message in (
        (scene.read_text(), "camera.yaml: exists and is no fit, and a fit would replace it; allowed: another name"),
        (f"{fit_text}# my own\n", "was changed after irsim fit wrote it"),
        (fit_text.rpartition("# A later fit")[0], "the last line of a fit is missing"),
    ):
        camera.write_text(changed)
        done = CliRunner().invoke(app, words)
        assert isinstance(done.exception, InputError)
        assert message in str(done.exception)
        assert camera.read_text() == changed


def test_the_noise_command_prints_every_figure(tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(SMALL)
    done = CliRunner().invoke(app, ["noise", str(scene), "--frames", "2:12"])
    assert done.exit_code == 0, done.output
    labels = [line.split()[0] for line in done.stdout.splitlines()]
    wanted = ["region", "t", "v", "h", "tv", "th", "vh", "tvh", "pair", "lags", "memory", "drift", "bad"]
    assert labels[: len(wanted)] == wanted
    found = json.loads(CliRunner().invoke(app, ["noise", str(scene), "--json"]).stdout)
    assert (found["start"], found["frames"], len(found["region"])) == (0, 12, 4)
