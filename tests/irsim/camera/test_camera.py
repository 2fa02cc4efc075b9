"""The camera of a scenario: presets, consistency of its keys, vignetting, response time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scenario_text import errors_of

from irsim.camera.camera import Camera
from irsim.camera.noise import Shot, White
from irsim.camera.sensor import ElectronSensor, NetdSensor
from irsim.camera.vignetting import Vignetting
from irsim.geometry.projection import Geometry
from irsim.physics.lens import Lens
from irsim.physics.radiometry import radiance
from irsim.render.frame import Renderer
from irsim.scenario.loader import dumps, loads

SKY = "background: {kind: sky}\n"


@pytest.mark.parametrize(
    ("preset", "netd_mk"), [("cooled_mwir", 17.7), ("cooled_lwir", 22.0), ("uncooled_lwir", 40.0), ("ideal", 0.0)]
)
def test_a_preset_has_its_netd_and_survives_its_dump(preset: Any, netd_mk: float) -> None:
    assert Camera(preset=preset).netd() == pytest.approx(netd_mk, rel=0.005)
    text = f"frames: 3\nbackground: {{kind: ground}}\ncamera: {{preset: {preset}, size: [64, 48]}}"
    scenario = loads(text)
    assert loads(dumps(scenario)) == scenario


def test_keys_of_a_preset_can_be_overridden() -> None:
    camera = loads(SKY + "camera: {preset: cooled_mwir, detector: {integration_ms: 2}, noise: [{kind: white}]}").camera
    assert camera.detector == ElectronSensor(integration_ms=2.0)
    assert camera.band == (3.4, 4.9)
    assert camera.noise == (White(),)
    quieter = loads(SKY + "camera: {preset: uncooled_lwir}", overrides=["camera.noise.drift.pixel=0.5"]).camera
    plain = Camera(preset="uncooled_lwir").noise
    assert quieter.noise == (*plain[:4], plain[4].model_copy(update={"pixel": 0.5}), *plain[5:])


def test_default_noise_depends_on_the_detector() -> None:
    assert Camera().noise == Camera(detector=NetdSensor()).noise == (White(),)
    assert Camera(detector=ElectronSensor()).noise == (Shot(),)
    assert Camera.model_validate({"detector": {"kind": "electrons"}}).noise == (Shot(),)


@pytest.mark.parametrize(
    ("keys", "is_quiet"),
    [
        ("noise: []", True),
        ("noise: [], detector: {kind: electrons}", True),
        ("netd_mk: 0", True),
        ("netd_mk: 0, noise: [{kind: white}, {kind: drift, gain: 0.01}, {kind: bad_pixels}]", False),
        ("netd_mk: 0, detector: {kind: electrons}", False),
    ],
)
def test_a_camera_without_noise(keys: str, is_quiet: bool) -> None:
    background = "{kind: sky, horizon_k: 300, zenith_k: 300}"
    scene = Renderer(loads(f"frames: 3\nbackground: {background}\ncamera: {{size: [32, 24], {keys}}}"))
    assert (np.ptp([scene.frame(index)[0].image for index in range(2)]) == 0) == is_quiet


def test_range_wells_and_netd_are_as_documented() -> None:
    """Range: count 0 and full scale. Well: 37 % by 300 K in `cooled_mwir`. NETD by shot noise: 1 / sqrt(time)."""
    camera = Camera(range_k=(250.0, 350.0), band="lwir", noise=())
    light = radiance("lwir", np.array([[250.0, 350.0]])).astype(np.float32)
    np.testing.assert_array_equal(camera.signal_chain(0).expose(light, 0), [[0, 2**14 - 1]])
    response = Camera(preset="cooled_mwir").response()
    assert response.at(float(radiance((3.4, 4.9), 300.0))) / response.well == pytest.approx(0.37, abs=0.005)
    assert Camera(netd_mk=55.0).netd() == 55.0
    fast, slow = (
        Camera(detector=ElectronSensor(integration_ms=time, read_noise_e=0.0), band=(3.4, 4.9)) for time in (2.5, 10.0)
    )
    assert fast.netd() / slow.netd() == pytest.approx(2)


WRONG = {
    "preset: cooled": "camera.preset: unknown value 'cooled'; allowed: 'cooled_mwir', ",
    "detector: {kind: electrons}, noise: [{kind: shot}, {kind: shot, id: more}]": "more counts electrons that shot "
    "counts already; allowed: one noise that counts them",
    "noise: [{kind: shot}]": "shot counts electrons, and this detector has none; allowed: detector: {kind: electrons}",
    "detector: {kind: electrons}, rate_hz: 200": "camera.detector.integration_ms: 10.0 ms do not fit "
    "into a frame at 200.0 Hz; allowed: at most 5 ms",
    "detector: {kind: electron}": "unknown detector kind 'electron'; allowed: stated, electrons or module:Class; did",
    "preset: cooled_mwir, detector: {f_nmber: 2}": "camera.detector.f_nmber: unknown key",
    "correction: {period_frames: 5, freeze_frames: 5}": "a picture that is frozen for 5 of every 5 frames never",
    "correction: {frames: [0]}": "camera.correction.frames.0: 0 is out of range; allowed: a whole number, from 1",
    "falloff: {vignetting: 2}": "camera.falloff.vignetting: 2 is out of range",
    "bloom: {along: up}": "unknown value 'up'; allowed: 'columns', 'rows', 'around'",
    "smear: {time_ms: 41}": "41.0 ms do not fit into a frame at 30.0 Hz; allowed: at most 33.3333 ms",
    "smear: {}": "it is missing; allowed: a time in ms, or a detector of kind electrons",
}


@pytest.mark.parametrize(("keys", "line"), WRONG.items())
def test_wrong_cameras_are_one_line_each(keys: str, line: str) -> None:
    lines = errors_of(f"{SKY}camera: {{{keys}}}")
    assert any(line in each for each in lines), lines


# Vignetting


def test_vignetting_follows_its_two_laws() -> None:
    """The fourth power of the cosine of the angle off the axis, and the given share in the corners."""
    share = Vignetting().transmittance(Geometry((321, 241), 2e-3))
    assert share[120, 160] == 1
    angle = math.atan(math.hypot(160, 120) * 2e-3)
    np.testing.assert_allclose([share[0, 0], share[-1, -1], share[0, -1]], math.cos(angle) ** 4, rtol=1e-6)
    assert share[120, 0] == pytest.approx(math.cos(math.atan(160 * 2e-3)) ** 4)
    rims = Vignetting(cos4=False, vignetting=0.3).transmittance(Geometry((320, 240), 1e-3))
    np.testing.assert_allclose([rims[0, 0], rims[-1, -1]], 0.7, rtol=1e-6)
    assert rims[120, 160] == pytest.approx(1, abs=1e-4)
    assert (Vignetting(cos4=False).transmittance(Geometry((320, 240), 1e-3)) == 1).all()


def test_vignetting_darkens_the_picture_and_can_be_switched_off() -> None:
    text = "frames: 2\nbackground: {kind: sky, horizon_k: 300, zenith_k: 300}\ncamera: {preset: cooled_mwir, "
    text += "noise: [], size: [64, 48], ifov_mrad: 8, falloff: {vignetting: 0.2}}"
    dark = Renderer(loads(text)).frame(0)[0].image
    plain = Renderer(loads(text, overrides=["without=[falloff]"])).frame(0)[0].image
    corner = math.cos(math.atan(math.hypot(31.5, 23.5) * 8e-3)) ** 4 * 0.8
    assert dark[0, 0] / plain[0, 0] == pytest.approx(corner, rel=0.01)


def test_a_frame_with_response_time_is_that_in_sequence() -> None:
    text = "frames: 9\nbackground: {kind: ground}\ncamera: {preset: uncooled_lwir, size: [64, 48], rate_hz: 60}"
    text += "\ntargets: [{id: jet, shape: {kind: fighter}, path: {kind: straight, start: [5, 20], speed: 2}}]"
    in_order = Renderer(loads(text))
    last = [in_order.frame(index)[0].image for index in range(9)][-1]
    np.testing.assert_array_equal(Renderer(loads(text)).frame(8)[0].image, last)
    quick = Renderer(loads(text, overrides=["without=[lag]"])).frame(8)[0].image
    assert (quick != last).any()


# F-number and pitch are one truth


@pytest.mark.parametrize("optics", [{}, {"f_number": 2}, {"pitch_um": 12, "defocus_px": 1.0}, Lens(defocus_px=1.0)])
def test_optics_have_the_f_number_and_pitch_of_the_detector(optics: Any) -> None:
    camera = Camera.model_validate({"optics": optics, "detector": {"kind": "electrons", "f_number": 2, "pitch_um": 12}})
    assert camera.optics is not None
    assert (camera.optics.f_number, camera.optics.pitch_um) == (2, 12)
    alone = Camera.model_validate({"optics": {"f_number": 2}}).optics
    assert alone == Lens(f_number=2.0)
    preset = loads(SKY + "camera: {preset: cooled_lwir, optics: {}}")
    assert preset.camera.optics == Lens(f_number=2.0, pitch_um=15.0)
    assert loads(dumps(preset, short=True)) == preset


TWO_LENSES = SKY + "camera: {size: [16, 16], optics: {f_number: 2, pitch_um: 12}, detector: {kind: electrons}}"


def test_another_f_number_or_pitch_is_an_error() -> None:
    text = "camera.optics.{key}: {own} is not the {key} of the detector, {known}; allowed: {known}, or leave it out"
    assert errors_of(TWO_LENSES)[0].endswith(text.format(key="f_number", own=2, known=4))
    assert errors_of(TWO_LENSES.replace("f_number: 2, ", ""))[0].endswith(text.format(key="pitch_um", own=12, known=15))


def test_recordings_of_two_lenses_are_read_as_they_are() -> None:
    camera = loads(TWO_LENSES, trusted=False).camera
    assert camera.optics == Lens(f_number=2.0, pitch_um=12.0)
    assert camera.detector.optics == (4.0, 15.0)
