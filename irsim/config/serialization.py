"""Parts and Python values as plain YAML values: mappings, lists and scalars."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np

from irsim.config.base import Kind, Part
from irsim.config.yaml_text import LONGEST
from irsim.errors import InputError

DEEPEST = 100
"""Largest number of levels of nested lists and mappings: a guard against a list that contains itself."""

_LARGEST_WHOLE = 2**53
"""Largest integer up to which floats are exact."""

_ALLOWED = "text, a number, True, False, None, or a list, tuple or mapping (its keys text) of these"


def plain_value(value: Any, brief: bool = False) -> Any:
    """Return the plain YAML value of a part, with every key, or without the keys that have their default (`brief`)."""
    if isinstance(value, Part):
        names = _needed_keys(value) if brief else list(type(value).model_fields)
        fields = {name: plain_value(getattr(value, name), brief) for name in names}
        return {"kind": value.kind, **fields} if isinstance(value, Kind) else fields
    if isinstance(value, tuple | list):
        return [plain_value(item, brief) for item in value]
    if isinstance(value, Mapping):
        return {key: plain_value(item, brief) for key, item in value.items()}
    return value


def brief_value(value: Any) -> Any:
    """Return the plain YAML value of a part, without the keys that have their default."""
    return plain_value(value, brief=True)


def _needed_keys(part: Part) -> list[str]:
    """Return the keys whose value differs from the default. A default may depend on other keys of this list."""
    fields = type(part).model_fields
    needed = {name: plain_value(getattr(part, name)) for name in fields}
    for name, field in fields.items():
        if not field.is_required() and needed[name] == plain_value(part.default_for(name, needed)):
            del needed[name]
    return list(needed)


def as_yaml_value(value: Any, name: str) -> Any:
    """Return the plain value of a Python value: parts as mappings, numpy's numbers as Python's, `1e3` as an integer.

    Raises InputError, 'name: problem; allowed: ...', for anything that YAML cannot write.
    """
    return whole_numbers(_converted(value, name, 0))


def whole_numbers(value: Any) -> Any:
    """Return the plain value with whole floats as integers, `1e3` as 1000. Keys for floats accept integers too; keys
    for integers accept no float."""
    if isinstance(value, dict):
        return {key: whole_numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [whole_numbers(item) for item in value]
    if isinstance(value, float) and value.is_integer() and abs(value) < _LARGEST_WHOLE:
        return value if value == 0 and math.copysign(1, value) < 0 else int(value)
    return value


def _converted(value: Any, name: str, depth: int) -> Any:
    if depth > DEEPEST:
        raise InputError(f"{name}: nested too deeply, or in itself; allowed: {DEEPEST} levels")
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0):
        value = value.item()
    if isinstance(value, Part):
        return plain_value(value)
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, Integral):
        if abs(int(value)) >= 10**LONGEST:
            raise InputError(f"{name}: the number is too long; allowed: {LONGEST} digits")
        return int(value)
    if isinstance(value, Real):
        try:
            return float(value)
        except OverflowError:
            raise InputError(f"{name}: the number is too large; allowed: up to 1.8e308") from None
    if isinstance(value, list | tuple):
        return [_converted(item, name, depth + 1) for item in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _converted(item, name, depth + 1) for key, item in value.items()}
    kind = type(value)
    found = "keys that are not text" if isinstance(value, Mapping) else f"a {kind.__module__}.{kind.__name__}"
    raise InputError(f"{name}: {found} cannot be written as YAML; allowed: {_ALLOWED}")
