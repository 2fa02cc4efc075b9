"""Python environment of the peers, the trackers of other libraries, and the peers installed in it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import ModuleType

from irtrack.errors import InputError, exit_status_text
from irtrack.external import many_server, server

VARIABLE = "IRTRACK_PEERS"
_SERVERS: dict[ModuleType, tuple[str, ...]] = {server: server.PEERS, many_server: tuple(many_server.MANY_PEERS)}
ALL_PEERS = tuple(name for peers in _SERVERS.values() for name in peers)
"""Names of the single-target peers, followed by the multi-target ones."""
HINT = (
    f"{VARIABLE}=PYTHON names the Python of an environment with the libraries of {', '.join(ALL_PEERS)}; in a checkout "
    "`make peers` installs them into .venv-peers"
)
_BIN = ("Scripts", "python.exe") if sys.platform == "win32" else ("bin", "python")
LONGEST_S = 60.0
"""Longest time to list the peers, s: their Python imports OpenCV and dlib, perhaps from a cold disk."""


def python() -> Path | None:
    """Return the Python of the peers: IRTRACK_PEERS, else that of .venv-peers here or beside irtrack; None without one.

    InputError where IRTRACK_PEERS names no file.
    """
    named = os.environ.get(VARIABLE)
    if named:
        if not Path(named).is_file():
            raise _refused(Path(named), "there is no such file")
        return Path(named)
    places = [Path(folder, ".venv-peers", *_BIN) for folder in (Path.cwd(), Path(__file__).parents[2])]
    return next((place for place in places if place.is_file()), None)


def command(name: str, interpreter: Path) -> tuple[str, ...]:
    """Return the command that runs a peer."""
    chosen = next(each for each, peers in _SERVERS.items() if name in peers)
    return (*_listing(chosen, interpreter), name)


def _listing(chosen: ModuleType, interpreter: Path) -> tuple[str, ...]:
    """Return the command that lists the peers of a server."""
    return (str(interpreter), str(Path(str(chosen.__file__)).resolve()))


def offered(*names: str) -> list[str]:
    """Return the names of the installed peers, of `names` alone where given; empty without an environment of peers.

    InputError where the Python of the environment cannot list them.
    """
    interpreter = python()
    if interpreter is None:
        return []
    wanted = set(names or ALL_PEERS)
    found = [name for each, peers in _SERVERS.items() if wanted & set(peers) for name in _answered(interpreter, each)]
    return [name for name in found if name in wanted]


def required(name: str) -> Path:
    """Return the Python that runs a peer; InputError where no environment has this peer."""
    interpreter = python()
    if interpreter is None:
        raise InputError(f"{name}: runs in an environment that is not there; allowed: after {HINT}")
    return interpreter


@cache
def _answered(interpreter: Path, chosen: ModuleType) -> tuple[str, ...]:
    """Run a server by a Python to list its peers, and return their names."""
    try:
        listing = _listing(chosen, interpreter)
        done = subprocess.run(listing, capture_output=True, timeout=LONGEST_S, check=True)
        return tuple(name for name in json.loads(done.stdout) if name in _SERVERS[chosen])
    except OSError as error:
        raise _refused(interpreter, f"it cannot be started: {error.strerror or error}") from None
    except subprocess.TimeoutExpired:
        raise _refused(interpreter, f"it gave no answer in {LONGEST_S:g} s") from None
    except subprocess.CalledProcessError as error:
        words = error.stderr.decode(errors="replace").split("\n")
        last = next((line.strip() for line in reversed(words) if line.strip()), "")
        ended = f"it ended ({exit_status_text(error.returncode)})"
        raise _refused(interpreter, ended + (last and f"; it last wrote: {last}")) from None
    except (ValueError, TypeError):
        raise _refused(interpreter, "it does not say which peers it has") from None


def _refused(interpreter: Path, why: str) -> InputError:
    where = f"{VARIABLE}={interpreter}" if os.environ.get(VARIABLE) else str(interpreter)
    return InputError(f"{where}: {why}; allowed: the Python of an environment as make peers installs it")
