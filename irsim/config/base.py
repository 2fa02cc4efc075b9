"""Parts and families: how YAML becomes frozen values, and how a kind is added.

A *part* is a frozen pydantic model whose fields are its YAML keys. A *family* is a table of kinds
that may stand in one place, told apart by their key ``kind``. A new kind is a class and a line in
its family's table; a user's own kind is named as ``module:Class``, which imports that module.
"""

from __future__ import annotations

import difflib
import importlib
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from typing import Annotated, Any, ClassVar, TypeVar

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

from irsim.config.field_docs import meanings

KeyPath = tuple[str | int, ...]
Switches = Mapping[str, tuple[Any, ...]]
"""Name of what can be switched off within a part -> its key, the value that does so, others that do nothing either."""


class Part(BaseModel):
    """A frozen value whose fields are its YAML keys; unknown keys and wrong types are errors."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Keys beside which others do not count: `irsim check` warns where such are written."""
    switches: ClassVar[Switches] = {}
    """What within it can be switched off with --without, by names of their own; those of its bases count, too."""

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """A mapping, sound or not, and the keys that follow from others where it lacks them: for a class to say."""
        return given

    @classmethod
    def default_for(cls, key: str, given: Mapping[str, Any]) -> Any:
        """What a key holds in a mapping like `given` that leaves it out."""
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
        """As pydantic has it, and what each key means."""
        described = handler(schema)
        properties = handler.resolve_ref_schema(described).get("properties", {})
        for key, text in meanings(cls).items():
            if key in properties:
                properties[key] = {"description": text, **properties[key]}
        return described


@lru_cache(maxsize=1024)
def _validator(part: type[Part], key: str) -> TypeAdapter[Any]:
    """Of one key alone; kept, as making it takes a hundred times as long as its use."""
    field = part.model_fields[key]
    hint: Any = Annotated[field.annotation, field]
    return TypeAdapter(hint)


Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_-]*$", max_length=64)]
"""An id: what --without, overrides and truth call a part of the scene."""

Switch = Annotated[str, Field(min_length=1, max_length=128)]
"""What --without switches off: a part by its id, or what is set within one (`jet.flicker`). Of any form, so that what
is none is told the names that are."""

Item = TypeVar("Item")
Several = Annotated[tuple[Item, ...], Field(strict=False)]
"""A YAML list, kept as a tuple."""


class Kind(Part):
    """A part that is one of several in its family."""

    kind: ClassVar[str]
    """What YAML calls it: the name in its family's table, else 'module:Class'."""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        cls.kind = f"{cls.__module__}:{cls.__qualname__}"


class NamedKind(Kind):
    """A kind that stands in a list, where overrides and --without reach it by its name."""

    id: Name | None = None
    """Its name in the scene; its kind where not given."""

    @property
    def name(self) -> str:
        return self.id or self.kind


_may_import: ContextVar[bool] = ContextVar("may_import", default=True)


@contextmanager
def importing_nothing() -> Iterator[None]:
    """In this block a kind 'module:Class' is known only where its module is imported already.

    For texts out of recordings and results files: whoever made the file would choose the code to run.
    """
    before = _may_import.set(False)
    try:
        yield
    finally:
        _may_import.reset(before)


def is_handwritten() -> bool:
    """Return whether the text being read is a user's own, and not one out of a recording or a results file."""
    return _may_import.get()


NO_OTHERS: Mapping[str, str] = {}
"""No words that people use for what has another name."""


def suggestion(word: object, allowed: Iterable[str], meant: Mapping[str, str] = NO_OTHERS) -> str:
    """'; did you mean …?' where a known word is near, else ''.

    meant   other words, in small letters, each with the known one that it is another name of
    """
    written, lowered = str(word).lower(), {each.lower(): each for each in allowed}
    # A slip in a known word goes before one in another name for it: 'sar' is nearer to 'car' than to 'sam'.
    found = meant.get(written) or _nearest(written, lowered, 0.6) or _nearest(written, meant, 0.8)
    return f"; did you mean '{found}'?" if found else ""


def _nearest(word: str, known: Mapping[str, str], least: float) -> str | None:
    """What the word stands for that is most alike, at least so much (1: the same letters in their order)."""
    near = difflib.get_close_matches(word, known, n=1, cutoff=least)
    return known[near[0]] if near else None


class Family:
    """The table of kinds that may stand in one place of a scenario.

    A field declares its family as ``Annotated[Noise, NOISES]``. Errors inside a kind keep their
    places: the custom error 'inside' carries the kind's class and its own list of errors.
    """

    def __init__(
        self, name: str, base: type[Kind], kinds: Mapping[str, type[Kind]], meant: Mapping[str, str] = NO_OTHERS
    ) -> None:
        """`meant` as of `suggestion`."""
        self.name = name
        self.base = base
        self.meant = meant
        self.kinds = dict(kinds)
        for word, kind in self.kinds.items():
            kind.kind = word

    def __iter__(self) -> Iterator[tuple[str, type[Kind]]]:
        return iter(self.kinds.items())

    def find(self, word: object) -> type[Kind]:
        """The class of a kind's name or of 'module:Class'; PydanticCustomError where there is none."""
        if isinstance(word, str) and word in self.kinds:
            return self.kinds[word]
        if isinstance(word, str) and ":" in word:
            return self._foreign(word)
        raise self._unknown(
            f"unknown {self.name} kind {word!r}; allowed: {', '.join(self.kinds)} or module:Class"
            + suggestion(word, self.kinds, self.meant)
        )

    def _foreign(self, word: str) -> type[Kind]:
        module, _, name = word.partition(":")
        if module not in sys.modules and not _may_import.get():
            raise self._unknown(
                f"{word!r} is somebody's own {self.name} kind, and what this file names is not imported; "
                f"allowed: {', '.join(self.kinds)}, or import {module} first, if you trust it"
            )
        try:
            found = getattr(importlib.import_module(module), name)
        except Exception as error:  # a user's module may fail in any way while it is imported
            raise self._unknown(
                f"cannot import {word!r}: {error}; allowed: {', '.join(self.kinds)}, or module:Class of a module that "
                "is installed or lies where the command is given"
            ) from None
        if not (isinstance(found, type) and issubclass(found, self.base)):
            base = f"{self.base.__module__}.{self.base.__name__}"
            raise self._unknown(f"{word!r} is no {self.name} kind; allowed: a subclass of {base}")
        return found

    @staticmethod
    def _unknown(what: str) -> PydanticCustomError:
        return PydanticCustomError("unknown_kind", "{what}", {"what": what, "at": ("kind",)})

    def parse(self, value: Any) -> Kind:
        """A value of the family from a mapping with the key 'kind' (a value passes as it is)."""
        if isinstance(value, self.base):
            return value
        allowed = ", ".join(self.kinds)
        if not isinstance(value, Mapping):
            raise PydanticCustomError(
                "not_a_kind", "expected a mapping with the key 'kind'; allowed kinds: {allowed}", {"allowed": allowed}
            )
        if "kind" not in value:
            raise PydanticCustomError("no_kind", "the key 'kind' is missing; allowed: {allowed}", {"allowed": allowed})
        chosen = self.find(value["kind"])
        try:
            return chosen.model_validate({key: item for key, item in value.items() if key != "kind"})
        except ValidationError as error:
            # Raised as it is, pydantic would flatten it to one text: hand its list through.
            raise PydanticCustomError(
                "inside", "{count} errors", {"count": error.error_count(), "errors": error.errors(), "part": chosen}
            ) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self.parse, serialization=core_schema.plain_serializer_function_ser_schema(dump)
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The word `kind` chooses which keys are checked: an editor then marks the one that is wrong."""
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


def dump(part: Kind) -> dict[str, Any]:
    """A kind as a mapping, its own name first."""
    return {"kind": part.kind, **part.model_dump()}
