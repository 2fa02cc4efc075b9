"""Any value at any place, and any override, gives a scenario or an InputError (broken texts: test_strategies)."""

from __future__ import annotations

import copy
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scenario_text import TEXT

from irsim.config import yaml_text
from irsim.errors import InputError
from irsim.scenario.loader import dumps, loads

STEADY = settings(derandomize=True, max_examples=40, suppress_health_check=[HealthCheck.too_slow])


def scenario_or_input_error(text: str, *overrides: str) -> None:
    try:
        scenario = loads(text, overrides=overrides)
    except InputError as error:
        assert all(line.strip() for line in str(error).split("\n"))  # noqa: PT017 - an error is one of two results
    else:
        assert loads(dumps(scenario)) == scenario


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
