"""A camera and a background fitted to a recording are those that made it; rendered and fitted again they agree."""

from __future__ import annotations

import json
import re
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from intervals import held
from typer.testing import CliRunner

import irsim
from irsim.backgrounds import Ground
from irsim.camera.presets import PRESETS
from irsim.cli.app import app
from irsim.errors import InputError
from irsim.fitting import Fit
from irsim.geometry.random_fields import spectral
from irsim.lint import doubts
from irsim.measure import Figures, Measured, Region, measure_figures
from irsim.measure.field import fit_field, periodogram
from irsim.measure.lines import lines, turns, without_turns
from irsim.measure.rounding import HIDDEN
from irsim.measure.steady import slides
from irsim.render.stream import Rendering
from irsim.types import Floats

REAL = Path(__file__).resolve().parents[4] / "shared" / "real"
real = pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")

SCENE = """\
frames: 100
seed: {seed}
camera: {{size: [160, 128], range_k: [270, 320], psf_px: 0.6, {camera}}}
background: {background}
"""
CAMERAS = {
    "white": "netd_mk: 60, noise: [{kind: white}, {kind: fixed_pattern, pixel: 0.5, column: 0.4, row: 0.3}]",
    "uncooled": "netd_mk: 80, noise: [{kind: white, ratio: 0.6}, {kind: ar1, ratio: 0.8, time_constant_s: 0.3}, "
    "{kind: ar1, id: level, over: frame, ratio: 1.0, time_constant_s: 0.5}, {kind: odd_even, ratio: -1.5}, "
    "{kind: fixed_pattern, pixel: 0.5, column: 0.3, row: 0.2}]",
    "drifting": "netd_mk: 80, noise: [{kind: white, ratio: 0.6}, {kind: ar1, ratio: 0.8, time_constant_s: 0.3}, "
    "{kind: drift, pixel: 2.5, column: 0, row: 0, time_constant_s: 60}, {kind: fixed_pattern, pixel: 0.5}]",
    "lasting lines": "netd_mk: 60, noise: [{kind: white}, {kind: ar1, over: row, ratio: 0.5, time_constant_s: 0.3}, "
    "{kind: fixed_pattern, pixel: 0.5, column: 0.4, row: 0.3}]",
    "lines": "netd_mk: 60, noise: [{kind: noise_3d, tvh: 1, tv: 0.3, th: 0.2, t: 0.2, vh: 0.4, v: 0.3, h: 0.2}, "
    "{kind: bad_pixels, dead: 0.001, hot: 0.002, blinking: 0.002, cluster: 1.0}]",
    "mwir": "preset: cooled_mwir",
}
BACKGROUNDS = {
    "even": "{kind: ground, spread_k: 0}",
    "textured": "{kind: ground, spread_k: 1, betas: [2.4, 2.8], correlation_mrad: 40}",
}
RUNS = [
    (camera, background)
    for camera in CAMERAS
    for background in BACKGROUNDS
    if (camera, background) not in {("lines", "textured"), ("drifting", "textured"), ("lasting lines", "textured")}
]


@lru_cache
def fitted(camera: str, background: str) -> tuple[Fit, Fit]:
    """The fit of a rendered scene, and that of the scenario that it gave."""
    text = SCENE.format(seed=3, camera=CAMERAS[camera], background=BACKGROUNDS[background])
    first = irsim.fit(irsim.loads(text))
    return first, irsim.fit(first.scenario)


OF_FEW = {"flaws.hot_height", "flaws.jump", "flaws.on_frames", "flaws.off_frames"}
"""Heights and times of bad pixels: where there are few, another recording of them may show none."""


def apart(first: Figures, second: Figures) -> list[str]:
    """Figures whose intervals do not meet, or that are not told again."""
    again = dict(second.measured())
    return [
        f"{name}: {found} and {again.get(name)}"
        for name, found in first.measured()
        if (name not in OF_FEW if name not in again else found.low > again[name].high or again[name].low > found.high)
    ]


@pytest.mark.sampled
@pytest.mark.parametrize(("camera", "background"), RUNS)
def test_rendered_and_fitted_again_the_figures_agree(camera: str, background: str) -> None:
    first, second = fitted(camera, background)
    assert not apart(first.figures, second.figures)


@pytest.mark.parametrize(
    ("camera", "true"),
    [
        ("white", {"noise": 1.0, "white": 1.0, "pixel": 0.5, "column": 0.4, "row": 0.3, "memory": None}),
        ("uncooled", {"noise": 1.0, "white": 0.6, "memory": 0.8, "pixel": 0.5, "even_rows": -1.5, "level": 1.0}),
        ("drifting", {"noise": 1.0, "white": 0.6, "memory": 0.8, "walk": 2.5 * (2 / (60 * 30)) ** 0.5, "pixel": 0.5}),
        ("lines", {"noise": 1.0, "row_noise": 0.3, "column_noise": 0.2, "level": 0.2, "pixel": 0.4}),
    ],
)
def test_what_went_in_is_found(camera: str, true: dict[str, float | None]) -> None:
    """Within the interval made half as wide again: one in twenty lies outside of it, and some thirty are asked."""
    first, _ = fitted(camera, "even")
    text = SCENE.format(seed=3, camera=CAMERAS[camera], background=BACKGROUNDS["even"])
    unit = irsim.loads(text).camera.response()
    for name, ratio in true.items():
        found: Measured | None = getattr(first.figures, name)
        if ratio is None:
            assert found is None, name
            continue
        assert found is not None, name
        value = ratio * unit.noise
        reach = 0.25 * (found.high - found.low)
        assert found.low - reach <= value <= found.high + reach, (name, value, found)


def test_the_scenario_says_what_was_found() -> None:
    first, _ = fitted("uncooled", "textured")
    scene = first.scenario
    kinds = [noise.kind for noise in scene.camera.noise]
    assert kinds == ["noise_3d", "ar1", "ar1", "odd_even"]
    assert scene.camera.netd_mk == pytest.approx(80, rel=0.05)
    assert scene.camera.range_k == (270.0, 320.0)
    assert "# Note: no point is seen: the blur is taken to be 0.6 px." in first.text
    assert irsim.loads(first.text) == scene


@pytest.mark.sampled
@pytest.mark.parametrize("preset", list(PRESETS))
def test_cameras_of_the_trade_are_found(preset: str) -> None:
    """NETD and temperature of even ground, 300 K, without the drift that comes on top of the NETD. One without
    noise may have as little as rounding hides."""
    text = f"""\
frames: 100
camera: {{preset: {preset}, size: [160, 128]}}
background: {{kind: ground, spread_k: 0, mean_k: 300}}
"""
    scenario = irsim.loads(text)
    off = [name for name, _ in scenario.names() if name == "drift"]
    found = irsim.fit(scenario.model_copy(update={"without": tuple(off)}))
    told = re.search(r"netd_mk: \S+  # (\S+) to (\S+)", found.text)
    assert told is not None
    low, high = (float(bound) for bound in told.groups())
    if scenario.camera.netd():
        assert low - 0.25 * (high - low) <= scenario.camera.netd() <= high + 0.25 * (high - low)
        assert low <= found.scenario.camera.netd() <= high
    else:
        assert (found.figures.noise.value, found.figures.noise.high) == (0, HIDDEN)
    background = found.scenario.background
    assert isinstance(background, Ground)
    assert background.mean_k == pytest.approx(300, abs=0.2)
    response = scenario.camera.response()
    before, after = (Rendering(each).frame(0).image.mean() for each in (scenario, found.scenario))
    assert after == pytest.approx(before, abs=3 * response.noise / response.gain + 1)
    assert not [notice for notice in doubts(found.scenario) if notice.at[0] == "camera"]


def test_a_scene_that_slides_says_what_it_cannot_tell() -> None:
    text = SCENE.format(
        seed=1, camera="netd_mk: 30, motion: [{kind: pan, azimuth_deg_s: 0.8}]", background=BACKGROUNDS["textured"]
    )
    found = irsim.fit(irsim.loads(text), stop=40)
    assert found.figures.pixel is None
    assert found.figures.memory is None
    assert found.notes[0].startswith("the scene moves")
    unit = irsim.loads(text).camera.response()
    assert found.figures.noise.low <= unit.noise <= found.figures.noise.high
    assert found.figures.noise.value == pytest.approx(unit.noise, rel=0.3)
    assert found.scenario.camera.noise[0].kind == "noise_3d"


def test_a_target_that_crosses_does_not_move_the_scene() -> None:
    rows, columns = np.mgrid[:90, :90]
    scene = 40 * np.sin(rows / 7) * np.cos(columns / 9)
    rng = np.random.default_rng(0)
    frames = scene + rng.normal(0, 2, (20, 90, 90))
    for k in range(20):
        frames[k, 40:50, 3 * k : 3 * k + 12] += 300
    assert not slides(frames)
    assert slides(np.stack([np.roll(scene, k, axis=1) for k in range(20)]) + rng.normal(0, 2, (20, 90, 90)))


FIELD = {"beta_x": 2.6, "beta_y": 3.2, "correlation_px": 60.0, "stretch": 1.5, "spread": 10.0}


def picture(seed: int) -> Floats:
    """Texture, white noise of sigma 0.5, rows of 0.3 and columns of 0.15."""
    rng = np.random.default_rng(seed)
    texture = 10.0 * spectral((1024, 1024), 3, (2.6, 3.2), 60, 1.5, seed, "field")[:200, :240]
    lined = texture + rng.normal(0, 0.3, (200, 1)) + rng.normal(0, 0.15, (1, 240))
    return np.asarray(lined + rng.normal(0, 0.5, (200, 240)))


def test_a_field_lies_in_its_intervals_at_the_stated_rate() -> None:
    powers = [periodogram(picture(seed)) for seed in range(12)]
    spectra = [fit_field(power, (200, 240), 0.0) for power in powers]
    for name, true in FIELD.items():
        held([getattr(spectrum.texture, name) for spectrum in spectra], true)
    held([spectrum.floor for spectrum in spectra], 0.25)
    told = [lines(power, spectrum.density, (200, 240)) for power, spectrum in zip(powers, spectra, strict=True)]
    held([line.row for line in told], 0.3)
    held([line.column for line in told], 0.15)


def test_what_ends_at_a_bound_may_be_anything() -> None:
    """Twenty times as wide as high: the search goes to e^2."""
    texture = 10.0 * spectral((1024, 1024), 3, (2.2, 3.5), 60, 20.0, 3, "f")[:200, :240]
    noisy = texture + np.random.default_rng(3).normal(0, 0.5, texture.shape)
    found = fit_field(periodogram(noisy), (200, 240), 0.0).texture
    assert found is not None
    assert found.stretch.value == pytest.approx(np.exp(2), rel=0.02)
    assert (found.stretch.low, found.stretch.high) == pytest.approx((np.exp(-2), np.exp(2)))
    assert found.beta_x.low > 0.6  # no other is


def test_noise_alone_is_no_texture() -> None:
    for seed in range(5):
        spectrum = fit_field(periodogram(np.random.default_rng(seed).normal(0, 2, (100, 120))), (100, 120), 0.6)
        assert spectrum.texture is None
        assert spectrum.floor.value == pytest.approx(4, rel=0.1)


def test_odd_and_even_rows_are_told_apart() -> None:
    turned = picture(1) + np.where(np.arange(200) % 2, -2.0, 2.0)[:, None]
    found = turns(turned, 0)
    assert found.low <= 2 <= found.high
    evened = turns(without_turns(turned, found.value, 0.0), 0)
    assert evened.value == pytest.approx(0, abs=1e-9)


def test_the_input_is_not_changed_and_too_little_is_one_clear_error() -> None:
    frames = np.random.default_rng(0).normal(100, 2, (12, 40, 40))
    before = frames.copy()
    measure_figures(frames, 30.0, Region(0, 0, 40, 40))
    np.testing.assert_array_equal(frames, before)
    with pytest.raises(InputError, match="too few"):
        measure_figures(frames[:2], 30.0)


def test_the_command_writes_a_scenario_that_renders(tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE.format(seed=1, camera=CAMERAS["white"], background=BACKGROUNDS["even"]))
    camera = tmp_path / "camera.yaml"
    done = CliRunner().invoke(app, ["fit", str(scene), "-o", str(camera), "--frames", "30"])
    assert done.exit_code == 0, done.output
    assert "render it: irsim render" in done.stdout
    assert "note: no point is seen" in done.stderr
    assert irsim.load(camera).frames == 30
    told = CliRunner().invoke(app, ["fit", str(camera), "--json", "--frames", "20", "--region", "0,0,64,64"])
    assert json.loads(told.stdout)["figures"]["noise"][0] > 0
    same = CliRunner().invoke(app, ["fit", str(scene), "-o", str(scene)])
    assert isinstance(same.exception, InputError)


@lru_cache
def real_fit(name: str, rate_hz: float, bits: int, folder: Path) -> tuple[Fit, Fit]:
    with np.load(REAL / name / "frames.npz") as file:
        for k, image in enumerate(file["frames"]):
            cv2.imwrite(str(folder / f"{k:04}.png"), image)
    first = irsim.fit(irsim.import_frames(folder, folder / "real.mcap", rate_hz=rate_hz, bits=bits))
    return first, irsim.fit(first.scenario)


@pytest.mark.sampled
@real
@pytest.mark.parametrize(
    ("name", "rate_hz", "bits", "ranges"),
    [
        ("raw14_lwir", 30.0, 14, {"pixel": (0.6, 0.7), "row": (0.1, 0.25), "column": (0.03, 0.2), "noise": (1.6, 1.8)}),
        ("raw14_mwir", 30.0, 14, {"pixel": (14, 18), "column": (1.5, 4.3), "even_rows": (-52, -26)}),
        ("raw16_lepton", 9.0, 16, {"pixel": (2.4, 6.4), "column": (-0.1, 1.4), "row": (0.4, 1.3), "noise": (1.4, 3.5)}),
    ],
)
def test_real_sensors(
    name: str, rate_hz: float, bits: int, ranges: dict[str, tuple[float, float]], tmp_path: Path
) -> None:
    """The data's README: fixed pixel, column, row .66, .14, .20 (LWIR), 16, 3, 52 (MWIR), 2.5-6.4, .6-1.4, .4-1.3 (2.4
    here) of the Lepton, whose columns wander, so that less of what stands over the clip is fixed, 0 to 0.5; the heat of
    the animal in it, which is no texture, looked like 0.4."""
    first, second = real_fit(name, rate_hz, bits, tmp_path)
    for figure, (low, high) in ranges.items():
        assert low < getattr(first.figures, figure).value < high, figure
    assert not apart(first.figures, second.figures)
