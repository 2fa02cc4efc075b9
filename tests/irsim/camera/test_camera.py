"""The camera: presets, its NETD, corrections, lag, fall-off, and what stands in a scenario of it."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scenario_text import errors_of

import irsim
from irsim.camera.camera import Camera
from irsim.camera.drift import Correction
from irsim.camera.noise import Shot, White
from irsim.camera.presets import PRESETS
from irsim.camera.response import ResponseTime, response_weights
from irsim.camera.sensor import ElectronSensor, NetdSensor
from irsim.camera.vignetting import Vignetting
from irsim.geometry.projection import Geometry
from irsim.physics.radiometry import radiance
from irsim.render.frame import Renderer
from irsim.scenario.loader import dumps, loads
from irsim.types import Floats

# Presets


@pytest.mark.parametrize(
    ("preset", "netd_mk"), [("cooled_mwir", 17.7), ("cooled_lwir", 22.0), ("uncooled_lwir", 40.0), ("ideal", 0.0)]
)
def test_a_preset_has_the_netd_of_its_design(preset: Any, netd_mk: float) -> None:
    assert Camera(preset=preset).netd() == pytest.approx(netd_mk, rel=0.005)


@pytest.mark.parametrize("preset", PRESETS)
def test_own_keys_override_a_preset(preset: Any) -> None:
    camera = Camera.model_validate({"preset": preset, "bits": 12, "noise": [{"kind": "white"}]})
    assert camera.bits == 12
    assert camera.noise == (White(),)
    assert camera.detector == Camera(preset=preset).detector


def test_part_of_a_preset_detector_can_be_overridden() -> None:
    text = "background: {kind: sky}\ncamera: {preset: cooled_mwir, detector: {integration_ms: 2}}"
    camera = loads(text).camera
    assert camera.detector == ElectronSensor(integration_ms=2.0)
    assert camera.band == (3.4, 4.9)
    by_override = loads(
        "background: {kind: sky}\ncamera: {preset: cooled_mwir}", overrides=["camera.detector.f_number=2"]
    )
    assert by_override.camera.detector == ElectronSensor(f_number=2.0)
    quieter = loads(
        "background: {kind: sky}\ncamera: {preset: uncooled_lwir}", overrides=["camera.noise.drift.pixel=0.5"]
    )
    assert [noise.name for noise in quieter.camera.noise] == [
        noise.name for noise in Camera(preset="uncooled_lwir").noise
    ]
    assert quieter.camera.noise[4] == Camera(preset="uncooled_lwir").noise[4].model_copy(update={"pixel": 0.5})


@pytest.mark.parametrize("preset", PRESETS)
def test_a_preset_survives_its_dump_and_renders(preset: str) -> None:
    text = f"frames: 3\nbackground: {{kind: ground}}\ncamera: {{preset: {preset}, size: [64, 48]}}"
    scenario = loads(text)
    assert loads(dumps(scenario)) == scenario
    image = Renderer(scenario).frame(2)[0].image
    assert 0.02 * 2**scenario.camera.bits < image.mean() < 0.9 * 2**scenario.camera.bits
    assert image.std() > 0


NOISY = "noise: [{kind: white}, {kind: drift, gain: 0.01}, {kind: bad_pixels}]"


@pytest.mark.parametrize(
    ("keys", "is_quiet"),
    [
        ("noise: []", True),
        ("noise: [], detector: {kind: electrons}", True),
        ("netd_mk: 0", True),
        (f"netd_mk: 0, {NOISY}", False),
        ("netd_mk: 0, detector: {kind: electrons}", False),
    ],
)
def test_what_has_no_noise_is_as_the_camera_says(keys: str, is_quiet: bool) -> None:
    background = "{kind: sky, horizon_k: 300, zenith_k: 300}"
    scene = Renderer(loads(f"frames: 3\nbackground: {background}\ncamera: {{size: [64, 48], {keys}}}"))
    assert (np.ptp([scene.frame(index)[0].image for index in range(3)]) == 0) == is_quiet


def test_a_cooled_camera_fills_its_wells_as_told() -> None:
    """37 %, says the table of presets."""
    sensed = Camera(preset="cooled_mwir").response()
    light = np.full((2, 2), radiance((3.4, 4.9), 300.0), np.float32)
    assert sensed.signal(light).mean() / sensed.well == pytest.approx(0.37, abs=0.005)


def test_noise_goes_with_the_detector() -> None:
    assert Camera().noise == (White(),)
    assert Camera(detector=ElectronSensor()).noise == (Shot(),)
    assert Camera.model_validate({"detector": {"kind": "electrons"}}).noise == (Shot(),)
    assert Camera(detector=NetdSensor()).noise == (White(),)


def test_netd_is_that_of_the_white_noise_or_of_the_electrons() -> None:
    assert Camera(netd_mk=55.0).netd() == 55.0
    fast = Camera(detector=ElectronSensor(integration_ms=2.5, read_noise_e=0.0), band=(3.4, 4.9))
    slow = Camera(detector=ElectronSensor(integration_ms=10.0, read_noise_e=0.0), band=(3.4, 4.9))
    assert fast.netd() / slow.netd() == pytest.approx(2)  # shot noise: as one over the root of time


WRONG = {
    "preset: cooled": "camera.preset: unknown value 'cooled'; allowed: 'cooled_mwir', ",
    "detector: {kind: electrons}, noise: [{kind: shot}, {kind: shot, id: more}]": "more counts electrons that shot "
    "counts already; allowed: one noise that counts them",
    "noise: [{kind: shot}]": "shot counts electrons, and this detector has none; allowed: detector: {kind: electrons}",
    "{detector: {kind: electrons}, rate_hz: 200}": "camera.detector.integration_ms: 10.0 ms do not fit "
    "into a frame at 200.0 Hz; allowed: at most 5 ms",
    "detector: {kind: electron}": "unknown detector kind 'electron'; allowed: stated, electrons or module:Class; did",
    "{preset: cooled_mwir, detector: {f_nmber: 2}}": "camera.detector.f_nmber: unknown key",
    "correction: {period_frames: 5, freeze_frames: 5}": "a picture that stands still for 5 of every 5 frames never",
    "correction: {frames: [0]}": "camera.correction.frames.0: 0 is out of range; allowed: a whole number, from 1",
    "falloff: {vignetting: 2}": "camera.falloff.vignetting: 2 is out of range",
    "bloom: {along: up}": "unknown value 'up'; allowed: 'columns', 'rows', 'around'",
    "{detector: {kind: electrons, well_me: 0}}": "camera.detector.well_me: 0 is out of range; ",
}


@pytest.mark.parametrize(("text", "line"), WRONG.items())
def test_what_a_camera_cannot_be_is_one_line(text: str, line: str) -> None:
    keys = text if text.startswith("{") else "{" + text + "}"
    lines = errors_of(f"background: {{kind: sky}}\ncamera: {keys}")
    assert any(line in each for each in lines), lines


# Corrections


def test_a_correction_freezes_the_picture_while_truth_goes_on() -> None:
    text = """
frames: 20
camera: {size: [64, 48], correction: {frames: [6], period_frames: 13, freeze_frames: 3}}
background: {kind: sky}
targets: [{id: jet, shape: {kind: point, area_m2: 2}, path: {kind: straight, start: [10, 20], speed: 2}}]
"""
    scenario = loads(text)
    pairs = [Renderer(scenario).frame(index) for index in range(20)]
    for index, (frame, truth) in enumerate(pairs):
        shown = {6: 5, 7: 5, 8: 5, 13: 12, 14: 12, 15: 12}.get(index, index)
        np.testing.assert_array_equal(frame.image, pairs[shown][0].image)
        assert (frame.index, frame.time) == (index, index / 30)
        assert truth.targets[0].center[0] == pytest.approx(10 + 2 * index, abs=0.01)
    assert sum((a.image == b.image).all() for (a, _), (b, _) in pairwise(pairs)) == 6
    without = Renderer(loads(text, overrides=["without=[correction]"]))
    np.testing.assert_array_equal(without.frame(5)[0].image, pairs[5][0].image)
    assert (without.frame(6)[0].image != pairs[6][0].image).any()


def test_frames_in_sequence_do_not_share_a_picture() -> None:
    scenario = loads("frames: 9\nbackground: {kind: sky}\ncamera: {correction: {frames: [3], freeze_frames: 3}}")
    renderer = Renderer(scenario)
    first = renderer.frame(3)[0].image
    kept = first.copy()
    first[:] = 0
    np.testing.assert_array_equal(renderer.frame(4)[0].image, kept)


def test_when_corrections_are() -> None:
    correction = Correction(frames=(5, 20, 7), period_frames=10)
    assert [correction.last(index) for index in (0, 4, 5, 6, 7, 9, 10, 19, 20, 29, 30)] == [
        (0, 0), (0, 0), (5, 1), (5, 1), (7, 2), (7, 2), (10, 3), (10, 3), (20, 4), (20, 4), (30, 5),
    ]  # fmt: skip
    assert Correction().last(1000) == (0, 0)
    back_to_back = Correction(frames=(4, 6), freeze_frames=2)
    assert [back_to_back.shown(index) for index in range(9)] == [0, 1, 2, 3, 3, 3, 3, 3, 8]


def test_drift_grows_and_a_correction_takes_it_away() -> None:
    """Variance 1 - exp(-2 age / time constant) in frames after a correction, times that which it tends to."""
    text = """
frames: 4000
camera:
  size: [160, 128]
  netd_mk: 500
  noise: [{kind: drift, pixel: 2, column: 0, row: 0, time_constant_s: 30}]
  correction: {frames: [2000]}
background: {kind: sky, horizon_k: 280, zenith_k: 280}
"""
    renderer = Renderer(loads(text))
    clean = Renderer(loads(text, overrides=["without=[drift]"])).frame(0)[0].image.astype(float)
    unit = renderer.sensor.response.noise
    for index in (0, 30, 300, 1500, 1999, 2000, 2030, 3500):
        age = index - (2000 if index >= 2000 else 0)
        grown = 1 - math.exp(-2 * age / (30 * 30))
        found = (renderer.frame(index)[0].image - clean).var()
        expected = (2 * unit) ** 2 * grown + (1 / 12 if age else 0)
        assert found == pytest.approx(expected, rel=0.05, abs=0.12), index


# Lag


def test_lag_follows_a_step_as_an_exponential() -> None:
    """Light that jumps at frame 5: 1 - a^(k - 4) of the jump is seen at frame k >= 5, a = exp(-T / tau)."""
    rate, tau = 60.0, 0.010
    kept = math.exp(-1 / (rate * tau))

    def scene(index: int) -> Floats:
        return np.full((3, 4), 10.0 if index >= 5 else 2.0, np.float32)

    lag = ResponseTime(tau, rate)
    for index in (0, 3, 5, 6, 7, 9, 30, 6):
        expected = 2 + 8 * (1 - kept ** max(index - 4, 0))
        np.testing.assert_allclose(lag.light(index, scene), expected, atol=8e-3)
    assert response_weights(tau, rate).sum() == pytest.approx(1)
    assert response_weights(tau, rate)[1] / response_weights(tau, rate)[0] == pytest.approx(kept)
    np.testing.assert_array_equal(response_weights(0.0, rate), [1.0])


def test_a_lagging_frame_alone_is_the_frame_in_sequence() -> None:
    text = "frames: 30\nbackground: {kind: ground}\ncamera: {preset: uncooled_lwir, size: [64, 48], rate_hz: 60}"
    text += "\ntargets: [{id: jet, shape: {kind: fighter}, path: {kind: straight, start: [5, 20], speed: 2}}]"
    scenario = loads(text)
    in_order = Renderer(scenario)
    frames = [in_order.frame(index)[0].image for index in range(30)]
    for index in (29, 3, 17):
        np.testing.assert_array_equal(Renderer(scenario).frame(index)[0].image, frames[index])
    quick = Renderer(loads(text, overrides=["without=[lag]"])).frame(17)[0].image
    assert (quick != frames[17]).any()


def test_lag_leaves_a_still_scene_as_it_is() -> None:
    still = np.linspace(1, 5, 12, dtype=np.float32).reshape(3, 4)
    np.testing.assert_allclose(ResponseTime(0.05, 30.0).light(40, lambda index: still), still, rtol=1e-6)


# Fall-off


def test_light_falls_as_the_fourth_power_of_the_cosine() -> None:
    geometry = Geometry((321, 241), 2e-3)
    share = Vignetting().transmittance(geometry)
    assert share[120, 160] == 1
    angle = math.atan(math.hypot(160, 120) * 2e-3)
    np.testing.assert_allclose([share[0, 0], share[-1, -1], share[0, -1]], math.cos(angle) ** 4, rtol=1e-6)
    assert share[120, 0] == pytest.approx(math.cos(math.atan(160 * 2e-3)) ** 4)


def test_vignetting_takes_its_share_in_the_corners() -> None:
    share = Vignetting(cos4=False, vignetting=0.3).transmittance(Geometry((320, 240), 1e-3))
    np.testing.assert_allclose([share[0, 0], share[-1, -1]], 0.7, rtol=1e-6)
    assert share[120, 160] == pytest.approx(1, abs=1e-4)
    assert (Vignetting(cos4=False).transmittance(Geometry((320, 240), 1e-3)) == 1).all()


def test_falloff_darkens_the_picture_and_can_be_switched_off() -> None:
    text = "frames: 2\nbackground: {kind: sky, horizon_k: 300, zenith_k: 300}\ncamera: {preset: cooled_mwir, "
    text += "noise: [], ifov_mrad: 0.8, falloff: {vignetting: 0.2}}"
    dark = Renderer(loads(text)).frame(0)[0].image
    plain = Renderer(loads(text, overrides=["without=[falloff]"])).frame(0)[0].image
    corner = math.cos(math.atan(math.hypot(319.5, 255.5) * 0.8e-3)) ** 4 * 0.8
    assert dark[0, 0] / plain[0, 0] == pytest.approx(corner, rel=0.01)
    assert dark[256, 320] == pytest.approx(int(plain[256, 320]), abs=1)


# Variance of a rendered frame


@pytest.mark.parametrize("preset", ["cooled_mwir", "uncooled_lwir"])
def test_variance_of_a_scenario_is_that_of_its_frames_over_seeds(preset: str) -> None:
    text = "frames: 4\nbackground: {kind: sky, horizon_k: 300, zenith_k: 280}\n"
    text += f"camera: {{preset: {preset}, size: [32, 24]}}"
    if preset == "uncooled_lwir":
        text = text.replace("]}", "], netd_mk: 200}")  # well above a count
    scenario = loads(text, overrides=["without=[bad_pixels]"])
    mean = Renderer(scenario).sensor.mean(Renderer(scenario).light(3), 3)
    squares = np.mean(
        [(Renderer(loads_seed(scenario, seed)).frame(3)[0].image - mean) ** 2.0 for seed in range(300)], axis=0
    )
    variance = Renderer(scenario).variance(3)
    # The frame's level is one draw a scene: its mean square over 300 is known to sqrt(2 / 300) = 8 %.
    assert squares.mean() == pytest.approx(variance.mean(), rel=0.03 if preset == "cooled_mwir" else 0.15)
    assert np.median(squares / variance) == pytest.approx(1, rel=0.05 if preset == "cooled_mwir" else 0.2)


def loads_seed(scenario: irsim.Scenario, seed: int) -> irsim.Scenario:
    return scenario.model_copy(update={"seed": seed})


def test_radiance_of_a_stated_camera_is_its_range() -> None:
    camera = Camera(range_k=(250.0, 350.0), band="lwir", noise=())
    light = radiance("lwir", np.array([[250.0, 350.0]])).astype(np.float32)
    np.testing.assert_array_equal(camera.sensor(0).expose(light, 0), [[0, 2**14 - 1]])
