"""Files of a falsification: the journal, the smallest scene with its frames, and the reports beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import irsim
from irsim.recording.output import atomic_text, check_output

MINIMAL = "minimal"
"""File name, without ending, of the smallest scene and of its recording."""
JOURNAL = "trials.jsonl"
REPORT = "report.md"
REPLAY = "replay.html"
FOUND = (f"{MINIMAL}.yaml", f"{MINIMAL}.mcap", REPLAY, REPORT)
"""Names of the files of a failure."""


def clear(folder: Path) -> None:
    """Delete the files of an earlier failure; the journal stays. A folder without a journal is left alone."""
    if (folder / JOURNAL).is_file():
        for name in FOUND:
            (folder / name).unlink(missing_ok=True)


def check_outputs(folder: Path, scenario: Path | None) -> None:
    """Raise InputError where an output cannot be a file, or would replace the scenario's file."""
    for name in (JOURNAL, *FOUND):
        check_output(folder / name, scenario)


def file_stem(scenario: str, label: str) -> str:
    """Return the stem of file names for a tracker with this label on a scenario."""
    return f"{scenario}-{label}".replace(":", "-").replace("/", "-")


def write_minimal(folder: Path, scene: irsim.Scenario, head: Sequence[str]) -> None:
    """Write the smallest scene, with `head` as comment lines at its top, and its frames."""
    irsim.record(irsim.Rendering(scene, MINIMAL), folder / f"{MINIMAL}.mcap", compression="zstd")
    with atomic_text(folder / f"{MINIMAL}.yaml") as file:
        file.write("".join(f"# {line}\n" for line in head) + irsim.dumps(scene, short=True, folder=folder))
