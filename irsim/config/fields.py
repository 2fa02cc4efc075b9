"""Fields of parts: annotations beyond their type, and their documentation, read from the source on demand."""

from __future__ import annotations

import ast
import inspect
import sys
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

from pydantic import BaseModel


@dataclass(frozen=True)
class Items:
    """Annotation of a fixed-length list of numbers: the names of its items in errors and in the reference."""

    names: str


@dataclass(frozen=True)
class Plausible:
    """Annotation of a number: values outside `low` to `high` are allowed, but the linter warns of them."""

    low: float
    high: float
    unit: str
    hint: str = ""

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g} {self.unit}" + (f" ({self.hint})" if self.hint else "")


class Located:
    """Annotation of a file's name: a relative name in a YAML file is relative to the folder of that file."""


_STATEMENTS = (ast.stmt, ast.excepthandler, ast.match_case)
"""Syntax nodes that can contain class definitions."""


@cache
def field_docs(cls: type[BaseModel]) -> dict[str, str]:
    """Return the docstring under each field of a class and its bases, by name; none without source text.

    Pydantic can keep these texts itself (`use_attribute_docstrings`), but reads them while a class is made: a second in
    each process, for texts that only the JSON Schema and the documents show.
    """
    found: dict[str, str] = {}
    for each in reversed(cls.__mro__[: cls.__mro__.index(BaseModel)]):
        found |= _docs_of_class(each)
    return {name: text for name, text in found.items() if name in cls.model_fields}


def _docs_of_class(cls: type) -> dict[str, str]:
    module = sys.modules.get(cls.__module__)
    try:
        source = inspect.getsource(module) if module else ""
    except (OSError, TypeError):
        return {}
    return _docs_of_source(source).get(cls.__qualname__, {})


@cache
def _docs_of_source(source: str) -> dict[str, dict[str, str]]:
    """Return field docs by qualified class name, cached for each module: inspect would parse it for each class."""
    found: dict[str, dict[str, str]] = {}

    def collect(body: list[ast.AST], prefix: str) -> None:
        for node in body:
            inner = prefix
            if isinstance(node, ast.ClassDef):
                found.setdefault(prefix + node.name, _docs_in(node.body))
                inner = f"{prefix}{node.name}."
            elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                inner = f"{prefix}{node.name}.<locals>."
            collect([each for each in ast.iter_child_nodes(node) if isinstance(each, _STATEMENTS)], inner)

    collect([ast.parse(source)], "")
    return found


def _docs_in(body: list[ast.stmt]) -> dict[str, str]:
    return {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in pairwise(body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }
