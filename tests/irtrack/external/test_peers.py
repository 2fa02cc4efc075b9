"""Trackers that run as programs by the JSON protocol, and the peers of OpenCV and dlib."""

from __future__ import annotations

import gc
import os
import re
import shlex
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import Call
from dot_scene import SCENE, scene
from processes import runs, wait_until

import irsim
import irtrack
from irtrack import external as peers
from irtrack.errors import InputError, TrackerError
from irtrack.external import install
from irtrack.registry.table import describe, make
from irtrack.trackers.external import EXTERNAL

FAKE = Path(__file__).parents[2] / "support" / "fake_peer.py"
INSTALLED = peers.offered(*peers.PEERS)


def fake(mode: str = "good", at: int = 4, **more: object) -> irtrack.Tracker:
    words = [sys.executable, str(FAKE), mode, str(at)]
    return make("program", {"command": shlex.join(words), **more})


def test_frames_arrive_and_boxes_return_in_both_depths() -> None:
    """The fake follows the brightest pixel, in a box widened by the context; its score is its process id."""
    source = scene()
    truth = np.array([target.center for each in source.truths() if (target := each.target("dot"))])
    tracks = [irtrack.run(fake(), source, input=kind) for kind in ("display", "counts")]
    tracks.append(irtrack.run(fake(context=3.0), source))
    for track in tracks:
        assert np.abs(track.centers - truth).max() < 4
        assert set(track.statuses) == {"tracking"}
        assert track.sizes[5] == pytest.approx(track.sizes[0])
    gc.collect()
    first = tracks[0].estimates[3].score
    assert irtrack.run(fake(), source).estimates[3].score == first  # an idle program is used again
    os.kill(int(first or 0), signal.SIGKILL)
    wait_until(lambda: not runs(int(first or 0)))
    assert irtrack.run(fake(), source).estimates[3].score != first


def test_programs_in_use_are_not_shared() -> None:
    tracker, frames = fake(), list(scene().frames("display", stop=2))
    held = [tracker.init(frames[0], irsim.Box(20, 20, 9, 9), np.random.default_rng(0)) for _ in range(2)]
    scores = {tracker.step(state, frames[1], np.random.default_rng(0))[1].score for state in held}
    assert len(scores) == 2


def test_a_reported_loss_is_the_status() -> None:
    track = irtrack.run(fake("lost", 4), scene())
    assert track.statuses[:4] == ("tracking",) * 4
    assert set(track.statuses[4:]) == {"lost"}


@pytest.mark.parametrize(
    ("mode", "said"),
    [
        ("raise", "program: frame 4: ValueError: the box left the picture"),
        ("die", "program: frame 4: its program ended with status 3; it last wrote: out of luck"),
        ("garble", "program: frame 4: its program answered b'hello"),
        ("status", "program: frame 4: its program says 'dreaming'; allowed: tracking, occluded, lost"),
        ("nan", "program: frame 4: its program answered the box"),
    ],
)
def test_an_error_of_a_program_is_one_line_with_its_frame(mode: str, said: str) -> None:
    with pytest.raises(TrackerError) as raised:
        irtrack.run(fake(mode), scene())
    assert str(raised.value).startswith(said)
    assert "\n" not in str(raised.value)


def test_a_program_that_hangs_is_ended() -> None:
    """At frame 4, or before on a slow machine."""
    with pytest.raises(TrackerError, match=r"program: frame \d: its program gave no answer in 0\.5 s"):
        irtrack.run(fake("hang", timeout_s=0.5), scene())


@pytest.mark.parametrize("name", ["program", "trax"])
def test_commands_that_do_not_run(name: str) -> None:
    """YAML reads the programs `false` and `true` as truth values."""
    for command in ("''", "/nowhere/at/all"):
        with pytest.raises(InputError, match=rf"{name}: command|cannot be started"):
            irtrack.run(make(name, {"command": command}), scene())
    for truth, status in ((False, 1), ("true", 0)):
        said = rf"{name}: frame 0: its program ended with status {status} before its first answer; it wrote nothing"
        with pytest.raises(TrackerError, match=said):
            irtrack.run(make(name, {"command": truth}), scene())


def test_a_missing_peer_is_refused_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(install, "python", lambda: None)
    with pytest.raises(InputError, match="cv_kcf: runs in an environment that is not there"):
        make("cv_kcf", {})
    assert peers.offered() == []
    assert not {row.name for row in describe()} & set(peers.ALL_PEERS)
    assert {*peers.PEERS, "program", "trax"} == EXTERNAL.keys()


def script(folder: Path, text: str) -> Path:
    """A program in place of the peers' Python."""
    program = folder / "python"
    program.write_text(f"#!/bin/sh\n{text}\n")
    program.chmod(0o755)
    return program


@pytest.mark.skipif(sys.platform == "win32", reason="no shell scripts")
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("echo no library >&2; exit 1", r"it ended \(exit status 1\); it last wrote: no library"),
        ("kill -9 $$", r"it ended \(SIGKILL\)"),
        ("echo 7", "it does not say which peers it has"),
    ],
)
def test_a_python_that_does_not_run_the_peers_is_reported(
    text: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Call
) -> None:
    program = script(tmp_path, text)
    monkeypatch.setenv("IRTRACK_PEERS", str(program))
    line = rf"IRTRACK_PEERS={program}: {said}; allowed: the Python of an environment as make peers installs it"
    with pytest.raises(InputError, match=f"^{line}$"):
        make("cv_kcf", {})
    listed = call("list")
    assert listed.status == 0
    assert re.fullmatch(f"warning: {line}\n", listed.err)
    assert "cv_kcf" not in listed.out


@pytest.mark.skipif(sys.platform == "win32", reason="no shell scripts")
def test_peers_of_a_named_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IRTRACK_PEERS", str(tmp_path / "nowhere"))
    with pytest.raises(InputError, match=f"IRTRACK_PEERS={tmp_path}/nowhere: there is no such file; allowed"):
        make("dlib", {})
    monkeypatch.setenv("IRTRACK_PEERS", str(script(tmp_path, """echo '["dlib"]'""")))
    assert peers.offered() == ["dlib"]
    make("dlib", {})
    with pytest.raises(InputError, match=f"cv_kcf: is not in {tmp_path}/python's environment"):
        make("cv_kcf", {})


@pytest.mark.skipif(not INSTALLED, reason=f"no peers here: {peers.HINT}")
@pytest.mark.parametrize("name", INSTALLED or ["none"])
def test_an_installed_peer_follows_a_plain_target(name: str) -> None:
    """Within its own size, on clean frames."""
    assert name in {row.name for row in describe(INSTALLED)}
    source = irsim.Rendering(irsim.loads(SCENE.replace("[64, 48]", "[128, 96]").replace("[3, 3]", "[8, 6]")), "dot")
    track = irtrack.run(make(name, {"context": 2}), source, seed=1)
    truth = np.array([target.center for each in source.truths() if (target := each.target("dot"))])
    assert np.median(np.abs(track.centers - truth)) < 5
