"""Values as YAML has them: what a Python program gives for a key, and numbers as all spellings mean them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np

from irsim.config.base import Part
from irsim.config.schema import plain
from irsim.config.yaml_file import LONGEST
from irsim.errors import InputError

DEEPEST = 100
"""Levels of lists and mappings in each other; more is taken for a list that holds itself."""

_LARGEST_WHOLE = 2**53
"""Up to here a float that is a whole number says exactly which."""

_ALLOWED = "text, a number, True, False, None, or a list, tuple or mapping (its keys text) of these"


def as_tree(value: Any, name: str) -> Any:
    """What YAML would have given for a value from a Python program: lists, dicts and scalars, `1e3` a whole number.

    Parts become mappings of their keys, and numpy's numbers are Python's. InputError, 'name: what; allowed: ...', for
    what YAML has no words for.
    """
    return whole_numbers(_tree(value, name, 0))


def whole_numbers(value: Any) -> Any:
    """The same tree with `1e3` as 1000: parts tell whole numbers from others, YAML's spelling must not."""
    if isinstance(value, dict):
        return {key: whole_numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [whole_numbers(item) for item in value]
    if isinstance(value, float) and value.is_integer() and abs(value) < _LARGEST_WHOLE:
        return value if value == 0 and math.copysign(1, value) < 0 else int(value)
    return value


def _tree(value: Any, name: str, depth: int) -> Any:
    if depth > DEEPEST:
        raise InputError(f"{name}: nested too deeply, or in itself; allowed: {DEEPEST} levels")
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0):
        value = value.item()
    if isinstance(value, Part):
        return plain(value)
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, Integral):
        return _written(int(value), name)
    if isinstance(value, Real):
        try:
            return float(value)
        except OverflowError:
            raise InputError(f"{name}: the number is too large; allowed: up to 1.8e308") from None
    if isinstance(value, list | tuple):
        return [_tree(item, name, depth + 1) for item in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _tree(item, name, depth + 1) for key, item in value.items()}
    kind = type(value)
    what = "keys that are not text" if isinstance(value, Mapping) else f"a {kind.__module__}.{kind.__name__}"
    raise InputError(f"{name}: {what} cannot be written as YAML; allowed: {_ALLOWED}")


def _written(number: int, name: str) -> int:
    """The number, where it can be written; InputError otherwise."""
    try:
        str(number)
    except ValueError:
        raise InputError(f"{name}: the number is too long; allowed: {LONGEST} digits") from None
    return number
