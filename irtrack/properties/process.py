"""A walk in another process: ``python -m irtrack.properties.process`` reads a tracker and a clip, and answers."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys

from irtrack.properties.case import Clip, Walk, walk
from irtrack.types import Tracker


def in_another_process(tracker: Tracker, clip: Clip) -> Walk | str:
    """The walk, hashes there having another seed than here; or why the tracker cannot get there."""
    try:
        sent = pickle.dumps((tracker, clip))
    except Exception as error:
        return f"it cannot be pickled: {' '.join(str(error).split())}"
    if type(tracker).__module__ == "__main__":
        return "its class stands in the main program, which other processes do not have"
    seed = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
    done = subprocess.run(
        [sys.executable, "-m", "irtrack.properties.process"],
        input=sent,
        capture_output=True,
        env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        check=False,
    )
    if done.returncode != 0:
        raise RuntimeError(f"in another process: {done.stderr.decode(errors='replace').strip().splitlines()[-1]}")
    answer: Walk = pickle.loads(done.stdout)
    return answer


def main() -> None:
    tracker, clip = pickle.load(sys.stdin.buffer)
    out, sys.stdout = sys.stdout, sys.stderr
    out.buffer.write(pickle.dumps(walk(tracker, clip)))


if __name__ == "__main__":
    main()
