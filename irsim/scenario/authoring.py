"""What helps to write scenarios: a JSON Schema for editors, texts to begin from, samples of what varies."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from irsim.config.diagnostics import listed
from irsim.config.files import replacing_text
from irsim.errors import InputError
from irsim.scenario.catalog import shipped
from irsim.scenario.loader import dumps, reach
from irsim.scenario.model import Scenario
from irsim.scenario.space import sample

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """The JSON Schema of a scenario: keys, kinds, bounds and meanings. What only the whole tells is not in it."""
    return {"$schema": DIALECT, **Scenario.model_json_schema(), "title": "irsim scenario"}


def start_text(kind: str) -> str:
    """A commented scenario to begin one's own from. InputError where there is none of that kind."""
    known = shipped("new")
    if kind not in known:
        raise InputError(f"{kind}: there is no such kind of scenario{listed(sorted(known), kind)}")
    return known[kind].read_text(encoding="utf-8")


def write_new(path: Path, text: str) -> None:
    """The text in a file that was not there before; InputError where it was."""
    if os.path.lexists(path):
        raise InputError(f"{path}: is there already, and a new scenario replaces nothing; allowed: -o FILE")
    with replacing_text(path) as file:
        file.write(text)


def sample_names(name: str, n: int) -> list[str]:
    """The files of `n` samples: NAME-0.yaml and on, with as many digits as the last needs."""
    return [f"{name}-{index:0{len(str(n - 1))}}.yaml" for index in range(n)]


def sample_texts(
    scenario: Scenario,
    name: str,
    n: int,
    seed: int,
    repeat: str,
    folder: Path,
    progress: Callable[[int], None] | None = None,
) -> list[str]:
    """`n` draws of `sample` as YAML texts, each with what was drawn and how to repeat it. InputError as `sample`.

    name     of the scenario
    repeat   the command that was given
    folder   where they will lie: files that they are read from are named as they are found from there
    """
    texts = []
    for index in range(n):
        (drawn,) = sample(scenario, 1, seed, start=index)
        texts.append(_sample_text(drawn, name, index, n, repeat, scenario.vary, folder))
        if progress is not None:
            progress(index + 1)
    return texts


def _sample_text(drawn: Scenario, name: str, index: int, n: int, repeat: str, keys: Iterable[str], folder: Path) -> str:
    head = [f"Sample {index} of {n} drawn from {name}; all of them again: {repeat}"]
    head += [f"{key} = {json.dumps(value)}" for key, value in reach(drawn, keys).items()]
    return "".join(f"# {' '.join(line.split())}\n" for line in head) + dumps(drawn, True, folder)
