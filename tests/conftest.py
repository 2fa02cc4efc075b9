"""Fixtures that several test files share."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import OWN_TRACKERS, SCENE_OF_TWO, SMALL_SCENE, Answer, Call, Done, Run
from hypothesis import HealthCheck, settings

import irsim
import irtrack.cli
from irsim.cli.app import main
from irsim.recording.importers import import_frames

# No test has a deadline: a busy machine is slow, and nothing is wrong.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

# A shell ignores Ctrl-C for background jobs; tests that send it would wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run the command irsim in this process: `run("check", "sky", cwd=folder)`."""

    def call(*arguments: str, cwd: Path) -> Done:
        monkeypatch.chdir(cwd)
        monkeypatch.setattr(sys, "argv", ["irsim", *arguments])
        monkeypatch.setattr(sys, "path", list(sys.path))
        with pytest.raises(SystemExit) as caught:
            main()
        captured = capsys.readouterr()
        return Done(int(caught.value.code or 0), captured.out, captured.err)

    return call


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with `SMALL_SCENE` in it, as scene.yaml."""
    (tmp_path / "scene.yaml").write_text(SMALL_SCENE)
    return tmp_path


@pytest.fixture(scope="session")
def footage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write an imported recording of the size, depth and rate that `irsim new recording` uses."""
    folder = tmp_path_factory.mktemp("footage")
    for index in range(3):
        even = np.full((256, 320), 100 + index, np.uint8)
        cv2.imwrite(str(folder / f"{index}.png"), even)
    return import_frames(folder, folder / "footage.mcap", rate_hz=25)


@pytest.fixture
def beside_footage(footage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """This process works in a folder that holds the footage."""
    (tmp_path / footage.name).symlink_to(footage)
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene, recordings, whole and broken, and trackers of the user's own."""
    folder = tmp_path_factory.mktemp("cli")
    (folder / "scene.yaml").write_text(SCENE_OF_TWO)
    irsim.record(irsim.open_source(folder / "scene.yaml"), folder / "clip.mcap")
    (folder / "cut.mcap").write_bytes((folder / "clip.mcap").read_bytes()[:5000])
    (folder / "empty.mcap").write_bytes(b"")
    (folder / "sweep.yaml").write_text("sources: [scene.yaml]\ntrackers: [kalman]\nseeds: 1\n")
    (folder / "mine.py").write_text(OWN_TRACKERS)
    return folder


@pytest.fixture
def bare_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    """The command irtrack in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))

    def run(*words: str) -> Answer:
        monkeypatch.setattr(sys, "argv", ["irtrack", *words])
        with pytest.raises(SystemExit) as ended:
            irtrack.cli.main()
        out, err = capsys.readouterr()
        status = ended.value.code
        return Answer(status if isinstance(status, int) else int(status is not None), out, err)

    return run


@pytest.fixture
def call(made: Path, tmp_path: Path, bare_call: Call) -> Call:
    """The same in a folder that holds what `made` holds."""
    for file in made.iterdir():
        (tmp_path / file.name).symlink_to(file)
    return bare_call
