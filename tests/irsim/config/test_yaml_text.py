"""YAML by the 1.2 core schema, with places, and nothing but InputError for what is no YAML."""

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
from irsim.scenario.loader import load


# YAML 1.2.2, example 10.9 "Core Tag Resolution", and the rows of the table before it.
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("null", None),
        ("~", None),
        ("", None),
        ("true", True),
        ("True", True),
        ("false", False),
        ("FALSE", False),
        ("0", 0),
        ("0o7", 7),
        ("0x3A", 58),
        ("-19", -19),
        ("0.", 0.0),
        ("-0.0", -0.0),
        (".5", 0.5),
        ("+12e03", 12000.0),
        ("-2E+05", -200000.0),
        (".inf", math.inf),
        ("-.Inf", -math.inf),
        ("+.INF", math.inf),
    ],
)
def test_core_schema(text: str, value: Any) -> None:
    found = scalar(text)
    assert type(found) is type(value)
    assert found == value


def test_core_schema_nan() -> None:
    assert math.isnan(scalar(".NAN"))


# Numbers or booleans in YAML 1.1, in 1.2 not: what PyYAML alone gets wrong.
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("on", "on"),
        ("off", "off"),
        ("yes", "yes"),
        ("No", "No"),
        ("y", "y"),
        ("1e3", 1000.0),
        ("1.5e3", 1500.0),
        ("010", 10),
        ("0o10", 8),
        ("0b11", "0b11"),
        ("1_000", "1_000"),
        ("12:30:45", "12:30:45"),
        ("2024-01-01", "2024-01-01"),
        ("<<", "<<"),
        ("=", "="),
    ],
)
def test_not_yaml_1_1(text: str, value: Any) -> None:
    found = scalar(text)
    assert type(found) is type(value)
    assert found == value


@pytest.mark.parametrize(
    ("text", "value"),
    [("'80'", "80"), ('"on"', "on"), ("!!str 80", "80"), ("!!int '80'", 80), ("!!float '1'", 1.0)],
)
def test_quotes_and_tags_decide(text: str, value: Any) -> None:
    found = scalar(text)
    assert type(found) is type(value)
    assert found == value


def test_flow_collections_as_one_value() -> None:
    assert scalar("[64, 48]") == [64, 48]
    assert scalar("{kind: sky, clouds: []}") == {"kind": "sky", "clouds": []}


# YAML 1.2.2, 6.2 "Separation Spaces": a tab is one within a line, and 5.5: it may stand within a plain text, too.
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("frames:\t3\nbackground: {kind: ground}\n", {"frames": 3, "background": {"kind": "ground"}}),
        ("{kind:\tground,\tat:\t[1\t,\t2\t]\t}", {"kind": "ground", "at": [1, 2]}),
        ("a\t:\t\tb \t # c\n'd'\t:\te\t\n", {"a": "b", "d": "e"}),
        ("-\ta\n- \tb\n-\t\n  c: 1\n", ["a", "b", {"c": 1}]),
        ("a: &x\t3\nb:\t*x\t\n", {"a": 3, "b": 3}),
        ("\t\na: 1\n\t# c\n \t\nb: 2\n\t", {"a": 1, "b": 2}),
        ("a: {\n\tb: 1,\n\tc: [d e\n\t\tf]\n\t}\n", {"a": {"b": 1, "c": ["d e f"]}}),
        ("a: b\tc  \td\t\n  e\n", {"a": "b\tc  \td e"}),
        ("a: |\n  b\tc\n", {"a": "b\tc\n"}),
        ("--- \ta", "a"),
    ],
)
def test_tabs_that_separate_are_as_spaces(text: str, value: Any) -> None:
    assert parse_yaml(text).value == value


def test_places_behind_a_tab_count_characters() -> None:
    document = parse_yaml("a:\tb\nc: {d:\t\te}\n", "f.yaml")
    assert document.values[("a",)] == "f.yaml:1:4"
    assert document.values[("c", "d")] == "f.yaml:2:9"


def test_places_are_of_keys_and_values() -> None:
    text = "camera:\n  size: [320, 240]\ntargets:\n  - id: jet\n    path: {speed: 2}\n"
    document = parse_yaml(text, "f.yaml")
    assert document.value == {"camera": {"size": [320, 240]}, "targets": [{"id": "jet", "path": {"speed": 2}}]}
    assert document.keys[("camera",)] == "f.yaml:1:1"
    assert document.values[("camera",)] == "f.yaml:2:3"
    assert document.keys[("camera", "size")] == "f.yaml:2:3"
    assert document.values[("camera", "size", 1)] == "f.yaml:2:15"
    assert document.values[("targets", 0)] == "f.yaml:4:5"
    assert document.keys[("targets", 0, "path", "speed")] == "f.yaml:5:12"
    assert document.values[("targets", 0, "path", "speed")] == "f.yaml:5:19"


def test_aliases_are_written_out() -> None:
    assert parse_yaml("a: &x [1, 2]\nb: *x").value == {"a": [1, 2], "b": [1, 2]}


BAD = {
    "empty": ("", "f.yaml:1:1: it is empty; allowed: "),
    "only a comment": ("# nothing\n", "f.yaml:1:1: it is empty"),
    "duplicate key": ("a: 1\nb:\n  c: 1\n  c: 2\n", "f.yaml:4:3: b.c: duplicate key, first at f.yaml:3:3"),
    "duplicate key in quotes": ("a: 1\n'a': 2\n", "f.yaml:2:1: a: duplicate key, first at f.yaml:1:1"),
    "number for a key": ("1: 2", "f.yaml:1:1: a key that is not text; allowed: text"),
    "list for a key": ("? [a]\n: 3", "f.yaml:1:3: a key that is not text; allowed: text"),
    "tab": ("a:\n\t- b", "f.yaml:2:1: a tab cannot indent YAML; allowed: spaces"),
    "tab that indents below one that separates": (
        "a:\t3\nb:\n \tc: 1",
        "f.yaml:3:2: a tab cannot indent YAML; allowed: s",
    ),
    "tab before a key of a list's entry": (
        "a:\n  -\tb\n  -\tc: 1",
        "f.yaml:3:4: a tab stands before a list's entry or a ",
    ),
    "tab before an entry of an entry": (
        "-\t- a",
        "f.yaml:1:2: a tab stands before a list's entry or a key here; allowed: ",
    ),
    "tab behind a tag": ("a: !!int\t3", "f.yaml:1:9: a tab stands here; allowed: a space"),
    "tab behind a bar": ("a: |\t\n  x", "f.yaml:1:5: a tab stands here; allowed: a space"),
    "tab for a name": ("a: &\tb", "f.yaml:1:5: not YAML: while scanning an anchor: expected alphabetic"),
    "two keys in a line with a tab elsewhere": ("-\tb\nc: d: e", "f.yaml:2:1: not YAML: "),
    "two documents": ("a: 1\n---\nb: 1", "f.yaml:2:1: a second document begins; allowed: one document a file"),
    "alias in itself": (
        "a: &x [*x]",
        "f.yaml:1:4: an alias that holds itself; allowed: aliases of values that end before them",
    ),
    "unknown alias": ("a: *u", "f.yaml:1:4: not YAML: found undefined alias 'u'; allowed: *NAME of a value marked"),
    "open bracket": (
        "a: [1",
        "f.yaml:1:6: not YAML: while parsing a flow sequence: expected ',' or ']', but got '<stream end>'; allowed: a "
        "list that ends in ]",
    ),
    "open bracket at the end": (
        "a: [1,",
        "f.yaml:1:7: not YAML: while parsing a flow node: expected the node content, but found '<stream end>'; "
        "allowed: each [ and { closed",
    ),
    "open quote": (
        "a: 'x",
        "f.yaml:1:6: not YAML: while scanning a quoted scalar: found unexpected end of stream; allowed: a text that "
        "ends in the quote",
    ),
    "mapping in a line": (
        "a: b: c",
        "f.yaml:1:5: not YAML: mapping values are not allowed here; allowed: one KEY: VALUE",
    ),
    "python tag": ("a: !!python/name:os.system x", "f.yaml:1:4: 'x' cannot have the tag !!python/name:os.system"),
    "tag on a mapping": ("a: !thing {b: 1}", "f.yaml:1:4: the tag !thing stands here; allowed: !!map, or no tag"),
    "tag that lies": ("a: !!int z", "f.yaml:1:4: 'z' cannot have the tag !!int; allowed: no tag"),
    "control character": ("a: 1\nb: \x07", "f.yaml:2:4: the character U+0007 stands here; allowed: printable text"),
    "escape past Unicode": ('a: "\\Uffffffff"', "f.yaml: not YAML: "),
    "endless number": (
        "a: " + "9" * 5000,
        "f.yaml:1:4: the number 99999999999999999999... is too long; allowed: 4300 digits",
    ),
    "endless hexadecimal number": (
        "a: 0x" + "f" * 5000,
        "f.yaml:1:4: the number 0xffffffffffffffffff... is too long; allowed: 4300 digits",
    ),
    "endless octal number": (
        "a: 0o" + "7" * 5000,
        "f.yaml:1:4: the number 0o777777777777777777... is too long; allowed: 4300 digits",
    ),
    "deep nesting": ("[" * 20_000, "f.yaml: nested too deeply; allowed: "),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_yaml_is_one_line_with_its_place(case: str) -> None:
    text, expected = BAD[case]
    with pytest.raises(InputError) as caught:
        parse_yaml(text, "f.yaml")
    assert str(caught.value).startswith(expected)
    assert "\n" not in str(caught.value)


def test_an_alias_bomb_is_refused() -> None:
    levels = [f"l{n}: &l{n} [{', '.join([f'*l{n - 1}'] * 10)}]" for n in range(1, 9)]
    with pytest.raises(InputError, match=f"too many values; allowed: {MOST_VALUES}, aliases written out"):
        parse_yaml("\n".join(["l0: &l0 [1]", *levels]))


def test_all_duplicates_are_told() -> None:
    with pytest.raises(InputError) as caught:
        parse_yaml("a: 1\na: 2\nb: 1\nb: 2\n", "f")
    assert [line.split(": ")[0] for line in str(caught.value).splitlines()] == ["f:2:1", "f:4:1"]


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    latin = tmp_path / "latin.yaml"
    latin.write_bytes(b"a: 1\nb: caf\xe9\n")
    zero = tmp_path / "zero.yaml"
    zero.write_bytes(b"a: 1\nb: 2\0\n")
    cases = {
        latin: f"{latin}:2:7: this is not UTF-8 text; allowed: UTF-8",
        zero: f"{zero}:2:5: a zero byte stands here; allowed: text, without any",
        tmp_path: f"{tmp_path}: cannot read it: Is a directory",
        tmp_path / "none.yaml": f"{tmp_path / 'none.yaml'}: cannot read it: there is no such file",
    }
    for path, expected in cases.items():
        with pytest.raises(InputError) as caught:
            read_yaml(path)
        assert str(caught.value) == expected


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("text", ["frames: 3\r\nabout: caf\xe9\r\n", "a: 1\n" * 4000])
def test_a_file_in_utf_16_is_told_as_that(tmp_path: Path, encoding: str, text: str) -> None:
    """However it is asked for: as a scenario, too."""
    path = tmp_path / "wide.yaml"
    path.write_bytes(text.encode(encoding))
    for ask in (read_yaml, load):
        with pytest.raises(InputError) as caught:
            ask(path)
        what = "looks like UTF-16 text, as some editors write; allowed: UTF-8 (save it as that)"
        assert str(caught.value) == f"{path}: {what}"


def test_a_byte_order_mark_is_no_matter(tmp_path: Path) -> None:
    path = tmp_path / "bom.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\n")
    assert read_yaml(path).value == {"a": 1}


STEADY = settings(deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])

SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
TREES = st.recursive(SCALARS, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=10)


@given(TREES)
@STEADY
@example({"a": "1e3", "b": "0o10", "c": "on", "d": 1e17, "e": "~", "f": "2024-01-01"})
def test_written_text_reads_back(value: Any) -> None:
    assert parse_yaml(write_yaml(value)).value == value


@given(st.text())
@STEADY
def test_any_text_gives_a_value_or_an_input_error(text: str) -> None:
    with contextlib.suppress(InputError):
        parse_yaml(text)
