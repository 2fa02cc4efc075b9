"""Parts, kinds and families: frozen values from YAML, and the tables of their kinds.

A *part* is a frozen pydantic model whose fields are its YAML keys. A *family* is a table of kinds that may stand under
one key, distinguished by their key ``kind``. A new kind is a class and a line in its family's table; a user's own kind
is named as ``module:Class``, which imports that module.
"""

from __future__ import annotations

import difflib
import importlib
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from importlib.metadata import entry_points
from typing import Annotated, Any, ClassVar, LiteralString, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from irsim.config.fields import field_docs
from irsim.errors import exits_refused

KeyPath = tuple[str | int, ...]
"""Keys and list indices from the root to a value."""

Switches = Mapping[str, tuple[Any, ...]]
"""Settings that can be switched off, by name: key, value that switches the setting off, other values without effect."""


def invalid(message: str, at: KeyPath = (), kind: LiteralString = "invalid") -> PydanticCustomError:
    """Return the error that a validator raises; `at` is the key path from the validated value to the fault."""
    return PydanticCustomError(kind, "{message}", {"message": message, **({"at": at} if at else {})})


class Part(BaseModel):
    """Frozen value whose fields are its YAML keys; unknown keys and wrong types are errors."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Key -> keys that have no effect beside it; the linter warns where they are written."""
    switches: ClassVar[Switches] = {}
    """Settings that the option --without can switch off, by name; those of base classes are included."""

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the mapping `given`, valid or not, completed by keys that follow from others; for subclasses to
        override."""
        return given

    @classmethod
    def default_for(cls, key: str, given: Mapping[str, Any]) -> Any:
        """Return the value of a key that the mapping `given` leaves out."""
        filled = cls.filled({each: item for each, item in given.items() if each != key})
        if key not in filled:
            return cls.model_fields[key].get_default(call_default_factory=True)
        return _validator(cls, key).validate_python(filled[key])

    @model_validator(mode="before")
    @classmethod
    def _fill(cls, given: Any) -> Any:
        return cls.filled(given) if isinstance(given, Mapping) else given

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return pydantic's JSON Schema with the docs of each key."""
        described = handler(schema)
        properties = handler.resolve_ref_schema(described).get("properties", {})
        for key, text in field_docs(cls).items():
            if key in properties:
                properties[key] = {"description": text, **properties[key]}
        return described


AnyPart = TypeVar("AnyPart", bound=Part)


@lru_cache(maxsize=1024)
def _validator(part: type[Part], key: str) -> TypeAdapter[Any]:
    """Return the validator of one key, cached: making it takes a hundred times as long as its use."""
    field = part.model_fields[key]
    hint: Any = Annotated[field.annotation, field]
    return TypeAdapter(hint)


Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_-]*$", max_length=64)]
"""Id of a part in --without, overrides and truth."""

Switch = Annotated[str, Field(min_length=1, max_length=128)]
"""Argument of --without: a part's id or a setting within one (`jet.flicker`). Any text is allowed here, so that the
error for an unknown name can list the names that exist."""

Item = TypeVar("Item")
Several = Annotated[tuple[Item, ...], Field(strict=False)]
"""A YAML list, kept as a tuple."""


class Kind(Part):
    """Part with the key `kind`, whose value is its class's name in the table of its family."""

    kind: ClassVar[str]
    """Name in YAML: the name in its family's table, or 'module:Class'."""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        cls.kind = f"{cls.__module__}:{cls.__qualname__}"


class NamedKind(Kind):
    """Kind in a list, where overrides and --without reach it by its name."""

    id: Name | None = None
    """Name in the scene; by default the kind."""

    @property
    def name(self) -> str:
        return self.id or self.kind


def dump(part: Kind) -> dict[str, Any]:
    """Return a kind as a mapping, its key `kind` first."""
    return {"kind": part.kind, **part.model_dump()}


_may_import: ContextVar[bool] = ContextVar("may_import", default=True)


@contextmanager
def importing_nothing() -> Iterator[None]:
    """Refuse a kind 'module:Class' within this block unless its module is imported already.

    It guards the reading of recordings and results files, whose author would otherwise choose the code to run.
    """
    before = _may_import.set(False)
    try:
        yield
    finally:
        _may_import.reset(before)


def is_handwritten() -> bool:
    """Return True if the text being read is the user's own; False within `importing_nothing`."""
    return _may_import.get()


class Family:
    """Table of kinds that may stand under one key of a scenario.

    A field declares its family as ``Annotated[Noise, NOISES]``. Errors inside a kind keep their key paths: the custom
    error 'inside' carries the kind's class and its list of errors.
    """

    def __init__(
        self, name: str, base: type[Kind], kinds: Mapping[str, type[Kind]], synonyms: Mapping[str, str] | None = None
    ) -> None:
        """`synonyms` as in `suggestion`."""
        self.name = name
        self.base = base
        self.synonyms = synonyms or {}
        self.kinds = dict(kinds)
        for word, kind in self.kinds.items():
            kind.kind = word

    def __iter__(self) -> Iterator[tuple[str, type[Kind]]]:
        return iter(self.kinds.items())

    def find(self, word: object) -> type[Kind]:
        """Return the class of the kind `word`, a name or 'module:Class'; PydanticCustomError where there is none."""
        if isinstance(word, str) and word in self.kinds:
            return self.kinds[word]
        if isinstance(word, str) and ":" in word:
            return self._foreign(word)
        if isinstance(word, str) and (installed := self._installed(word)):
            return self._foreign(installed)
        raise invalid(
            f"unknown {self.name} kind {word!r}; allowed: {', '.join(self.kinds)} or module:Class"
            + suggestion(word, self.kinds, self.synonyms),
            at=("kind",),
        )

    def _installed(self, word: str) -> str | None:
        """Return the 'module:Class' of an installed package's entry point in the group `irsim.NAME`, such as
        `irsim.noise`; None without one."""
        return _entry_points(f"irsim.{self.name.replace(' ', '_')}", tuple(sys.path)).get(word)

    def _foreign(self, word: str) -> type[Kind]:
        module, _, name = word.partition(":")
        if module not in sys.modules and not _may_import.get():
            raise invalid(
                f"{word!r} is a user's own {self.name} kind, and modules named in this file are not imported; "
                f"allowed: {', '.join(self.kinds)}, or import {module} first, if you trust it",
                at=("kind",),
            )
        try:
            with exits_refused():
                found = getattr(importlib.import_module(module), name)
        except (Exception, SystemExit) as error:  # a user's module may raise anything while it is imported
            reason = f"it ends the program: {error}" if isinstance(error, SystemExit) else error
            raise invalid(
                f"cannot import {word!r}: {reason}; allowed: {', '.join(self.kinds)}, or module:Class of a module that "
                "is installed or lies in the working directory",
                at=("kind",),
            ) from None
        if not (isinstance(found, type) and issubclass(found, self.base)):
            base = f"{self.base.__module__}.{self.base.__name__}"
            raise invalid(f"{word!r} is no {self.name} kind; allowed: a subclass of {base}", at=("kind",))
        if abstract := sorted(getattr(found, "__abstractmethods__", ())):
            raise invalid(f"{word!r} is abstract; allowed: a class that defines {', '.join(abstract)}", at=("kind",))
        return found

    def parse(self, value: Any) -> Kind:
        """Return a value of the family from a mapping with the key 'kind' (a value passes unchanged)."""
        if isinstance(value, self.base):
            return value
        allowed = ", ".join(self.kinds)
        if not isinstance(value, Mapping):
            raise invalid(f"expected a mapping with the key 'kind'; allowed kinds: {allowed}")
        if "kind" not in value:
            raise invalid(f"the key 'kind' is missing; allowed: {allowed}")
        chosen = self.find(value["kind"])
        try:
            return chosen.model_validate({key: item for key, item in value.items() if key != "kind"})
        except ValidationError as error:
            # pydantic would flatten the error itself to one text: pass its list on.
            raise PydanticCustomError(
                "inside", "{count} errors", {"count": error.error_count(), "errors": error.errors(), "part": chosen}
            ) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self.parse, serialization=core_schema.plain_serializer_function_ser_schema(dump)
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return a schema in which `kind` selects the keys to check: an editor then marks the wrong key."""
        chosen = []
        for word, kind in self.kinds.items():
            described = kind.__get_pydantic_json_schema__(kind.__pydantic_core_schema__, handler)
            keys = dict(handler.resolve_ref_schema(described))
            keys["properties"] = {"kind": {"const": word}, **keys.get("properties", {})}
            chosen.append({"if": {"properties": {"kind": {"const": word}}, "required": ["kind"]}, "then": keys})
        words = {word: " ".join((kind.__doc__ or "").split("\n\n")[0].split()) for word, kind in self.kinds.items()}
        return {
            "type": "object",
            "required": ["kind"],
            "properties": {
                "kind": {
                    "anyOf": [
                        *({"const": word, "description": text} for word, text in words.items()),
                        {"type": "string", "pattern": ".:.", "description": "module:Class, a kind of your own"},
                    ]
                }
            },
            "allOf": chosen,
        }


@lru_cache(maxsize=32)
def _entry_points(group: str, path: tuple[str, ...]) -> dict[str, str]:
    """Return the entry points of a group by name. Cached for a `sys.path`, since a look-up takes 20 ms."""
    return {each.name: each.value for each in entry_points(group=group)}


def suggestion(word: object, allowed: Iterable[str], synonyms: Mapping[str, str] | None = None) -> str:
    """Return "; did you mean 'car'?" where an allowed word is similar to `word`, else ''.

    synonyms   other words, in small letters -> the allowed word
    """
    written, known = str(word).lower(), {each.lower(): each for each in allowed}
    # Allowed words are tried before misspelt synonyms: 'sar' suggests 'car', not the meaning of the synonym 'sam'.
    synonyms = synonyms or {}
    found = synonyms.get(written) or known.get(_nearest(written, tuple(known), 0.6))
    found = found or synonyms.get(_nearest(written, tuple(synonyms), 0.8))
    return f"; did you mean '{found}'?" if found else ""


@lru_cache(maxsize=1024)
def _nearest(word: str, known: tuple[str, ...], least: float) -> str:
    """Return the word most similar to `word`, if the ratio of `difflib` is `least` or more; else ''."""
    return next(iter(difflib.get_close_matches(word, known, n=1, cutoff=least)), "")


def no_such(word: object, allowed: Iterable[str], none: str = "nothing") -> str:
    """Return "there is no 'jat'; allowed: jet, far; did you mean 'jet'?"; of more than 8 names similar ones come
    first."""
    known = list(dict.fromkeys(allowed))
    if len(known) > 8:
        ratios = {name: difflib.SequenceMatcher(None, str(word).lower(), name.lower()).ratio() for name in known}
        known.sort(key=lambda name: -ratios[name] if ratios[name] >= 0.6 else 0.0)
    within = next((f"; did you mean '{each}'?" for each in known if each.endswith(f".{word}")), None)
    return f"there is no '{word}'; allowed: {', '.join(known) or none}{within or suggestion(word, known)}"
