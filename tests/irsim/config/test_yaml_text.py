"""YAML by the 1.2 core schema, with places; invalid text is an InputError with a place."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from irsim.config.yaml_text import MOST_VALUES, parse_yaml, read_yaml, scalar, write_yaml
from irsim.errors import InputError


# YAML 1.2.2, example 10.9 "Core Tag Resolution" and its table; then values that PyYAML alone reads by YAML 1.1.
@pytest.mark.parametrize(
    ("text", "value"),
    [
        *[("null", None), ("~", None), ("", None), ("True", True), ("FALSE", False)],
        *[("0", 0), ("0o7", 7), ("0x3A", 58), ("-19", -19), ("010", 10), ("0o10", 8)],
        *[("0.", 0.0), (".5", 0.5), ("+12e03", 12000.0), ("-2E+05", -200000.0), ("1e3", 1000.0)],
        *[(".inf", math.inf), ("-.Inf", -math.inf)],
        *[(text, text) for text in ("on", "No", "y", "0b11", "1_000", "12:30:45", "2024-01-01", "<<", "=")],
        *[("'80'", "80"), ("!!str 80", "80"), ("!!int '80'", 80), ("!!float '1'", 1.0)],
        *[("[64, 48]", [64, 48]), ("{kind: sky, clouds: []}", {"kind": "sky", "clouds": []})],
    ],
)
def test_core_schema(text: str, value: Any) -> None:
    found = scalar(text)
    assert type(found) is type(value)
    assert found == value


def test_places_are_of_keys_and_values() -> None:
    text = "camera:\n  size: [320, 240]\ntargets:\n  - id: jet\n    path: {speed: 2}\n"
    document = parse_yaml(text, "f.yaml")
    assert document.value == {"camera": {"size": [320, 240]}, "targets": [{"id": "jet", "path": {"speed": 2}}]}
    assert document.keys[("camera",)] == "f.yaml:1:1"
    assert document.values[("camera",)] == "f.yaml:2:3"
    assert document.values[("camera", "size", 1)] == "f.yaml:2:15"
    assert document.values[("targets", 0)] == "f.yaml:4:5"
    assert document.keys[("targets", 0, "path", "speed")] == "f.yaml:5:12"
    assert document.values[("targets", 0, "path", "speed")] == "f.yaml:5:19"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("# nothing\n", "f.yaml:1:1: it is empty; allowed: "),
        ("a: 1\nb:\n  c: 1\n  c: 2\n", "f.yaml:4:3: b.c: duplicate key, first at f.yaml:3:3"),
        ("1: 2", "f.yaml:1:1: a key that is not text; allowed: text"),
        ("a:\n\t- b", "f.yaml:2:1: a tab stands here; allowed: spaces"),
        ("a: 1\n---\nb: 1", "f.yaml:2:1: a second document begins; allowed: one document a file"),
        ("a: &x [*x]", "f.yaml:1:4: an alias that holds itself; allowed: aliases of values that end before them"),
        ("a: *u", "f.yaml:1:4: not YAML: found undefined alias 'u'; allowed: *NAME of a value marked"),
        ("a: [1,", "f.yaml:1:7: not YAML: while parsing a flow node: expected the node content, but found '<stream e"),
        ("a: b: c", "f.yaml:1:5: not YAML: mapping values are not allowed here; allowed: one KEY: VALUE"),
        ("a: !!python/name:os.system x", "f.yaml:1:4: 'x' cannot have the tag !!python/name:os.system"),
        ("a: !thing {b: 1}", "f.yaml:1:4: the tag !thing stands here; allowed: !!map, or no tag"),
        ("a: 1\nb: \x07", "f.yaml:2:4: the character U+0007 stands here; allowed: printable text"),
        ("a: " + "9" * 5000, "f.yaml:1:4: the number 99999999999999999999... is too long; allowed: 4300 digits"),
        ("a: 0x" + "f" * 5000, "f.yaml:1:4: the number 0xffffffffffffffffff... is too long; allowed: 4300 digits"),
        ("[" * 2000, "f.yaml: nested too deeply; allowed: "),
    ],
)
def test_invalid_yaml_is_one_line_with_its_place(text: str, line: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_yaml(text, "f.yaml")
    assert str(caught.value).startswith(line)
    assert "\n" not in str(caught.value)


def test_aliases_are_limited() -> None:
    assert parse_yaml("a: &x [1, 2]\nb: *x").value == {"a": [1, 2], "b": [1, 2]}
    levels = [f"l{n}: &l{n} [{', '.join([f'*l{n - 1}'] * 10)}]" for n in range(1, 9)]
    with pytest.raises(InputError, match=f"too many values; allowed: {MOST_VALUES}, aliases written out"):
        parse_yaml("\n".join(["l0: &l0 [1]", *levels]))


def test_all_duplicates_are_reported() -> None:
    with pytest.raises(InputError) as caught:
        parse_yaml("a: 1\na: 2\nb: 1\nb: 2\n", "f")
    assert [line.split(": ")[0] for line in str(caught.value).splitlines()] == ["f:2:1", "f:4:1"]


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    latin, marked = tmp_path / "latin.yaml", tmp_path / "bom.yaml"
    latin.write_bytes(b"a: 1\nb: caf\xe9\n")
    marked.write_bytes(b"\xef\xbb\xbfa: 1\n")
    for path, expected in {
        latin: f"{latin}:2:7: this is not UTF-8 text; allowed: UTF-8",
        tmp_path: f"{tmp_path}: cannot read it: Is a directory",
        tmp_path / "none.yaml": f"{tmp_path / 'none.yaml'}: cannot read it: there is no such file",
    }.items():
        with pytest.raises(InputError) as caught:
            read_yaml(path)
        assert str(caught.value) == expected
    assert read_yaml(marked).value == {"a": 1}


STEADY = settings(derandomize=True, max_examples=40, suppress_health_check=[HealthCheck.too_slow])
SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
TREES = st.recursive(SCALARS, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=10)


@given(TREES)
@STEADY
@example({"a": "1e3", "b": "0o10", "c": "on", "d": 1e17, "e": "~", "f": "2024-01-01", "g": "a\x85b", "h": -0.0})
def test_written_text_reads_back(value: Any) -> None:
    assert parse_yaml(write_yaml(value)).value == value


@given(st.text())
@STEADY
def test_any_text_gives_a_value_or_an_input_error(text: str) -> None:
    with contextlib.suppress(InputError):
        parse_yaml(text)
