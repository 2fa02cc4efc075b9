"""Trackers by name and parameters: the table, own modules, installed packages."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from irsim.config.fields import field_docs
from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.errors import InputError
from irtrack.registry.table import TRACKERS, describe, make, of
from irtrack.trackers.kalman import Kalman
from irtrack.types import resumable


def test_every_tracker_is_described_and_remade_from_its_parameters() -> None:
    rows = {row.name: row for row in describe()}
    for name, cls in TRACKERS.items():
        defaults = cls().model_dump()
        assert repr(make(name, defaults)) == repr(cls())
        assert set(defaults) <= set(field_docs(cls))
        assert rows[name].summary.endswith(".")
        assert rows[name].source


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("gray_pf", {}, ["unknown tracker 'gray_pf'", "allowed: grey_pf, ", "did you mean 'grey_pf'?"]),
        ("grey_pf", {"particle": 9}, ["grey_pf: particle: unknown key", "did you mean 'particles'?"]),
        ("grey_pf", {"particles": "many"}, ["particles: expected a whole number, not 'many'", "from 2 to 1000000"]),
        ("grey_pf", {"alpha": 2.0}, ["grey_pf: alpha: 2", "out of range", "from 0 to 1"]),
        ("grey_pf", {"noise": "loud"}, ["grey_pf: noise: unknown value 'loud'", "'adaptive', 'fixed'"]),
        ("grey_pf", {"r_min": 4.0, "r_max": 3.0}, ["grey_pf: r_max 3.0 is below r_min 4.0"]),
        ("no_such_module:Tracker", {}, ["cannot import", "no_such_module"]),
        ("irtrack.types:Nothing", {}, ["cannot import", "Nothing"]),
        ("irtrack.types:Status", {}, ["not a tracker"]),
        ("irsim.types:Box", {}, ["not a tracker: it has no start and no step; allowed: a class with start(frame, "]),
        (":", {}, ["this is no module:Class"]),
        ("grey_pf:", {}, ["'grey_pf:': grey_pf is a tracker's name, not a module", "grey_pf:KEY=VALUE"]),
        ("brightest.py:Brightest", {}, ["no module:Class", "did you mean 'brightest:Brightest'?"]),
    ],
)
def test_bad_names_and_parameters_are_one_line(name: str, parameters: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        make(name, parameters)
    text = str(caught.value)
    assert "\n" not in text
    for word in words:
        assert word in text


@pytest.mark.parametrize(("has", "lacks"), [("start", "step"), ("init", "step"), ("step", "start")])
def test_an_incomplete_tracker_names_the_missing_method(has: str, lacks: str) -> None:
    half = type("Half", (), {has: lambda *_: None})
    for given in (half, half()):
        with pytest.raises(InputError, match=rf"Half' is not a tracker: it has {has} but no {lacks}; allowed: .* init"):
            of(given)


def test_each_wrong_parameter_has_a_line() -> None:
    with pytest.raises(InputError) as caught:
        make("kalman", {"gate": -1.0, "speed": 2})
    assert len(str(caught.value).splitlines()) == 2
    assert make("grey_pf", {"particles": 1e3}) == make("grey_pf", {"particles": 1000})


FOREIGN = """
class Still:
    '''Stays at its start.'''
    resumable = True

    def __init__(self, offset=0.0):
        if offset < 0:
            raise ValueError("offset must not be negative")
        self.offset = offset

    def init(self, frame, box, rng):
        return box

    def step(self, state, frame, rng):
        return state, state.cx + self.offset


class Typed(Still):
    def __init__(self, reach: int = 5, mode: "str | None" = None, names: list = ()):
        print("made")
        if mode == "leave":
            raise SystemExit(3)
        if mode == "break":
            raise KeyError("here")
        self.parts = (reach, mode, names)
"""


@pytest.fixture
def foreign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a user's own tracker."""
    (tmp_path / "my_foreign_tracker.py").write_text(FOREIGN)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "my_foreign_tracker", raising=False)
    return tmp_path


def test_a_tracker_of_the_current_folder(foreign: Path) -> None:
    tracker = make("my_foreign_tracker:Still", {"offset": 2.0})
    state = tracker.init(Frame(np.zeros((9, 9), np.uint8), 0, 0.0, 8), Box(4, 4, 5, 5), stream(0))
    assert cast(Any, tracker).step(state, Frame(np.zeros((9, 9), np.uint8), 1, 0.1, 8), stream(0))[1] == 6
    with pytest.raises(InputError, match=r"unexpected keyword argument 'shift'"):
        make("my_foreign_tracker:Still", {"shift": 2.0})
    with pytest.raises(InputError, match=r"my_foreign_tracker:Still: offset must not be negative"):
        make("my_foreign_tracker:Still", {"offset": -2.0})


def test_annotated_parameters_of_a_users_tracker(foreign: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = "my_foreign_tracker:Typed"
    assert cast(Any, make(name, {"reach": 1e1, "names": [1, "a"]})).parts == (10, None, [1, "a"])
    assert capsys.readouterr() == ("", "made\n")
    with pytest.raises(InputError) as caught:
        make(name, {"reach": "x"})
    assert str(caught.value) == f"{name}: reach: expected a whole number, not 'x'; allowed: a whole number"
    with pytest.raises(InputError, match=r"Typed: mode: 3 is not allowed|Typed: mode: expected text, not 3"):
        make(name, {"mode": 3})
    with pytest.raises(InputError, match=r"Typed: SystemExit: 3"):
        make(name, {"mode": "leave"})
    with pytest.raises(InputError, match=r"Typed: KeyError: 'here'"):
        make(name, {"mode": "break"})
    (foreign / "my_leaving_tracker.py").write_text("raise SystemExit(3)")
    with pytest.raises(InputError, match=r"cannot import tracker 'my_leaving_tracker:X': SystemExit: 3"):
        make("my_leaving_tracker:X")
    (foreign / "my_broken_tracker.py").write_text("class Still(:\n")
    with pytest.raises(InputError, match=r"^cannot import tracker 'my_broken_tracker:Still': SyntaxError[^\n]*$"):
        make("my_broken_tracker:Still")


def test_trackers_of_installed_packages(foreign: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = foreign / "my_foreign_tracker-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-foreign-tracker\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[irtrack.trackers]\nstill = my_foreign_tracker:Still\ngone = no_such_module:Gone\nkalman = x:Y\n"
    )
    monkeypatch.syspath_prepend(foreign)
    assert resumable(make("still"))
    assert isinstance(make("kalman"), Kalman)
    rows = {row.name: row.summary for row in describe()}
    assert rows["still"] == "Stays at its start."
    assert rows["gone"].startswith("cannot import tracker 'gone'")
    with pytest.raises(InputError, match=r"did you mean 'still'\?"):
        make("stil")


def test_a_module_that_ends_the_program_is_an_error(foreign: Path) -> None:
    (foreign / "ends_it_all.py").write_text("import os\nos._exit(0)")
    with pytest.raises(InputError, match=r"cannot import tracker 'ends_it_all:Mine': SystemExit: os\._exit\(0\)"):
        make("ends_it_all:Mine")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("my_foreign_tracker.Still", "; did you mean 'my_foreign_tracker:Still'?"),
        ("my_foreign_tracker.py", "; did you mean 'my_foreign_tracker:Class'?"),
        ("my_foreign_tracker:Stil", "has no attribute 'Stil'; did you mean 'Still'?"),
        ("needy:Needy", "needy:Needy: no value of reach; allowed: needy:Needy:reach=VALUE"),
    ],
)
def test_misspelt_names_get_a_guess(foreign: Path, name: str, said: str) -> None:
    (foreign / "needy.py").write_text("class Needy:\n def __init__(self, reach): pass\n start = step = print\n")
    with pytest.raises(InputError) as caught:
        make(name)
    assert str(caught.value).endswith(said)
