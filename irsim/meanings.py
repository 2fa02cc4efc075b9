"""What the fields of a class mean: the text under each, read from the source when somebody asks.

Pydantic can keep these texts itself (`use_attribute_docstrings`), but reads them while a class is made:
a second in each process, for texts that only the JSON Schema and the documents show.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from functools import cache
from itertools import pairwise

from pydantic import BaseModel


@cache
def meanings(cls: type[BaseModel]) -> dict[str, str]:
    """name -> text of the fields of a class, its bases' too; without those whose source is not at hand."""
    found: dict[str, str] = {}
    for each in reversed(cls.__mro__[: cls.__mro__.index(BaseModel)]):
        found |= _own(each)
    return {name: text for name, text in found.items() if name in cls.model_fields}


def _own(cls: type) -> dict[str, str]:
    try:
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
    except (OSError, TypeError):
        return {}
    body = getattr(tree, "body", [])
    return {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in pairwise(body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }
