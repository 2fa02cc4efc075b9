"""The hash of a scenario depends on the code that renders it, and on no other code."""

from __future__ import annotations

import base64
import hashlib
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import irsim
from irsim.scenario.fingerprint import NOT_PIXELS

KIND = """
from irsim.motion.scripted import Straight

class Mine(Straight):
    pass
"""
SCENE = """
background: {kind: sky}
targets:
  - {id: a, shape: {kind: point, temperature_k: 400}, path: {kind: "KIND", start: [60, 20], range_m: 3000}}
"""


def test_the_hash_follows_the_code_of_own_kinds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    file = tmp_path / "hashed_kind.py"
    file.write_text(KIND)
    scene = irsim.loads(SCENE.replace("KIND", "hashed_kind:Mine"))
    plain = irsim.loads(SCENE.replace("KIND", "straight"))
    first, other = scene.hash, plain.hash
    assert first != other
    file.write_text(KIND + "# mended\n")
    assert scene.hash != first
    assert plain.hash == other
    file.write_text(KIND)
    assert scene.hash == first


MESSAGES = {"errors.py", "notebook.py"}
"""Files that rendering imports for messages."""

ALONE = """
import base64, hashlib, pickle, sys
from pathlib import Path
import irsim
from irsim.render.frame import Renderer
renderer = Renderer(pickle.loads(base64.b64decode(sys.stdin.read())))
for index in INDICES:
    frame, truth = renderer.frame(index)
    print(hashlib.sha256(frame.image.tobytes() + repr((frame.time, truth)).encode()).hexdigest())
root = Path(irsim.__file__).parent
files = (Path(module.__file__) for name, module in sys.modules.items() if name.startswith("irsim"))
print(*sorted(file.relative_to(root).as_posix() for file in files), sep="\\n", file=sys.stderr)
"""


def test_frames_do_not_depend_on_code_outside_the_hash() -> None:
    """Frames of a process that does not import that code, alone and backwards, are those of two workers in order."""
    scenario, count = irsim.load("correction"), 24
    indices = (count - 1, count // 2, 0)
    code = ALONE.replace("INDICES", repr(indices))
    text = base64.b64encode(pickle.dumps(scenario)).decode()
    done = subprocess.run([sys.executable, "-c", code], input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    left_out = {file for file in done.stderr.split() if any(Path(file).is_relative_to(each) for each in NOT_PIXELS)}
    assert left_out <= MESSAGES
    rendered = {frame.index: (frame, truth) for frame, truth in irsim.frames(scenario, stop=count, jobs=2)}
    digests = [
        hashlib.sha256(frame.image.tobytes() + repr((frame.time, truth)).encode()).hexdigest()
        for frame, truth in map(rendered.__getitem__, indices)
    ]
    assert done.stdout.split() == digests
