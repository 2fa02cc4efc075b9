"""What the scenario in a source says, where nothing is to be made of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from irsim.config import yaml_text
from irsim.types import Source


def stated(source: Source) -> Mapping[str, Any]:
    """What a source's scenario holds at its top keys; nothing where there is none, or it is no mapping.

    Nothing of it is checked: a recording may come from anywhere. InputError where its text is no YAML.
    """
    text = source.scenario_text
    value = None if text is None else yaml_text.parse_yaml(text, source.name).value
    return value if isinstance(value, dict) else {}
