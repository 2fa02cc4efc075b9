"""The environment that the peers run in."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from irtrack.peers import server

VARIABLE = "IRTRACK_PEERS"
HINT = f"make peers installs {', '.join(server.PEERS)} into .venv-peers ({VARIABLE} names another environment's Python)"
_BIN = ("Scripts", "python.exe") if sys.platform == "win32" else ("bin", "python")


def python() -> Path | None:
    """The peers' Python: what IRTRACK_PEERS names, else that of .venv-peers here or beside irtrack; None where none."""
    named = os.environ.get(VARIABLE)
    folders = [Path.cwd(), Path(__file__).parents[2]]
    places = [Path(named)] if named else [Path(folder, ".venv-peers", *_BIN) for folder in folders]
    return next((place for place in places if place.is_file()), None)


def command(name: str, interpreter: Path) -> tuple[str, ...]:
    """What runs a peer."""
    return (str(interpreter), str(Path(server.__file__).resolve()), name)


def offered() -> list[str]:
    """The peers that the environment has; none where there is no such environment."""
    interpreter = python()
    if interpreter is None:
        return []
    try:
        done = subprocess.run(command("", interpreter)[:2], capture_output=True, timeout=60, check=True)
        return [name for name in json.loads(done.stdout) if name in server.PEERS]
    except (OSError, subprocess.SubprocessError, ValueError):
        return []
