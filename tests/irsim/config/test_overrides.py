"""KEY=VALUE over a scenario: it reaches every key, and an error names the key that does not exist."""

from __future__ import annotations

import numpy as np
import pytest
from scenario_text import TEXT, errors_of

from irsim.camera.agc import Linear
from irsim.camera.ar1 import Ar1
from irsim.camera.camera import Camera
from irsim.camera.noise import White
from irsim.config.serialization import plain_value
from irsim.lint.warnings import unheeded
from irsim.motion.scripted import Straight
from irsim.scenario.loader import change, loads


def test_overrides_reach_every_key() -> None:
    scenario = loads(
        TEXT,
        overrides=[
            "camera.netd_mk=80",
            "targets.jet.path.speed=3",
            "targets.1.path.speed=1.5",
            "camera.noise.white.ratio=2",
            "camera.noise.flicker.rho=0.5",
            "background.clouds.clouds.depth=1",
            "camera.size.0=80",
            "camera.agc.tails=[0.1, 0.2]",
            "occluders=[]",
            "about=a=b",
        ],
    )
    assert scenario.camera.netd_mk == 80
    assert [target.path for target in scenario.targets] == [
        Straight(start=(10.0, 20.5), speed=3.0),
        Straight(start=(30.0, 10.0), speed=1.5),
    ]
    assert scenario.camera.noise == (White(ratio=2.0), Ar1(id="flicker", rho=0.5, ratio=0.5))
    assert plain_value(scenario.background)["clouds"][0]["depth"] == 1
    assert scenario.camera.size == (80, 48)
    assert scenario.camera.agc == Linear(tails=(0.1, 0.2))
    assert (scenario.occluders, scenario.about) == ((), "a=b")


def test_an_override_writes_no_other_key() -> None:
    """Keys with the default stay unwritten: no warning about them, and they follow a preset that is given later."""
    assert unheeded("ground", ["atmosphere.surroundings_k=280"]) == []
    (line,) = unheeded("ground", ["atmosphere.visibility_km=9"])
    assert line.startswith("override atmosphere.visibility_km: warning: does not count")
    camera = loads("background: {kind: sky}", overrides=["camera.preset=uncooled_lwir"]).camera
    assert camera == loads("background: {kind: sky}\ncamera: {preset: uncooled_lwir}").camera


def test_an_override_starts_from_defaults() -> None:
    scenario = loads("background: {kind: sky}", overrides=["camera.noise.white.ratio=3", "camera.bits=12"])
    assert scenario.camera == Camera(noise=(White(ratio=3.0),), bits=12)


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("frames", 1e3, "1e3"),
        ("frames", np.int64(30), "30"),
        ("camera.netd_mk", np.float32(0.5), "0.5"),
        ("camera.size", (40.0, 30), "[40.0, 30]"),
        ("camera.agc", Linear(tails=(0.1, 0.2)), "{kind: linear, tails: [0.1, 0.2]}"),
        ("follow", None, ""),
    ],
)
def test_a_change_equals_the_override(key: str, value: object, text: str) -> None:
    assert change(loads(TEXT), {key: value}) == loads(TEXT, overrides=[f"{key}={text}"])


TWO_OF_WHITE = TEXT.replace("kind: ar1, id: flicker, rho: 0.9,", "kind: white, id: white,")


@pytest.mark.parametrize(
    ("override", "line"),
    [
        ("camera.netd_mk=-1", "override camera.netd_mk: -1 is out of range; allowed: a number, "),
        ("targets.0.path.speed=x", "override targets.0.path.speed: targets.jet.path.speed: expected a number, not 'x'"),
        ("camera={bits: 99}", "override camera: camera.bits: 99 is out of range; allowed: a whole number, from 8 to"),
        ("camra.netd_mk=3", "override camra.netd_mk: unknown key 'camra'; allowed: about, "),
        ("targets.jte.id=a", "override targets.jte.id: there is no 'jte'; allowed: jet, far; did you mean 'jet'?"),
        ("seed.x=3", "override seed.x: there is no 'x' here: the key above it holds a single value"),
        ("camera.bits=[1", "override camera.bits: '[1':1:3: not YAML: "),
        ("background.kind=nosuch:Thing", "override background.kind: cannot import 'nosuch:Thing': No module named"),
        ("background.kind=os:path", "override background.kind: 'os:path' is no background kind; allowed: a subclass"),
        ("=3", "override '=3': not KEY=VALUE; allowed: e.g. camera.netd_mk=80"),
    ],
)
def test_a_wrong_override_is_one_line(override: str, line: str) -> None:
    (found,) = errors_of(TEXT, override)
    assert found.startswith(line)


def test_keys_of_other_programs_get_a_guess() -> None:
    (found,) = errors_of(TEXT, "camera.fps=25")
    assert found.endswith("did you mean 'rate_hz'?")


def test_all_wrong_overrides_are_reported() -> None:
    assert len(errors_of(TEXT, "camra.bits=8", "seed=1", "targets.x.id=y")) == 2
    (line,) = errors_of(TWO_OF_WHITE, "camera.noise.white.ratio=2")
    assert line == "override camera.noise.white.ratio: there are 2 of 'white'; allowed: their numbers, from 0"
