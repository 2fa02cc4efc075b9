"""Commands that repeat the runs of a report; sources reopened from a results file."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from irsim import Rendering, loads, open_recording
from irsim.types import Box, Source
from irtrack.bench import Key, Run, RunRecord, SourceRow
from irtrack.registry.identity import changed_parameters


def repeat_commands(path: Path, runs: Sequence[Run]) -> tuple[str, ...]:
    """Return the commands that made a results file and the command that reports it; `path`: path of the file."""
    made = (run.command or f"# run {run.id}: called from Python" for run in runs)
    return *made, shlex.join(["irtrack", "report", str(path)])


def render_command(source: SourceRow, seed: int | None) -> str | None:
    """Return the command that renders the scene to a recording; None for a recording."""
    if source.kind == "recording":
        return None
    name = f"{source.name}-{seed}.mcap"
    return shlex.join(["irsim", "render", source.word, *source.changes, "--seed", str(seed), "-o", name])


def run_command(cell: RunRecord, source: SourceRow) -> str:
    """Return the command that repeats one run and prints its scores."""
    key, config = cell.key, cell.config
    words = ["irtrack", "run", config["tracker"], source.word, *source.changes, *_seeds(key)]
    if key.target is not None:
        words += ["--target", key.target]
    if key.start.startswith("auto"):
        words += ["--start", key.start]
    elif key.start not in ("visible", "none"):
        words += ["--init", _init(key.start)]
    if key.input != "display":
        words += ["--input", key.input]
    return shlex.join([*words, *_settings(config)])


def _seeds(key: Key) -> list[str]:
    if key.scene_seed in (None, key.tracker_seed):
        return ["--seed", str(key.tracker_seed)]
    return ["--seed", str(key.scene_seed), "--tracker-seed", str(key.tracker_seed)]


def _init(start: str) -> str:
    """Convert 'cx,cy,w,h@frame' of a run key to the value of the option --init."""
    numbers, _, frame = start.partition("@")
    box = Box(*map(float, numbers.split(",")))
    return ",".join(f"{value:.10g}" for value in box.pixels) + f"@{frame}"


def _settings(config: dict[str, Any]) -> Sequence[str]:
    """Return KEY=VALUE of the parameters that differ from the tracker's defaults."""
    changed = changed_parameters(config)
    return [f"{key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in changed.items()]


def reopen(row: SourceRow) -> Source:
    """Open a source of a results file; its content may have changed. Errors of irsim where it is missing.

    No code named by a scenario is run, since a results file may be untrusted.
    """
    source: Source
    if row.kind == "recording":
        source = open_recording(row.text)
    else:
        source = Rendering(loads(row.text, row.name, trusted=False), row.name)
    return source
