"""Which code tells one version of a tracker from another."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from irtrack.registry.identity import code_hash
from irtrack.registry.table import make
from irtrack.trackers.adapters import Plain

TRACKER = "class T:\n    def start(self, image, box): self.box = box\n    def step(self, image): return self.box\n"

Write = Callable[[str, str], None]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Files of a user's folder."""
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
        ("import code_helper", "code_helper.py"),
        ("from code_helper import OFF", "code_helper.py"),
        ("from code_pack.below import deep", "code_pack/below/deep.py"),
        ("import code_pack.below.deep", "code_pack/below/deep.py"),
        ("from code_pack import user", "code_pack/below/deep.py"),
        ("def later():\n    import code_helper", "code_helper.py"),
        ("try:\n    import code_native\nexcept ImportError:\n    pass", "code_native.so"),
    ],
)
def test_a_module_of_ones_own_counts(imports: str, changed: str, write: Write) -> None:
    write("code_helper.py", "OFF = 0")
    write("code_native.so", "not really")
    write("code_pack/__init__.py", "")
    write("code_pack/user.py", "from .below import deep")
    write("code_pack/below/__init__.py", "")
    write("code_pack/below/deep.py", "OFF = 0")
    write("code_mine.py", f"{imports}\n{TRACKER}")
    before = code_hash(make("code_mine:T"))
    assert code_hash(make("code_mine:T")) == before
    write(changed, "OFF = 3")
    assert code_hash(make("code_mine:T")) != before


def test_what_is_installed_does_not_count_and_is_not_imported(write: Write) -> None:
    write("site-packages/code_installed/__init__.py", "raise RuntimeError('imported')")
    write("site-packages/code_installed/below.py", "OFF = 0")
    sys.path.insert(0, next(folder for folder in sys.path if Path(folder, "site-packages").is_dir()) + "/site-packages")
    write("code_user.py", f"def later():\n    from code_installed.below import OFF\n{TRACKER}")
    before = code_hash(make("code_user:T"))
    write("site-packages/code_installed/below.py", "OFF = 3")
    assert code_hash(make("code_user:T")) == before
    assert "code_installed" not in sys.modules


def test_inner_loops_count_by_their_source_whether_compiled_or_not(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Path] = []
    whole = Path.read_bytes

    def seen(path: Path) -> bytes:
        read.append(path)
        return whole(path)

    monkeypatch.setattr(Path, "read_bytes", seen)
    code_hash(make("grey_pf"))
    loops = {path.name for path in read if path.parent.name == "compiled"}
    assert {"__init__.py", "windows.c", "windows.h"} <= loops
    assert {Path(name).suffix for name in loops} == {".py", ".c", ".h"}


def test_what_is_not_there_or_cannot_be_imported_is_no_error(write: Write) -> None:
    write("code_broken/__init__.py", "raise RuntimeError('not today')")
    write(
        "code_poor.py",
        f"try:\n    import nowhere.at.all\nexcept ImportError: pass\ndef f():\n    import code_broken.b\n{TRACKER}",
    )
    assert code_hash(make("code_poor:T")) == code_hash(make("code_poor:T"))


def test_a_class_typed_into_a_prompt_is_told_by_the_files_that_it_builds_on(write: Write) -> None:
    write("code_base.py", TRACKER)
    typed = "from code_base import T\nclass Mine(T):\n    pass\n"
    before = code_hash(make_typed(typed))
    write("code_base.py", TRACKER + "    half = 2\n")
    assert code_hash(make_typed(typed)) != before


def make_typed(text: str) -> Plain:
    names: dict[str, object] = {"__name__": "typed_nowhere"}
    exec(text, names)
    kind = names["Mine"]
    assert isinstance(kind, type)
    return Plain.made(kind, {})


def test_the_code_hash_follows_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def hash_of(name: str, text: str) -> str:
        (tmp_path / f"{name}.py").write_text(text)
        return code_hash(__import__(name).T())

    monkeypatch.syspath_prepend(tmp_path)
    plain = "class T:\n    pass\n"
    own = [hash_of("hashed_one", plain), hash_of("hashed_two", plain + "\n")]
    assert own[0] != own[1]
    (tmp_path / "hashed_one.py").write_text(plain + "# changed\n")
    assert code_hash(__import__("hashed_one").T()) != own[0]
    # what it imports of irtrack counts, through packages and their modules
    importing = hash_of("hashed_three", "from irtrack.filters import kalman\n" + plain)
    assert importing != hash_of("hashed_four", "from irtrack.features import window\n" + plain)
    assert code_hash(make("kalman")) != code_hash(make("template"))
    assert code_hash(make("kalman")) == code_hash(make("kalman"))
