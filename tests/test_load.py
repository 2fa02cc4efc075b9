"""Scenarios from YAML: equal to their Python twins, errors with their places, overrides, text back."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field, ValidationError

import irsim
from irsim import yamlfile
from irsim.backgrounds import Sky
from irsim.backgrounds.sky import Clouds
from irsim.camera import Camera
from irsim.detector import Ar1, White
from irsim.display import Linear
from irsim.errors import InputError
from irsim.explain import explain
from irsim.kinds import Fraction, NotNegative, Pair, Part, Positive, Several
from irsim.loader import dumps, examples, load, loads, scalar
from irsim.motion.pan import Pan
from irsim.motion.straight import Straight
from irsim.occluders import Bar
from irsim.scenario import Scenario, Target
from irsim.schema import Slot, plain
from irsim.shapes.point import Point

TEXT = """\
about: a point crosses
seed: 7
frames: 1e1
camera:
  size: [64, 48]
  netd_mk: 60
  noise:
    - {kind: white}
    - {kind: ar1, id: flicker, rho: 0.9, ratio: 0.5}
  motion:
    - {kind: pan, azimuth_deg_s: 0.5}
background:
  kind: sky
  clouds:
    - {coverage: 0.3, wind_mrad_s: [1, 0]}
targets:
  - id: jet
    shape: {kind: point, temperature_k: 500}
    path: {kind: straight, start: [10, 20.5], speed: 2}
  - id: far
    shape: {kind: point}
    path: {kind: straight, start: [30, 10]}
occluders:
  - {kind: bar, range_m: 100, center_px: [40, 20], size_px: [6, 60]}
follow: jet
"""


def errors_of(text: str, *overrides: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        loads(text, "f.yaml", overrides)
    return str(caught.value).splitlines()


def test_yaml_equals_its_python_twin_bit_for_bit() -> None:
    twin = Scenario(
        about="a point crosses",
        seed=7,
        frames=10,
        camera=Camera(
            size=(64, 48),
            netd_mk=60.0,
            noise=(White(), Ar1(id="flicker", rho=0.9, ratio=0.5)),
            motion=(Pan(azimuth_deg_s=0.5),),
        ),
        background=Sky(clouds=(Clouds(coverage=0.3, wind_mrad_s=(1.0, 0.0)),)),
        targets=(
            Target(id="jet", shape=Point(temperature_k=500.0), path=Straight(start=(10.0, 20.5), speed=2.0)),
            Target(id="far", shape=Point(), path=Straight(start=(30.0, 10.0))),
        ),
        occluders=(Bar(range_m=100.0, center_px=(40.0, 20.0), size_px=(6.0, 60.0)),),
        follow="jet",
    )
    scenario = loads(TEXT)
    assert scenario == twin
    assert scenario.hash == twin.hash
    for (frame, truth), (twin_frame, twin_truth) in zip(irsim.frames(scenario), irsim.frames(twin), strict=True):
        assert np.array_equal(frame.image, twin_frame.image)
        assert truth == twin_truth


def test_public_names_load_whatever_was_imported_before() -> None:
    # `irsim.load` is the function: no module of that name may take its place.
    assert irsim.load is load
    assert irsim.loads(TEXT) == loads(TEXT)


def test_a_file_and_its_text_are_equal(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_text(TEXT)
    assert load(path) == load(str(path)) == loads(TEXT)


def test_shipped_examples_load_by_name() -> None:
    assert {"sky", "ground"} <= set(examples())
    for name, path in examples().items():
        assert load(name) == load(path)


def test_a_name_that_is_no_file_and_no_example() -> None:
    with pytest.raises(InputError, match=r"^skyy: there is no such file and no shipped .*did you mean 'sky'\?$"):
        load("skyy")
    with pytest.raises(InputError, match=r"^skyy.yaml: cannot read it: there is no such file$"):
        load("skyy.yaml")


# One wrong thing each: what TEXT says, what stands there instead, and the line's beginning and end.
WRONG = {
    "unknown key": ("frames: 1e1", "framse: 3", "3:1: framse: unknown key; allowed: about, seed,", "'frames'?"),
    "unknown key in a kind": ("rho:", "rhu:", "9:32: camera.noise.flicker.rhu: unknown key; allowed: kind, ", "'rho'?"),
    "unknown kind": ("kind: sky", "kind: sy", "13:9: background.kind: unknown background kind 'sy';", "'sky'?"),
    "no kind": ("kind: sky", "horizon_k: 280", "13:3: background: the key 'kind' is missing; allowed: sky", ""),
    "no mapping": (
        "{kind: point}",
        "5",
        "21:12: targets.far.shape: expected a mapping with the key 'kind'; allowed kinds: point",
        "",
    ),
    "fraction of a frame": (
        "1e1",
        "1.5",
        "3:9: frames: expected a whole number, not 1.5; allowed: a whole number, from 1 to 10000000",
        "",
    ),
    "yes is text": (
        "netd_mk: 60",
        "netd_mk: yes",
        "6:12: camera.netd_mk: expected a number, not 'yes'; allowed: a number, ",
        "",
    ),
    "quoted number": ("seed: 7", "seed: '7'", "2:7: seed: expected a whole number, not '7'; allowed: ", ""),
    "truth for a number": ("seed: 7", "seed: true", "2:7: seed: expected a whole number, not true; allowed: ", ""),
    "nothing for a number": ("seed: 7", "seed:", "2:6: seed: expected a whole number, not nothing; allowed: ", ""),
    "below the range": ("60", "-1", "6:12: camera.netd_mk: -1 is out of range; allowed: a number, ", ""),
    "infinite": ("60", ".inf", "6:12: camera.netd_mk: inf is out of range; allowed: a number, ", ""),
    "open end": (
        "coverage: 0.3",
        "coverage: 1",
        "15:18: background.clouds.clouds.coverage: 1 is out of range; allowed: a number, above 0, below 1",
        "",
    ),
    "choice": (
        "netd_mk: 60",
        "band: mwri",
        "6:9: camera.band: unknown value 'mwri'; allowed: 'mwir', 'lwir'; did you mean 'mwir'?",
        "",
    ),
    "item of a list": (
        "[64, 48]",
        "[64, 8]",
        "5:14: camera.size.1: 8 is out of range; allowed: a whole number, from 16 to 4096",
        "",
    ),
    "too few items": (
        "[64, 48]",
        "[64]",
        "5:9: camera.size: too few items; allowed: a list of 2, each a whole",
        "",
    ),
    "too many items": ("[64, 48]", "[64, 48, 3]", "5:9: camera.size: too many items; allowed: a list of 2, ", ""),
    "no list": ("[64, 48]", "64", "5:9: camera.size: expected a list, not 64; allowed: a list of 2, ", ""),
    "no name": ("id: far", "id: 1 x", "20:9: targets.1.id: '1 x' is not allowed; allowed: text, at most 64 char", ""),
    "missing key": ("    shape: {kind: point}\n", "", "20:5: targets.far.shape: it is missing; allowed: a mapping", ""),
    "id used twice": (
        "id: far",
        "id: jet",
        "20:9: targets.1.id: the id 'jet' is used twice; allowed: each id once",
        "",
    ),
    "nobody to follow": ("follow: jet", "follow: jat", "25:9: follow: there is no 'jat'; allowed: jet, far;", "'jet'?"),
    "values that clash": (
        "size: [64, 48]",
        "range_k: [300, 200]",
        "5:12: camera.range_k: 300.0 K is not below 200.0 K; allowed: the lower temperature first",
        "",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_an_error_says_place_key_what_is_wrong_and_what_is_allowed(case: str) -> None:
    old, new, begin, end = WRONG[case]
    assert TEXT.count(old) >= 1
    lines = errors_of(TEXT.replace(old, new, 1))
    assert len(lines) == 1
    assert lines[0].startswith(f"f.yaml:{begin}"), lines[0]
    assert lines[0].endswith(end)


def test_a_key_with_a_line_break_is_told_on_one_line() -> None:
    assert len(errors_of('"fra\\nmes": 3\nbackground: {kind: sky}')) == 1


def test_every_error_is_told_in_the_order_of_the_file() -> None:
    text = TEXT.replace("seed: 7", "seed: -7").replace("60", "x", 1).replace("rho: 0.9", "rho: 9").replace("sky", "sy")
    assert [line.split(": ")[1] for line in errors_of(text)] == [
        "seed",
        "camera.netd_mk",
        "camera.noise.flicker.rho",
        "background.kind",
    ]


@pytest.mark.parametrize("text", ["[1, 2]", "sky", "3"])
def test_a_text_that_is_no_mapping(text: str) -> None:
    assert errors_of(text)[0].startswith("f.yaml:1:1: expected a mapping; allowed: the keys about, seed, frames")


def test_whole_numbers_may_be_written_as_floats_and_the_other_way_round() -> None:
    scenario = loads(TEXT, overrides=["frames=2e1", "camera.size=[32.0, 3.2e1]", "camera.netd_mk=50"])
    assert (scenario.frames, scenario.camera.size, scenario.camera.netd_mk) == (20, (32, 32), 50.0)
    assert isinstance(scenario.frames, int)
    assert isinstance(scenario.camera.netd_mk, float)


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
    assert plain(scenario.background)["clouds"][0]["depth"] == 1
    assert scenario.camera.size == (80, 48)
    assert scenario.camera.agc == Linear(tails=(0.1, 0.2))
    assert scenario.occluders == ()
    assert scenario.about == "a=b"


def test_an_override_begins_from_defaults_where_the_text_is_silent() -> None:
    minimal = "background: {kind: sky}"
    scenario = loads(minimal, overrides=["camera.noise.white.ratio=3", "camera.bits=12"])
    assert scenario.camera == Camera(noise=(White(ratio=3.0),), bits=12)


def test_an_override_equals_the_edited_text() -> None:
    assert loads(TEXT, overrides=["targets.jet.path.speed=3"]) == loads(TEXT.replace("speed: 2", "speed: 3"))


OVERRIDES_WRONG = {
    "camera.netd_mk=-1": "override camera.netd_mk: -1 is out of range; allowed: a number, ",
    "targets.0.path.speed=x": "override targets.0.path.speed: targets.jet.path.speed: expected a number, not 'x'; ",
    "camera={bits: 99}": "override camera: camera.bits: 99 is out of range; allowed: a whole number, from 8 to 16",
    "camra.netd_mk=3": "override camra.netd_mk: unknown key 'camra'; allowed: about, ",
    "camera.netd=3": "override camera.netd: unknown key 'netd'; allowed: size, ",
    "targets.jte.path.speed=3": (
        "override targets.jte.path.speed: there is no 'jte'; allowed: jet, far; did you mean 'jet'?"
    ),
    "targets.2.path.speed=3": "override targets.2.path.speed: there is no '2'; allowed: jet, far",
    "camera.bits.x=3": "override camera.bits.x: there is no 'x' here: what stands above it is a single value",
    "seed.x=3": "override seed.x: there is no 'x' here: what stands above it is a single value",
    "camera.bits=[1": "override camera.bits: '[1':1:3: not YAML: ",
    "without=[wite]": "override without: without.0: there is no 'wite'; allowed: jet, far, bar, white, ",
    "targets.jet.path={kind: weav}": "override targets.jet.path: targets.jet.path.kind: unknown path kind 'weav'; ",
    "background.kind=nosuch:Thing": "override background.kind: cannot import 'nosuch:Thing': No module named 'nosuch'",
    "background.kind=os:path": "override background.kind: 'os:path' is no background kind; allowed: a subclass of ",
    "camera": "override 'camera': this is no KEY=VALUE; allowed: e.g. camera.netd_mk=80",
    "=3": "override '=3': this is no KEY=VALUE; allowed: e.g. camera.netd_mk=80",
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


@pytest.mark.parametrize(
    ("hint", "words"),
    [
        (NotNegative, "a number, 0 or more"),
        (Positive, "a number, above 0"),
        (Fraction, "a number, from 0 to 1"),
        (Annotated[int, Field(gt=2, le=9)], "a whole number, above 2, at most 9"),
        (bool, "true or false"),
        (float | None, "a number"),
        (Literal["a", "b"], "'a', 'b'"),
        (Fraction | Literal["auto"], "a number, from 0 to 1 or 'auto'"),
        (Pair, "a list of 2, each a number"),
        (tuple[int, str], "a list of 2, a whole number; text"),
        (Several[Positive], "a list, each item a number, above 0"),
        (Annotated[Several[int], Field(min_length=2)], "a list, each item a whole number, at least 2 items"),
        (Annotated[str, Field(pattern="^x+$", max_length=3)], "text, at most 3 characters, matching ^x+$"),
    ],
)
def test_what_is_allowed_in_plain_words(hint: Any, words: str) -> None:
    assert Slot.of(hint).words() == words


class Mixed(Part):
    gain: Fraction | Literal["auto"] = "auto"


def test_the_alternatives_of_a_union_are_one_error() -> None:
    document = yamlfile.parse("gain: 3", "f")
    with pytest.raises(ValidationError) as caught:
        Mixed.model_validate(document.value)
    assert explain(caught.value, document, Mixed) == [
        "f:1:7: gain: 3 is not allowed; allowed: a number, from 0 to 1 or 'auto'"
    ]


class Ramp(Sky):
    """A background of a user's own, named in YAML by its place."""

    slope_k: float = 1.0


def test_a_kind_of_the_users_own() -> None:
    text = f"background: {{kind: '{__name__}:Ramp', slope_k: 2}}"
    scenario = loads(text)
    assert scenario.background == Ramp(slope_k=2.0)
    assert loads(dumps(scenario)) == scenario
    (line,) = errors_of(text.replace("slope_k", "slop_k"))
    column = text.index("slope_k") + 1
    assert line.startswith(f"f.yaml:1:{column}: background.slop_k: unknown key; allowed: kind, ")
    assert line.endswith("did you mean 'slope_k'?")


def test_text_back_gives_the_equal_scenario() -> None:
    scenario = loads(TEXT)
    again = loads(dumps(scenario))
    assert again == scenario
    assert again.hash == scenario.hash


NUMBERS = st.floats(1e-3, 1e3)
PAIRS = st.tuples(NUMBERS, NUMBERS)
PARTS = st.builds(
    Scenario,
    about=st.text(),
    seed=st.integers(0, 2**63 - 1),
    frames=st.integers(1, 10_000_000),
    camera=st.builds(
        Camera,
        rate_hz=st.floats(1, 1e4),
        netd_mk=NUMBERS,
        noise=st.tuples(st.builds(White, ratio=NUMBERS)),
        motion=st.tuples(st.builds(Pan, id=st.sampled_from(["on", "null", "e1", "_"]), azimuth_deg_s=NUMBERS)),
    ),
    background=st.builds(Sky, horizon_k=st.floats(200, 300)),
    targets=st.tuples(
        st.builds(
            Target,
            id=st.from_regex(r"\A[A-Za-z_][A-Za-z0-9-]{1,9}\Z").map(lambda name: f"t{name}"),
            shape=st.builds(Point, temperature_k=NUMBERS),
            path=st.builds(Straight, start=PAIRS, speed=NUMBERS, heading_deg=st.floats(-180, 180)),
        )
    ),
)


@given(PARTS)
@settings(deadline=None)
def test_any_scenario_survives_its_text(scenario: Scenario) -> None:
    again = loads(dumps(scenario))
    assert again == scenario
    assert again.hash == scenario.hash


def scenario_or_input_error(text: str, *overrides: str) -> None:
    try:
        scenario = loads(text, overrides=overrides)
    except InputError as error:
        # One line for each thing that is wrong, and none without words.
        assert all(line.strip() for line in str(error).split("\n"))  # noqa: PT017
    else:
        assert loads(dumps(scenario)) == scenario


@given(st.text())
@settings(deadline=None)
def test_any_text_is_a_scenario_or_an_input_error(text: str) -> None:
    scenario_or_input_error(text)


@given(st.integers(0, len(TEXT)), st.integers(0, 8), st.text(max_size=6))
@settings(deadline=None)
def test_any_change_to_the_text_is_a_scenario_or_an_input_error(start: int, length: int, new: str) -> None:
    scenario_or_input_error(TEXT[:start] + new + TEXT[start + length :])


def nodes(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path] * bool(path) + [found for key, item in items for found in nodes(item, (*path, key))]


TREE = yamlfile.parse(TEXT).value
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.sampled_from(["pan", "jet"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["kind", "id", "x"]), inner),
    max_leaves=4,
)


@given(st.sampled_from(nodes(TREE)), VALUES)
@settings(deadline=None)
def test_any_value_in_any_place_is_a_scenario_or_an_input_error(path: tuple[Any, ...], value: Any) -> None:
    tree = copy.deepcopy(TREE)
    place = tree
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    scenario_or_input_error(yamlfile.write(tree))


@given(
    st.lists(st.sampled_from(["camera", "targets", "jet", "0", "noise", "kind", "path", "x", ""]), max_size=4), VALUES
)
@settings(deadline=None)
def test_any_override_is_a_scenario_or_an_input_error(steps: list[str], value: Any) -> None:
    scenario_or_input_error(TEXT, f"{'.'.join(steps)}={yamlfile.write(value)}")


def test_scalars_of_options() -> None:
    assert [scalar(text) for text in ("80", "on", "[64, 48]", "", "1e3")] == [80, "on", [64, 48], None, 1000.0]
