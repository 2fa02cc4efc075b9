"""YAML text to plain values, each with its position in the text, and back. The only file that imports yaml.

Scalars follow the core schema of YAML 1.2 (https://yaml.org/spec/1.2.2/#103-core-schema), which PyYAML
alone does not: `on`, `off`, `yes` and `no` are text, `1e3` is a float, `010` is ten and `0o10` eight.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from irsim.config.base import KeyPath
from irsim.config.paths import text_bytes
from irsim.errors import InputError

MOST_VALUES = 100_000
"""Largest number of values in one document, aliases expanded: a guard against alias bombs."""

LONGEST = sys.int_info.default_max_str_digits
"""Largest number of digits of an integer: Python's own limit."""

_TAGS = "no tag, or !!str, !!int, !!float, !!bool, !!null where the text is such a value"
_ALLOWED = {
    "flow sequence": "a list that ends in ]",
    "flow mapping": "a mapping that ends in }",
    "quoted scalar: found unexpected end": "a text that ends in the quote that it begins with",
    "unknown escape": "\\\\ for a \\, or single quotes",
    "<stream end>": "each [ and { closed",
    "undefined alias": "*NAME of a value marked &NAME before it",
    "duplicate anchor": "each &NAME once",
    "mapping values": "one KEY: VALUE a line; a text that holds ': ' in quotes",
    "cannot start": "a text that begins so in quotes",
    "<block end>": "entries of one list or mapping that begin in the same column",
}
"""Part of PyYAML's message -> allowed alternative."""
_TOO_DEEP = "nested too deeply; allowed: a hundred levels"
_TAG = "tag:yaml.org,2002:"
_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_SPECIAL = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_NULL = re.compile(r"null|Null|NULL|~|")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")


@dataclass(frozen=True)
class Document:
    """Value of a YAML text, and the positions ('file:line:column', from 1) of its values and keys."""

    name: str
    value: Any
    values: Mapping[KeyPath, str]
    keys: Mapping[KeyPath, str]


def read_yaml(path: str | Path) -> Document:
    """Return the document in a file. InputError where it cannot be read."""
    try:
        raw = text_bytes(path)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot read it: {_reason(error)}") from None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}:{_place_in(raw, error.start)}: this is not UTF-8 text; allowed: UTF-8") from None
    return parse_yaml(text, str(path))


def parse_yaml(text: str, name: str = "<text>") -> Document:
    """Return the one document in a text; InputError with a line for each fault."""
    try:
        root = _Loader(text).get_single_node()
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        column = error.position - text.rfind("\n", 0, error.position)
        code = error.character if isinstance(error.character, int) else ord(error.character)
        raise InputError(
            f"{name}:{line}:{column}: the character U+{code:04X} stands here; allowed: printable text"
        ) from None
    except yaml.MarkedYAMLError as error:
        raise InputError(f"{name}:{_problem(error)}") from None
    except yaml.YAMLError as error:
        raise InputError(f"{name}: not YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise InputError(f"{name}: {_TOO_DEEP}") from None
    except (ValueError, OverflowError) as error:
        # int() and chr() fail in PyYAML on invalid escapes and directives.
        raise InputError(f"{name}: not YAML: {error}") from None
    if root is None:
        raise InputError(f"{name}:1:1: it is empty; allowed: keys and values, as `frames: 100`")
    build = _Builder(name)
    try:
        value = build.value(root, ())
    except RecursionError:
        raise InputError(f"{name}: {_TOO_DEEP}") from None
    if build.errors:
        raise InputError("\n".join(build.errors))
    return Document(name, value, build.values, build.keys)


def scalar(text: str) -> Any:
    """Return the value of a short YAML text: `80` a number, `on` text, `[64, 48]` a list, '' None."""
    if not text.strip():
        return None
    return parse_yaml(text, repr(text)).value


def write_yaml(value: Any) -> str:
    """Return the YAML text of mappings, lists and scalars; `parse_yaml` gives the equal value."""
    return yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None, width=100)


def dotted(path: KeyPath) -> str:
    """Return a key path as text on one line: 'camera.size.0'."""
    return ".".join(map(on_a_line, path))


def on_a_line(value: object) -> str:
    """Return a value's text, escaped as in Python where it would break the line."""
    text = str(value)
    return text if text.isprintable() else repr(value)


class _Core(yaml.resolver.BaseResolver):
    """Types of plain scalars by YAML 1.2."""


for _tag, _regexp in (("null", _NULL), ("bool", _BOOL), ("int", _INT), ("float", _FLOAT), ("float", _SPECIAL)):
    _Core.add_implicit_resolver(_TAG + _tag, re.compile(rf"(?:{_regexp.pattern})\Z"), None)


class _Loader(yaml.reader.Reader, yaml.scanner.Scanner, yaml.parser.Parser, yaml.composer.Composer, _Core):
    def __init__(self, text: str) -> None:
        yaml.reader.Reader.__init__(self, text)
        yaml.scanner.Scanner.__init__(self)
        yaml.parser.Parser.__init__(self)
        yaml.composer.Composer.__init__(self)
        _Core.__init__(self)


class _Dumper(yaml.emitter.Emitter, yaml.serializer.Serializer, yaml.representer.SafeRepresenter, _Core):
    def __init__(self, stream: Any, default_style: Any = None, default_flow_style: Any = False, **options: Any) -> None:
        sort_keys = options.pop("sort_keys")
        emitter = {key: options.pop(key) for key in ("canonical", "indent", "width", "allow_unicode", "line_break")}
        yaml.emitter.Emitter.__init__(self, stream, **emitter)
        yaml.serializer.Serializer.__init__(self, **options)
        yaml.representer.SafeRepresenter.__init__(
            self, default_style=default_style, default_flow_style=default_flow_style, sort_keys=sort_keys
        )
        _Core.__init__(self)

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _represent_text(dumper: _Dumper, text: str) -> ScalarNode:
    # In other styles PyYAML folds some line breaks (U+0085) away.
    return dumper.represent_scalar(_TAG + "str", text, style=None if text.isprintable() else '"')


_Dumper.add_representer(str, _represent_text)


class _Builder:
    """Values of a tree of nodes, their positions and all faults."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.errors: list[str] = []
        self.values: dict[KeyPath, str] = {}
        self.keys: dict[KeyPath, str] = {}
        self._open: set[Node] = set()

    def value(self, node: Node, path: KeyPath) -> Any:
        self.values[path] = self._place(node)
        if len(self.values) > MOST_VALUES:
            raise InputError(f"{self.name}: it has too many values; allowed: {MOST_VALUES}, aliases written out")
        if isinstance(node, ScalarNode):
            return self._scalar(node)
        if node in self._open:
            self._wrong(node, "an alias that holds itself; allowed: aliases of values that end before them")
            return None
        self._open.add(node)
        try:
            if isinstance(node, SequenceNode):
                self._expect(node, "seq")
                return [self.value(item, (*path, index)) for index, item in enumerate(node.value)]
            assert isinstance(node, MappingNode)
            self._expect(node, "map")
            return self._mapping(node, path)
        finally:
            self._open.discard(node)

    def _mapping(self, node: MappingNode, path: KeyPath) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for key_node, item in node.value:
            key = self._scalar(key_node) if isinstance(key_node, ScalarNode) else None
            if not isinstance(key, str):
                self._wrong(key_node, "a key that is not text; allowed: text (in quotes where it looks like a number)")
                continue
            here = (*path, key)
            if key in result:
                self._wrong(key_node, f"{dotted(here)}: duplicate key, first at {self.keys[here]}")
                continue
            self.keys[here] = self._place(key_node)
            result[key] = self.value(item, here)
        return result

    def _scalar(self, node: ScalarNode) -> Any:
        text = node.value
        try:
            match node.tag.removeprefix(_TAG):
                case "str" | "!":
                    return text
                case "null" if _NULL.fullmatch(text):
                    return None
                case "bool" if _BOOL.fullmatch(text):
                    return text.lower() == "true"
                case "int" if _INT.fullmatch(text):
                    number = int(text, 0) if text[:2] in ("0o", "0x") else int(text)
                    str(number)  # fails for long hexadecimal numbers, which int() accepts
                    return number
                case "float" if _FLOAT.fullmatch(text):
                    return float(text)
                case "float" if _SPECIAL.fullmatch(text):
                    return float(text.replace(".", "", 1))
        except ValueError:  # int() and str() refuse thousands of digits
            self._wrong(node, f"the number {text[:20]}... is too long; allowed: {LONGEST} digits")
            return None
        self._wrong(node, f"{text!r} cannot have the tag {_short(node.tag)}; allowed: {_TAGS}")
        return None

    def _expect(self, node: Node, tag: str) -> None:
        if node.tag not in (_TAG + tag, "!"):
            self._wrong(node, f"the tag {_short(node.tag)} stands here; allowed: !!{tag}, or no tag")

    def _place(self, node: Node) -> str:
        return f"{self.name}:{node.start_mark.line + 1}:{node.start_mark.column + 1}"

    def _wrong(self, node: Node, message: str) -> None:
        self.errors.append(f"{self._place(node)}: {message}")


def _place_in(raw: bytes, offset: int) -> str:
    """Return 'line:column' of a byte, from 1."""
    line, column = raw.count(b"\n", 0, offset) + 1, offset - raw.rfind(b"\n", 0, offset)
    return f"{line}:{column}"


def _short(tag: str) -> str:
    return "!!" + tag.removeprefix(_TAG) if tag.startswith(_TAG) else tag


def _reason(error: OSError | ValueError) -> str:
    if isinstance(error, FileNotFoundError):
        return "there is no such file"
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def _problem(error: yaml.MarkedYAMLError) -> str:
    """Return 'line:column: not YAML: problem' on one line."""
    mark = error.problem_mark or error.context_mark
    place = f"{mark.line + 1}:{mark.column + 1}: " if mark else " "
    if "'\\t'" in (error.problem or ""):
        return f"{place}a tab stands here; allowed: spaces"
    if "single document" in (error.context or ""):
        return f"{place}a second document begins; allowed: one document a file"
    text = ": ".join(part for part in (error.context, error.problem) if part)
    allowed = next((f"; allowed: {words}" for part, words in _ALLOWED.items() if part in text), "")
    return f"{place}not YAML: {' '.join(text.split())}{allowed}"
