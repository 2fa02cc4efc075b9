"""What the fields of a class mean: the text under each, read from the source when somebody asks.

Pydantic can keep these texts itself (`use_attribute_docstrings`), but reads them while a class is made:
a second in each process, for texts that only the JSON Schema and the documents show.
"""

from __future__ import annotations

import ast
import inspect
import sys
from functools import cache
from itertools import pairwise

from pydantic import BaseModel

STATEMENTS = (ast.stmt, ast.excepthandler, ast.match_case)
"""What classes stand in: no expression holds one."""


@cache
def meanings(cls: type[BaseModel]) -> dict[str, str]:
    """name -> text of the fields of a class, its bases' too; without those whose source is not at hand."""
    found: dict[str, str] = {}
    for each in reversed(cls.__mro__[: cls.__mro__.index(BaseModel)]):
        found |= _own(each)
    return {name: text for name, text in found.items() if name in cls.model_fields}


def _own(cls: type) -> dict[str, str]:
    module = sys.modules.get(cls.__module__)
    try:
        source = inspect.getsource(module) if module else ""
    except (OSError, TypeError):
        return {}
    return _of_classes(source).get(cls.__qualname__, {})


@cache
def _of_classes(source: str) -> dict[str, dict[str, str]]:
    """Of each class in a module's text, by its qualified name: inspect alone parses the text anew for each class."""
    found: dict[str, dict[str, str]] = {}

    def look(body: list[ast.AST], within: str) -> None:
        for node in body:
            inner = within
            if isinstance(node, ast.ClassDef):
                found.setdefault(within + node.name, _texts(node.body))
                inner = f"{within}{node.name}."
            elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                inner = f"{within}{node.name}.<locals>."
            look([each for each in ast.iter_child_nodes(node) if isinstance(each, STATEMENTS)], inner)

    look([ast.parse(source)], "")
    return found


def _texts(body: list[ast.stmt]) -> dict[str, str]:
    return {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in pairwise(body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }
