"""Name, configuration and code hash of a tracker, by which results are keyed."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import irtrack
from irtrack.errors import InputError
from irtrack.registry.identity import code_hash, tracker_config, tracker_name, weights_digest
from irtrack.registry.table import TRACKERS, make, of

TRACKER = "class T:\n    def start(self, image, box): self.box = box\n    def step(self, image): return self.box\n"

Write = Callable[[str, str], None]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Writes files of a user's folder."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "modules", dict(sys.modules))

    def file(name: str, text: str) -> None:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    return file


@pytest.mark.parametrize(
    ("imports", "changed"),
    [
        ("from code_helper import OFF", "code_helper.py"),
        ("import code_pack.below.deep", "code_pack/below/deep.py"),
        ("from code_pack import user", "code_pack/below/deep.py"),
        ("def later():\n    import code_helper", "code_helper.py"),
        ("try:\n    import code_native\nexcept ImportError:\n    pass", "code_native.so"),
        ("try:\n    import nowhere, code_broken.b\nexcept ImportError:\n    pass", "code_mine.py"),
    ],
)
def test_code_hash_covers_own_modules(imports: str, changed: str, write: Write) -> None:
    """Those that a user's tracker imports, directly or not; imports may fail."""
    write("code_helper.py", "OFF = 0")
    write("code_native.so", "not really")
    write("code_broken/__init__.py", "raise RuntimeError('not today')")
    write("code_pack/__init__.py", "")
    write("code_pack/user.py", "from .below import deep")
    write("code_pack/below/__init__.py", "")
    write("code_pack/below/deep.py", "OFF = 0")
    write("code_mine.py", f"{imports}\n{TRACKER}")
    before = code_hash(make("code_mine:T"))
    assert code_hash(make("code_mine:T")) == before
    write(changed, f"{TRACKER}\nOFF = 3")
    assert code_hash(make("code_mine:T")) != before


def test_code_hash_leaves_out_installed_packages(write: Write) -> None:
    write("site-packages/code_installed/__init__.py", "raise RuntimeError('imported')")
    write("site-packages/code_installed/below.py", "OFF = 0")
    sys.path.insert(0, next(folder for folder in sys.path if Path(folder, "site-packages").is_dir()) + "/site-packages")
    write("code_user.py", f"def later():\n    from code_installed.below import OFF\n{TRACKER}")
    before = code_hash(make("code_user:T"))
    write("site-packages/code_installed/below.py", "OFF = 3")
    assert code_hash(make("code_user:T")) == before
    assert "code_installed" not in sys.modules


def test_shipped_trackers_count_their_modules_and_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the C kernels the source counts."""
    assert code_hash(make("kalman")) == code_hash(make("kalman")) != code_hash(make("template"))
    read: list[Path] = []
    whole = Path.read_bytes

    def seen(path: Path) -> bytes:
        read.append(path)
        return whole(path)

    monkeypatch.setattr(Path, "read_bytes", seen)
    code_hash(make("grey_pf"))
    kernels = {path.name for path in read if path.parent.name == "_native"}
    assert {"__init__.py", "histogram.c", "kernels.h"} <= kernels
    assert {Path(name).suffix for name in kernels} == {".py", ".c", ".h"}


@dataclass(frozen=True)
class Nest:
    inner: np.ndarray


def test_different_values_have_different_configurations() -> None:
    class Of:
        def __init__(self, value: object) -> None:
            self.value = value

    def config(value: object) -> str:
        return json.dumps(tracker_config(Of(value))["parameters"]["value"], allow_nan=False)  # type: ignore[arg-type]  # any object with parameters

    long = np.zeros(5000)
    other = long.copy()
    other[2500] = 1  # which numpy's repr omits
    values = [long, other, long.astype(np.float32), long.reshape(50, 100), Nest(long), Nest(other), math.inf, -math.inf]
    assert len({config(value) for value in values}) == len(values)
    assert config(long) == config(np.zeros(5000))
    assert config({"b", "a"}) == config({"a", "b"})
    assert config(np.float32(0.5)) == config(0.5)
    for vague in (object(), [object()], np.array([object()])):
        with pytest.raises(InputError, match=r"value: object has no repr that identifies it.*allowed"):
            config(vague)


def test_name_and_configuration_of_a_tracker() -> None:
    known = irtrack.make("kalman")
    assert tracker_name(known) == "kalman"
    assert irtrack.make("kalman", tracker_config(known)["parameters"]) == known
    name = tracker_name(Nest(np.zeros(2)))  # type: ignore[arg-type]  # any object
    assert name == "test_tracker_identity:Nest"


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
    """Of a class as a notebook has it: without a file."""
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
def test_the_hash_follows_typed_code(old: str, new: str) -> None:
    assert typed_hash(TYPED.replace(old, new)) != typed_hash(TYPED)


def test_a_typed_class_counts_the_files_it_builds_on(write: Write) -> None:
    write("code_base.py", TRACKER)
    typed = "from code_base import T\nclass Typed(T):\n    pass\n"
    before = typed_hash(typed)
    write("code_base.py", TRACKER + "    half = 2\n")
    assert typed_hash(typed) != before


def test_the_hash_is_the_same_in_any_process_and_line() -> None:
    assert typed_hash(TYPED, 7) == typed_hash(TYPED)
    program = "import test_tracker_identity; print(test_tracker_identity.typed_hash(test_tracker_identity.TYPED))"
    env = {**os.environ, "PYTHONHASHSEED": "7", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", program], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == typed_hash(TYPED)


@pytest.mark.parametrize("name", TRACKERS)
def test_weight_files_of_shipped_trackers(name: str) -> None:
    """Only those that are trained have a file; `weights` of camshift_kalman is a parameter, not a path."""
    assert (weights_digest(make(name)) != "") == (name in {"hog_pf", "adaboost_pf"})
