"""Any scenario survives its text; any text is a scenario or an InputError."""

from __future__ import annotations

import copy
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scenario_text import TEXT

from irsim.backgrounds import Sky
from irsim.camera.camera import Camera
from irsim.camera.noise import White
from irsim.config import yaml_text
from irsim.errors import InputError
from irsim.motion.camera_motion import Pan
from irsim.motion.scripted import Straight
from irsim.scenario.loader import dumps, loads
from irsim.scenario.model import Scenario
from irsim.targets.point import Point
from irsim.targets.target import Target

STEADY = settings(deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])

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
            shape=st.builds(Point, temperature_k=st.floats(1, 1e3)),
            path=st.builds(Straight, start=PAIRS, speed=NUMBERS, heading_deg=st.floats(-180, 180)),
        )
    ),
)


@given(PARTS)
@STEADY
def test_any_scenario_survives_its_text(scenario: Scenario) -> None:
    again = loads(dumps(scenario))
    assert again == scenario
    assert again.hash == scenario.hash


def scenario_or_input_error(text: str, *overrides: str) -> None:
    try:
        scenario = loads(text, overrides=overrides)
    except InputError as error:
        # One line for each thing that is wrong, and none without words.
        assert all(line.strip() for line in str(error).split("\n"))  # noqa: PT017 - an error may come, and need not
    else:
        assert loads(dumps(scenario)) == scenario


@given(st.text())
@STEADY
def test_any_text_is_a_scenario_or_an_input_error(text: str) -> None:
    scenario_or_input_error(text)


@given(st.integers(0, len(TEXT)), st.integers(0, 8), st.text(max_size=6))
@STEADY
def test_any_changed_text_is_a_scenario_or_input_error(start: int, length: int, new: str) -> None:
    scenario_or_input_error(TEXT[:start] + new + TEXT[start + length :])


def nodes(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path] * bool(path) + [found for key, item in items for found in nodes(item, (*path, key))]


TREE = yaml_text.parse_yaml(TEXT).value
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.sampled_from(["pan", "jet"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["kind", "id", "x"]), inner),
    max_leaves=4,
)


@given(st.sampled_from(nodes(TREE)), VALUES)
@STEADY
def test_any_value_anywhere_is_a_scenario_or_input_error(path: tuple[Any, ...], value: Any) -> None:
    tree = copy.deepcopy(TREE)
    place = tree
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    scenario_or_input_error(yaml_text.write_yaml(tree))


@given(
    st.lists(st.sampled_from(["camera", "targets", "jet", "0", "noise", "kind", "path", "x", ""]), max_size=4), VALUES
)
@STEADY
def test_any_override_is_a_scenario_or_an_input_error(steps: list[str], value: Any) -> None:
    scenario_or_input_error(TEXT, f"{'.'.join(steps)}={yaml_text.write_yaml(value)}")
