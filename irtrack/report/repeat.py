"""The commands that repeat what a report shows."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from irsim.types import Box
from irtrack.bench import Key, Run, RunRecord, SourceRow
from irtrack.registry.identity import changed_parameters


def repeat_commands(path: Path, runs: Sequence[Run]) -> tuple[str, ...]:
    """The commands that made a results file, and that which reports it; `path` as it was given."""
    made = (run.command or f"# run {run.id}: called from Python" for run in runs)
    return *made, shlex.join(["irtrack", "report", str(path)])


def render_command(source: SourceRow, seed: int | None) -> str | None:
    """The command that renders the scene to a recording; None for what is one already."""
    if source.kind == "recording":
        return None
    name = f"{source.name}-{seed}.mcap"
    return shlex.join(["irsim", "render", source.word, *source.changes, "--seed", str(seed), "-o", name])


def run_command(cell: RunRecord, source: SourceRow) -> str:
    """The command that repeats one cell and prints its scores."""
    key, config = cell.key, cell.config
    words = ["irtrack", "run", config["tracker"], source.word, *source.changes, *_seeds(key)]
    if key.target is not None:
        words += ["--target", key.target]
    if key.start != "visible":
        words += ["--init", _init(key.start)]
    if key.input != "display":
        words += ["--input", key.input]
    return shlex.join([*words, *_settings(config)])


def _seeds(key: Key) -> list[str]:
    if key.scene_seed in (None, key.tracker_seed):
        return ["--seed", str(key.tracker_seed)]
    return ["--seed", str(key.scene_seed), "--tracker-seed", str(key.tracker_seed)]


def _init(start: str) -> str:
    """'cx,cy,w,h@frame' of a key as --init takes it."""
    numbers, _, frame = start.partition("@")
    box = Box(*map(float, numbers.split(",")))
    return ",".join(f"{value:.10g}" for value in box.pixels) + f"@{frame}"


def _settings(config: dict[str, Any]) -> Sequence[str]:
    """KEY=VALUE of the parameters that are not the tracker's defaults."""
    changed = changed_parameters(config)
    return [f"{key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in changed.items()]
