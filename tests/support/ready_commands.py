"""The commands irsim and irtrack for shells, each a copy of one process that has imported what they need.

For tests of what many commands say and write, one after the other: most of a short command's time is its imports.
A copy has a folder, streams, exit status and modules of its own, as a process started anew has.
"""

from __future__ import annotations

import gc
import importlib
import json
import multiprocessing
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

NAMES = ("irsim", "irtrack")
IMPORTED = (
    *("irsim.cli.app", "irsim.scenario.loader", "irsim.render.sources", "irsim.calibration.fit", "irtrack.cli"),
    *("irtrack.bench", "irtrack.trackers", "irtrack.report", "irtrack.properties", "irtrack.falsify"),
    *("scipy.ndimage", "scipy.optimize", "scipy.stats", "matplotlib.pyplot", "jinja2"),
)
"""The commands, and of what they import only on demand, what takes long."""

# Its streams, words and folder go to the process that waits at {place}, whose copy's exit status is its own.
ASKING = """#!{python} -IS
import json, os, socket, sys
asked = socket.socket(socket.AF_UNIX)
asked.connect({place!r})
socket.send_fds(asked, [json.dumps([{name!r}, os.getcwd(), sys.argv[1:]]).encode()], [0, 1, 2])
sys.exit(int(asked.recv(16)))
"""


@contextmanager
def ready_commands() -> Iterator[str]:
    """Within the block: a value for PATH with which a shell finds the commands."""
    with TemporaryDirectory() as folder:  # a short path, as sockets need
        place = str(Path(folder) / "asked")
        path = os.pathsep.join([folder, str(Path(sys.executable).parent), os.environ["PATH"]])
        for name in NAMES:
            command = Path(folder) / name
            command.write_text(ASKING.format(python=sys.executable, place=place, name=name))
            command.chmod(0o755)
        with socket.socket(socket.AF_UNIX) as waiting:
            waiting.bind(place)
            waiting.listen()
            served = subprocess.Popen(
                [sys.executable, __file__, str(waiting.fileno())],
                env={**os.environ, "PATH": path},
                pass_fds=[waiting.fileno()],
            )
        try:
            yield path
        finally:
            served.kill()
            served.wait()


def serve(waiting: socket.socket) -> None:
    """Answer one command after the other."""
    for module in IMPORTED:
        importlib.import_module(module)
    gc.freeze()  # what is common to all copies is not looked through, and so copied, by each
    copies = multiprocessing.get_context("fork")
    while True:
        asked, _ = waiting.accept()
        message, streams, _, _ = socket.recv_fds(asked, 65536, 3)
        copy = copies.Process(target=command, args=(*json.loads(message), streams))
        copy.start()
        for stream in streams:
            os.close(stream)
        copy.join()
        asked.sendall(str(copy.exitcode).encode())
        asked.close()


def command(name: str, folder: str, words: list[str], streams: list[int]) -> None:
    """What a copy does."""
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    # Anew: those of the process that was copied know of its own streams whether they are files.
    sys.stdin, sys.stdout, sys.stderr = open(0), open(1, "w"), open(2, "w", buffering=1)  # noqa: SIM115
    os.chdir(folder)
    sys.argv = [name, *words]
    sys.path[0] = str(Path(sys.executable).parent)  # where the command's file is
    importlib.import_module(f"{name}.__main__").main()


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])))
