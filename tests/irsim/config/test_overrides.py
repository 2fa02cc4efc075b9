"""KEY=VALUE over a scenario: it reaches everything, and says where it does not."""

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


def test_overrides_reach_everything() -> None:
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
    assert scenario.occluders == ()
    assert scenario.about == "a=b"


def test_an_override_writes_no_key_beside_its_own() -> None:
    """So that nothing is warned of that nobody has set, and what goes with a key given first follows it."""
    assert unheeded("ground", ["atmosphere.surroundings_k=280"]) == []
    (line,) = unheeded("ground", ["atmosphere.visibility_km=9"])
    assert line.startswith("override atmosphere.visibility_km: warning: does not count")
    camera = loads("background: {kind: sky}", overrides=["camera.preset=uncooled_lwir"]).camera
    assert camera == loads("background: {kind: sky}\ncamera: {preset: uncooled_lwir}").camera


def test_an_override_starts_from_defaults() -> None:
    minimal = "background: {kind: sky}"
    scenario = loads(minimal, overrides=["camera.noise.white.ratio=3", "camera.bits=12"])
    assert scenario.camera == Camera(noise=(White(ratio=3.0),), bits=12)


def test_an_override_equals_the_edited_text() -> None:
    assert loads(TEXT, overrides=["targets.jet.path.speed=3"]) == loads(TEXT.replace("speed: 2", "speed: 3"))


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("frames", 1e3, "1e3"),
        ("frames", np.int64(30), "30"),
        ("camera.netd_mk", np.float32(0.5), "0.5"),
        ("camera.size", (40.0, 30), "[40.0, 30]"),
        ("camera.agc", Linear(tails=(0.1, 0.2)), "{kind: linear, tails: [0.1, 0.2]}"),
        ("without", (), "[]"),
        ("follow", None, ""),
    ],
)
def test_a_change_equals_the_override(key: str, value: object, text: str) -> None:
    assert change(loads(TEXT), {key: value}) == loads(TEXT, overrides=[f"{key}={text}"])


OVERRIDES_WRONG = {
    "camera.netd_mk=-1": "override camera.netd_mk: -1 is out of range; allowed: a number, ",
    "targets.0.path.speed=x": "override targets.0.path.speed: targets.jet.path.speed: expected a number, not 'x'; ",
    "camera={bits: 99}": "override camera: camera.bits: 99 is out of range; allowed: a whole number, from 8 to 16",
    "camra.netd_mk=3": "override camra.netd_mk: unknown key 'camra'; allowed: about, ",
    "camera.netd=3": "override camera.netd: unknown key 'netd'; allowed: preset, size, ",
    "targets.jte.path.speed=3": (
        "override targets.jte.path.speed: there is no 'jte'; allowed: jet, far; did you mean 'jet'?"
    ),
    "targets.2.path.speed=3": "override targets.2.path.speed: there is no '2'; allowed: jet, far",
    "camera.bits.x=3": "override camera.bits.x: there is no 'x' here: the key above it holds a single value",
    "seed.x=3": "override seed.x: there is no 'x' here: the key above it holds a single value",
    "camera.bits=[1": "override camera.bits: '[1':1:3: not YAML: ",
    "without=[wite]": "override without: without.0: there is no 'wite'; allowed: white, jet, far, ",
    "targets.jet.path={kind: weav}": "override targets.jet.path: targets.jet.path.kind: unknown path kind 'weav'; ",
    "background.kind=nosuch:Thing": (
        "override background.kind: cannot import 'nosuch:Thing': No module named 'nosuch'; allowed: sky, "
    ),
    "background.kind=os:path": "override background.kind: 'os:path' is no background kind; allowed: a subclass of ",
    "camera": "override 'camera': not KEY=VALUE; allowed: e.g. camera.netd_mk=80",
    "=3": "override '=3': not KEY=VALUE; allowed: e.g. camera.netd_mk=80",
}


@pytest.mark.parametrize("override", OVERRIDES_WRONG)
def test_a_wrong_override_says_so(override: str) -> None:
    lines = errors_of(TEXT, override)
    assert len(lines) == 1
    assert lines[0].startswith(OVERRIDES_WRONG[override]), lines[0]


def test_a_name_that_two_items_have_is_refused() -> None:
    text = TEXT.replace("kind: ar1, id: flicker, rho: 0.9,", "kind: white, id: white,")
    (line,) = errors_of(text, "camera.noise.white.ratio=2")
    assert line == "override camera.noise.white.ratio: there are 2 of 'white'; allowed: their numbers, from 0"


def test_all_wrong_overrides_are_told() -> None:
    assert len(errors_of(TEXT, "camra.bits=8", "seed=1", "targets.x.id=y")) == 2
