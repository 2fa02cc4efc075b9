"""Contract of every registered kind of every family."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import jsonschema
import pytest
from mesh_files import GIVEN
from part_tree import parts
from pydantic import ValidationError

import irsim
from irsim.backgrounds import BACKGROUNDS
from irsim.camera import AGCS, FRAME_FAULTS, NOISES, SENSORS
from irsim.config.base import Family, Kind
from irsim.config.fields import field_docs
from irsim.config.schema import Slot
from irsim.config.serialization import brief_value, plain_value
from irsim.config.yaml_text import parse_yaml, write_yaml
from irsim.motion import CAMERA_MOTIONS, PATHS
from irsim.occluders import OCCLUDERS
from irsim.scenario.expectation import EXPECTATIONS
from irsim.scenario.variation import VARIATIONS
from irsim.targets import SHAPES

FAMILIES = (
    *(BACKGROUNDS, SENSORS, NOISES, AGCS, EXPECTATIONS, FRAME_FAULTS),
    *(PATHS, CAMERA_MOTIONS, OCCLUDERS, SHAPES, VARIATIONS),
)
REQUIRED: dict[str, Any] = {
    "start": [10, 20],
    "start_m": [0, 900, 0],
    "target": "jet",
    "at_frame": 5,
    "range_m": 800,
    "px": 5,
    "low": 1,
    "high": 9,
    "mean": 5,
    "sd": 1,
    "values": [1, 2],
    "frames": 5,
    "per_minute": 1,
    "per_frame": 1,
}
"""Values of required keys, by key."""
BESIDE: dict[str, dict[str, Any]] = {
    "ar1": {"rho": 0.8},
    "noise_3d": {"t": 0.5},
    "drop": {"frames": [1]},
    "duplicate": {"frames": [2]},
    "waypoints": {"points": [[10, 10], [20, 10]], "speed": 2},
    "waypoints_m": {"points": [[0, 900, 0], [50, 900, 0]], "speed_m_s": 20},
    "bar": {"center_px": [40, 40], "size_px": [9, 50]},
    "pole": {"foot_px": [40, 60], "height_px": 40, "width_px": 4},
    "tree": {"foot_px": [40, 60], "height_px": 40, "crown_px": [20, 24]},
    "building": {"foot_px": [40, 60], "size_px": [24, 30]},
    "smoke": {"center_px": [40, 40], "size_px": [24, 20]},
    **GIVEN,
}
"""Keys that a kind needs by its own rules."""
KINDS = [pytest.param(family, word, id=f"{family.name}-{word}") for family in FAMILIES for word, _ in family]


@pytest.fixture(scope="module")
def footage(tmp_path_factory: pytest.TempPathFactory) -> str:
    text = "{frames: 1, camera: {size: [16, 16], range_k: [250, 330]}, background: {kind: ground}}"
    path = tmp_path_factory.mktemp("kinds") / "footage.mcap"
    return str(irsim.record(irsim.Rendering(irsim.loads(text)), path))


@pytest.fixture
def text(family: Family, word: str, footage: str) -> dict[str, Any]:
    """The shortest text of a kind."""
    needed = [key for key, field in family.kinds[word].model_fields.items() if field.is_required()]
    own = BESIDE.get(word, {})
    given = {"file": footage, **REQUIRED, **own}
    return {"kind": word, **{key: given[key] for key in needed}, **own}


@pytest.mark.parametrize(("family", "word"), KINDS)
def test_a_kind_keeps_its_contract(family: Family, word: str, text: dict[str, Any]) -> None:
    kind = family.kinds[word]
    value = family.parse(text)
    assert (type(value), value.kind) == (kind, word)
    assert issubclass(kind, family.base)
    for written in (plain_value(value), brief_value(value), value.model_dump()):
        again = family.parse(parse_yaml(write_yaml({"kind": word, **written})).value)
        assert again == value
        assert isinstance(hash(again), int)
    with pytest.raises(ValidationError, match="frozen"):
        setattr(value, next(iter(kind.model_fields), "any"), 1)
    with pytest.raises(Exception, match="1 errors"):
        family.parse({**text, "no_such_key": 1})
    assert len((kind.__doc__ or "").split()) > 2
    for key, field in kind.model_fields.items():
        slot = Slot.of(field.annotation, field.metadata)
        assert key in field_docs(kind) or key == "emissivity" or slot.part(None), f"{key} has no documentation"


PLACES: dict[str, list[str | int]] = {
    "background": ["background"],
    "detector": ["camera", "detector"],
    "noise": ["camera", "noise", 0],
    "agc": ["camera", "agc"],
    "expectation": ["expect", 0],
    "fault": ["camera", "faults", 0],
    "path": ["targets", 0, "path"],
    "camera motion": ["camera", "motion", 0],
    "occluder": ["occluders", 0],
    "shape": ["targets", 0, "shape"],
    "variation": ["vary", "seed"],
}
"""Place of a family in a scenario."""


def test_the_schema_selects_keys_by_kind() -> None:
    validator = jsonschema.Draft202012Validator(irsim.Scenario.model_json_schema())
    for family in FAMILIES:
        word, kind = next(iter(family))
        place = PLACES[family.name]
        needed = {key: REQUIRED[key] for key, field in kind.model_fields.items() if field.is_required()}
        wrong: Any = {"kind": word, **needed, "no_such_key": 1}
        for step in reversed(place[1:]):
            wrong = [wrong] if step == 0 else {step: wrong}
        found = validator.iter_errors({"background": {"kind": "ground"}, str(place[0]): wrong})
        assert place in [list(error.absolute_path) for error in found]


def test_every_kind_is_reached_from_a_scenario() -> None:
    assert {kind for family in FAMILIES for _, kind in family} <= set(parts(irsim.Scenario))


def test_only_files_are_read_before_validation() -> None:
    """Short texts are complete without other validators that fill keys."""
    own = {
        part.__name__
        for part in parts(irsim.Scenario)
        for name, decorator in part.__pydantic_decorators__.model_validators.items()
        if decorator.info.mode != "after" and name != "_fill"
    }
    assert own == {"Recorded", "MeshShape"}


class Ladder(Kind):
    """A kind in no table."""


def test_a_kind_outside_of_tables_is_named_by_its_module() -> None:
    assert Ladder.kind == f"{__name__}:Ladder"


IMPORTS = """
import sys, irsim.cli.app, irtrack.cli.app
print("help", *({"numpy", "pydantic"} & set(sys.modules)))
irsim.load("sky")
print("load", *({"irsim.lint", "scipy", "matplotlib", "hypothesis", "jinja2"} & set(sys.modules)))
"""


def test_imports_leave_out_slow_packages() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORTS], capture_output=True, text=True, check=True)
    assert done.stdout == "help\nload\n"
