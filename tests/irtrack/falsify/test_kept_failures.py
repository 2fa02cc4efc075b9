"""Kept failures with another kind of failure or another limit than noted."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import planted_failure
import pytest
from mesh_files import BOX
from typer.testing import CliRunner

import irsim
from irsim.cli.terminal import in_options
from irtrack.bench import load_suite
from irtrack.cli.app import app
from irtrack.errors import InputError
from irtrack.falsify import check_kept, find_failure, kept_failures
from irtrack.falsify.regressions import keep
from irtrack.falsify.rules import RAISES, RULE
from irtrack.falsify.trial import Subject
from irtrack.registry.table import make

FAR = {"px": 30.0}
"""Parameter that breaks the rule of `folder`."""
TRACKERS = {"Raising": {}, "Exiting": {}, "Offset": FAR, "Slow": FAR}
BROKEN = "error_below (px 5.0, share 1.0)"
ENDED = "ends its process or hangs"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a kept failure: a tracker that raises in frame 9."""
    base = tmp_path_factory.mktemp("kept")
    near = irsim.loads(planted_failure.SCENE.replace("low: 4, high: 54", "low: 32, high: 36"))
    held = irsim.change(near, {"expect": [{"kind": "error_below", "px": 5}]})
    kept_in = base / "regressions"
    find_failure(held, "planted_failure:Raising", base / "out", name="blind", fresh=5, keep_in=kept_in)
    return kept_in


def note_of(folder: Path, copy: Path) -> Path:
    shutil.copytree(folder, copy)
    (note,) = copy.glob("*.json")
    return note


@pytest.mark.parametrize(
    ("noted", "limit_s", "tracker", "said"),
    [
        (RULE, None, "Exiting", f"broke {BROKEN}, now it {ENDED}: planted_failure:Exiting: frame 9: the process died "),
        (RAISES, None, "Offset", f"raised an exception, now it breaks {BROKEN}: margin -5"),
        (RULE, 30.0, "Slow", None),  # within its own limit
        (RULE, None, "Slow", f"broke {BROKEN}, now it {ENDED}: planted_failure:Slow: frame 9: hangs: more than 2 s "),
    ],
)
def test_changed_kind_of_failure_is_reported(
    folder: Path, tmp_path: Path, noted: str | None, limit_s: float | None, tracker: str, said: str | None
) -> None:
    """Within its own limit a slow tracker does not hang."""
    note = note_of(folder, tmp_path / "kept")
    found = {"how": noted, "limit_s": limit_s, "tracker": f"planted_failure:{tracker}", "parameters": TRACKERS[tracker]}
    values = {**json.loads(note.read_text()), **found}
    note.write_text(json.dumps({key: value for key, value in values.items() if value is not None}))
    found_now = check_kept(kept_failures(note.parent), frame_limit_s=2.0)
    assert found_now.faults == []
    assert len(found_now.changes) == (said is not None)
    assert [line for line in found_now.changes if f".yaml: planted_failure:Raising {said}" not in line] == []


def test_note_has_kind_of_failure_and_limit(folder: Path, tmp_path: Path) -> None:
    """The limit is None without one; `irtrack regress --update` sets it."""
    (kept,) = kept_failures(note_of(folder, tmp_path / "kept").parent)
    assert (kept.how, kept.limit_s) == (RAISES, None)
    check_kept([kept], update=True, frame_limit_s=7.0)
    (kept,) = kept_failures(tmp_path / "kept")
    assert (kept.how, kept.limit_s) == (RAISES, 7.0)
    assert not kept.changes()


def test_scene_is_kept_once_for_each_mesh(tmp_path: Path) -> None:
    """The same scene with the mesh elsewhere is the same; with a changed mesh it is another."""
    kept_in = tmp_path / "regressions"

    def kept(folder: str, mesh: str, px: int = 5) -> str:
        found = tmp_path / folder
        found.mkdir(exist_ok=True)
        (found / "box.obj").write_text(mesh)
        text = (
            "frames: 2\ncamera: {size: [32, 24]}\nbackground: {kind: ground}\ntargets: [{id: box, shape: "
            f"{{kind: mesh, file: box.obj, length_m: 4}}, path: {{kind: straight, start: [15, 12]}}}}]\n"
            f"expect: [{{kind: error_below, px: {px}}}]\n"
        )
        (found / "minimal.yaml").write_text(text)
        scene = irsim.load(found / "minimal.yaml")
        irsim.record(irsim.Rendering(scene), found / "minimal.mcap")
        subject = Subject("kalman", make("kalman"), "display", scene.expect)
        return str(keep(found, subject, "far", RULE, kept_in))

    first = kept("one", BOX)
    assert kept("two", BOX) == first
    assert kept("one", BOX, px=6) == f"{first}-2"
    assert kept("one", BOX.replace(" 1\n", " 3\n")) == f"{first}-3"


def test_a_missing_folder_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"^nope: there is no such folder in {tmp_path}"):
        kept_failures("nope")


@pytest.mark.parametrize(
    ("tracker", "parameters"),
    [
        ("program", {"command": "touch ran"}),
        ("trax:touch ran", {}),
        ("program_many", {"command": "touch ran"}),
    ],
)
def test_commands_of_strangers_do_not_run(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tracker: str, parameters: dict[str, str]
) -> None:
    """Defect 35: a kept failure or a suite of somebody else ran commands without a question."""
    monkeypatch.chdir(tmp_path)
    note = note_of(folder, tmp_path / "kept")
    note.write_text(json.dumps({**json.loads(note.read_text()), "tracker": tracker, "parameters": parameters}))
    (kept,) = kept_failures(tmp_path / "kept")
    refused = f"{note}: {tracker.partition(':')[0]}: runs the command 'touch ran'; allowed: trackers without one, or "
    with pytest.raises(InputError, match=re.escape(refused + "trust=True")):
        kept.changes()
    suite = tmp_path / "my-suite.yaml"
    suite.write_text(json.dumps({"sources": ["sky"], "trackers": [{"tracker": tracker, "parameters": parameters}]}))
    with pytest.raises(InputError, match=r"my-suite\.yaml:1:\d+: trackers\.0: .* runs the command 'touch ran'"):
        load_suite(suite)
    for words in (["regress", "kept"], ["bench", "my-suite.yaml"]):
        done = CliRunner().invoke(app, words)
        assert "or --trust" in in_options(done.stderr + str(done.exception))
    assert not (tmp_path / "ran").exists()
    (kept,) = kept_failures(tmp_path / "kept", trust=True)
    assert kept.fault is None
    assert [each.label for each in load_suite(suite, trust=True).trackers] == [tracker]
    kept.changes()
    assert (tmp_path / "ran").exists()
