"""Trackers that run as programs: what they say is passed on, and nothing that they do wrong is hidden."""

from __future__ import annotations

import gc
import json
import os
import re
import shlex
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import Call
from processes import PATIENCE_S, runs, wait_until

import irsim
import irtrack
from irtrack import external as peers
from irtrack.bench import run_bench
from irtrack.errors import InputError, TrackerError
from irtrack.external import install
from irtrack.registry.table import describe, make
from irtrack.trackers.external import EXTERNAL

FAKE = Path(__file__).parents[2] / "support" / "fake_peer.py"
INSTALLED = peers.offered()
SCENE = """
frames: 12
camera: {size: [64, 48], netd_mk: 20, bits: 14}
background: {kind: ground, spread_k: 0}
targets:
  - id: dot
    shape: {kind: hot_spot, size_m: [3, 3], temperature_k: 340}
    path: {kind: straight, start: [20, 20], speed: 1.5}
"""


def scene() -> irsim.Rendering:
    return irsim.Rendering(irsim.loads(SCENE), "dot")


def fake(mode: str = "good", at: int = 4, **more: object) -> irtrack.Tracker:
    words = [sys.executable, str(FAKE), mode, str(at)]
    return make("program", {"command": shlex.join(words), **more})


@pytest.mark.parametrize("input", ["display", "counts"])
def test_a_program_is_shown_each_frame_and_its_boxes_come_back(input: irsim.Input) -> None:
    """The fake follows the brightest pixel: 8 and 14 bits arrive whole, its boxes at their places."""
    source = scene()
    track = irtrack.run(fake(), source, input=input)
    truth = np.array([target.center for each in source.truths() if (target := each.target("dot"))])
    assert np.abs(track.centers - truth).max() < 4
    assert set(track.statuses) == {"tracking"}
    assert track.sizes[5] == pytest.approx(track.sizes[0])


def test_the_context_widens_the_box_that_is_given_and_narrows_the_one_that_is_told() -> None:
    tight, wide = (irtrack.run(fake(context=context), scene()) for context in (1.0, 3.0))
    assert wide.sizes[3] == pytest.approx(tight.sizes[3])
    assert wide.centers[3] == pytest.approx(tight.centers[3])


def test_a_lost_flag_is_passed_on() -> None:
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
def test_what_a_program_does_wrong_is_one_line_with_its_place(mode: str, said: str) -> None:
    with pytest.raises(TrackerError) as raised:
        irtrack.run(fake(mode), scene())
    assert str(raised.value).startswith(said)
    assert "\n" not in str(raised.value)


def test_a_program_that_hangs_is_ended() -> None:
    """At frame 4, unless the machine is so slow that it comes late before."""
    with pytest.raises(TrackerError, match=r"program: frame \d: its program gave no answer in 0\.5 s"):
        irtrack.run(fake("hang", timeout_s=0.5), scene())


def test_a_program_that_hangs_is_given_its_time_and_no_more() -> None:
    """Counted from the request: how slow it was to begin does not matter."""
    child = peers.Child([sys.executable, str(FAKE), "hang", "4"])
    request = {"rows": 1, "columns": 1, "bits": 8, "seed": 0, "box": [0, 0, 1, 1], "frame": 4}
    requests = [json.dumps(request | {"do": do}).encode() + b"\n0" for do in ("init", "step")]
    child.ask(requests[:1], PATIENCE_S)
    with pytest.raises(TrackerError, match=r"its program gave no answer in 0\.01 s"):
        child.ask(requests[1:], 0.01)
    assert not child.alive


def test_a_program_killed_from_outside_fails_its_own_cell_and_no_other(tmp_path: Path) -> None:
    trackers = [irtrack.bench.Entry("dies", fake("die")), irtrack.bench.Entry("good", fake())]
    with run_bench([scene()], trackers, results=tmp_path / "r.db", seeds=1) as results:
        cells = {cell.label: cell for cell in results.cells()}
    assert cells["good"].status == "ok"
    assert cells["dies"].status == "failed"
    assert "out of luck" in (cells["dies"].failure or "")


def test_a_program_is_used_again_when_nobody_holds_its_session_and_not_before() -> None:
    """The fake tells its process id as its score."""
    first = irtrack.run(fake(), scene()).estimates[3].score
    gc.collect()
    again = irtrack.run(fake(), scene()).estimates[3].score
    assert again == first
    tracker = fake()
    start = next(iter(scene().frames("display")))
    held = [tracker.init(start, irsim.Box(20, 20, 9, 9), np.random.default_rng(0)) for _ in range(2)]
    frame = scene().frame(1, "display")
    scores = {tracker.step(state, frame, np.random.default_rng(0))[1].score for state in held}
    assert len(scores) == 2


def test_a_dead_idle_program_is_not_used_again() -> None:
    track = irtrack.run(fake(at=90), scene())
    gc.collect()
    pid = int(track.estimates[3].score or 0)
    os.kill(pid, signal.SIGKILL)
    wait_until(lambda: not runs(pid))
    assert irtrack.run(fake(at=90), scene()).estimates[3].score != track.estimates[3].score


@pytest.mark.parametrize("command", ["''", "/nowhere/at/all"])
def test_a_program_that_cannot_be_started_is_bad_input(command: str) -> None:
    with pytest.raises(InputError, match=r"program: command|cannot be started"):
        irtrack.run(make("program", {"command": command}), scene())


@pytest.mark.parametrize("name", ["program", "trax"])
@pytest.mark.parametrize(("command", "status"), [(False, 1), ("true", 0)])
def test_a_program_that_ends_at_once_is_told_so(name: str, command: object, status: int) -> None:
    """`false` and `true`: programs of every system, and YAML's truth, which `command=false` is read as."""
    said = rf"{name}: frame 0: its program ended with status {status} before its first answer; it wrote nothing"
    with pytest.raises(TrackerError, match=said):
        irtrack.run(make(name, {"command": command}), scene())


def test_without_the_environment_a_peer_is_refused_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(install, "python", lambda: None)
    with pytest.raises(InputError, match="cv_kcf: runs in an environment that is not there; allowed: after make peers"):
        make("cv_kcf", {})
    assert peers.offered() == []
    assert not {row.name for row in describe()} & set(peers.PEERS)


def broken(folder: Path, script: str) -> Path:
    """A program that is no Python of the peers."""
    program = folder / "python"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    return program


@pytest.mark.skipif(sys.platform == "win32", reason="no shell scripts")
@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("echo no library >&2; exit 1", r"it ended \(exit status 1\); it last wrote: no library"),
        ("exit 1", r"it ended \(exit status 1\)"),
        ("kill -9 $$", r"it ended \(SIGKILL\)"),
        ("echo hello", "it does not say which peers it has"),
        ("echo 7", "it does not say which peers it has"),
    ],
)
def test_a_named_python_that_does_not_run_the_peers_is_told(
    script: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Call
) -> None:
    program = broken(tmp_path, script)
    monkeypatch.setenv("IRTRACK_PEERS", str(program))
    line = rf"IRTRACK_PEERS={program}: {said}; allowed: the Python of an environment as make peers installs it"
    with pytest.raises(InputError, match=f"^{line}$"):
        make("cv_kcf", {})
    listed = call("list")
    assert listed.status == 0
    assert re.fullmatch(f"warning: {line}\n", listed.err)
    assert "cv_kcf" not in listed.out  # nor the hint, which names them all


@pytest.mark.parametrize("name", ["nowhere", "."])
def test_a_named_python_that_is_not_there_is_told(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Call
) -> None:
    monkeypatch.setenv("IRTRACK_PEERS", str(tmp_path / name))
    line = (
        f"IRTRACK_PEERS={tmp_path / name}: there is no such file; allowed: the Python of an environment as make peers"
    )
    for command, status in ((("list",), 0), (("run", "dlib", "sky"), 2)):
        answer = call(*command)
        assert answer.status == status
        assert line in answer.err
        assert answer.err.count("\n") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="no shell scripts")
def test_a_peer_that_the_environment_does_not_have_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IRTRACK_PEERS", str(broken(tmp_path, """echo '["dlib"]'""")))
    assert peers.offered() == ["dlib"]
    make("dlib", {})
    with pytest.raises(
        InputError, match=f"cv_kcf: is not in {tmp_path}/python's environment; allowed: after make peers"
    ):
        make("cv_kcf", {})


def test_every_peer_has_a_class() -> None:
    assert {*peers.PEERS, "program", "trax"} == EXTERNAL.keys()


needs_peers = pytest.mark.skipif(not INSTALLED, reason=f"no peers here: {peers.HINT}")


@needs_peers
@pytest.mark.parametrize("name", INSTALLED or ["none"])
def test_a_peer_follows_a_plain_target_with_context(name: str) -> None:
    """Within its own size, on clean frames: the boxes go in and come out at their places."""
    source = irsim.Rendering(irsim.loads(SCENE.replace("[64, 48]", "[128, 96]").replace("[3, 3]", "[8, 6]")), "dot")
    track = irtrack.run(make(name, {"context": 2}), source, seed=1)
    truth = np.array([target.center for each in source.truths() if (target := each.target("dot"))])
    assert np.median(np.abs(track.centers - truth)) < 5


@needs_peers
def test_installed_peers_are_listed() -> None:
    assert {row.name for row in describe(INSTALLED)} >= set(INSTALLED)
