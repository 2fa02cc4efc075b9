"""The code hash of a tracker that has no file follows what was typed."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

import pytest

from irtrack.registry.identity import code_hash
from irtrack.registry.table import of

TYPED = """
STEP = 1

def helper(x):
    return [each + STEP for each in x if str(each) not in {"a", "b", "c", "d"}]

class Typed:
    gain = 1.0
    def start(self, frame, box):
        self.box = box
    def step(self, frame):
        return helper(self.box)
"""


def typed_hash(text: str, first_line: int = 0) -> str:
    """Of the class as a prompt or a notebook has it: there is no file, and the place of its text changes."""
    namespace: dict[str, Any] = {"__name__": "typed_here"}
    exec(compile("\n" * first_line + text, f"<typed {first_line}>", "exec"), namespace)
    return code_hash(of(namespace["Typed"]()))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("+ STEP", "- STEP"),
        ("STEP = 1", "STEP = 2"),
        ("gain = 1.0", "gain = 2.0"),
        ("self.box = box", "self.bow = box"),
        ('"d"}]', '"e"}]'),
    ],
    ids=["helper", "global", "attribute", "method", "constant"],
)
def test_the_hash_follows_what_is_typed(old: str, new: str) -> None:
    assert typed_hash(TYPED.replace(old, new)) != typed_hash(TYPED)


def test_a_program_read_from_a_pipe_is_as_if_typed() -> None:
    program = f"{TYPED}\nfrom irtrack.identity import code_hash\nprint(code_hash(Typed()))\n"
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-"], input=program, env=env, capture_output=True, text=True, check=True)
    assert len(done.stdout.strip()) == 32  # 16 bytes


def test_the_hash_of_what_is_typed_does_not_depend_on_where() -> None:
    assert typed_hash(TYPED, 7) == typed_hash(TYPED)
    program = "import test_tracker_identity; print(test_tracker_identity.typed_hash(test_tracker_identity.TYPED))"
    env = {**os.environ, "PYTHONHASHSEED": "7", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", program], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == typed_hash(TYPED)
