"""What a recording's default name may replace."""

from __future__ import annotations

from pathlib import Path

from irsim.errors import InputError
from irsim.recording.read import open_recording


def check_default(path: Path) -> None:
    """InputError where something is there that was not rendered: nobody has named it, and footage or truth would be
    lost. What was rendered can be rendered again."""
    if not path.exists():
        return
    try:
        rendered = open_recording(path).scenario_text is not None
    except InputError:
        rendered = False
    if not rendered:
        raise InputError(
            f"{path}: is there already, was not rendered from a scenario, and would be replaced; allowed: -o with this "
            "name or another"
        )
