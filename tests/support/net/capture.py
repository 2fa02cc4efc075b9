"""Capture what a user of irsim and irtrack can observe, by public names and commands, as digests by value.

    cd TREE && PYTHONPATH=$PWD python PATH/tests/support/net/capture.py -o OUT.json [--only 'scene/*'] [--times]
    python tests/support/net/compare.py OLD.json OUT.json      silent but for two lines of counts: nothing changed

The tree is the current folder, first on PYTHONPATH, its kernels compiled. The script may lie in another tree.
`--only` takes a pattern of tasks (scene/examples/sky, variant/agc_clahe, help/irsim/fit, lint/*, check/*, ...).
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import time
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import net_commands
import net_scenes
from net_values import ENVIRONMENT, SCRATCH, Words, captured

import irsim


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--only", default="*", help="only tasks of this pattern")
    parser.add_argument("--times", action="store_true", help="print the seconds of each task")
    given = parser.parse_args()
    if Path(irsim.__file__).parent.parent != Path.cwd():
        sys.exit(f"{irsim.__file__} is not of this folder; allowed: PYTHONPATH=$PWD")
    folders = ("examples", "sources", "stress")
    scenarios = sorted(path for each in folders for path in Path("scenarios", each).glob("*.yaml"))
    new = sorted(Path("scenarios/new").glob("*.yaml"))
    values: dict[str, Any] = {}
    words: dict[str, str] = {}
    every = [*net_scenes.tasks(scenarios), *net_commands.tasks([*scenarios, *new])]
    os.environ.update(ENVIRONMENT)
    SCRATCH.mkdir()
    begun = time.monotonic()
    for name, task in every:
        if not fnmatchcase(name, given.only):
            continue
        start = time.monotonic()
        for key, value in captured(name, task):
            (words if isinstance(value, Words) else values)[key] = value
        if given.times:
            print(f"{time.monotonic() - start:6.2f} s  {name}", flush=True)
    given.output.write_text(json.dumps({"values": values, "words": words}, indent=0))
    shutil.rmtree(SCRATCH)
    errors = [key for key, value in values.items() if str(value).startswith("error: ")]
    print(f"{len(values)} values, {len(words)} texts, {len(errors)} errors, {time.monotonic() - begun:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
