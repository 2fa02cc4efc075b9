"""irsim as a process: terminals, closed pipes, signals, kinds of the user's own."""

from __future__ import annotations

import importlib
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_line import IRSIM, SMALL_SCENE, Run
from processes import wait_until


def test_characters_that_the_terminal_lacks(folder: Path) -> None:
    (folder / "sc\u00e9ne.yaml").write_text(SMALL_SCENE)
    done = subprocess.run(
        [*IRSIM, "check", "sc\u00e9ne.yaml"],
        cwd=folder,
        capture_output=True,
        timeout=60,
        env={**os.environ, "LC_ALL": "C", "PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(b"sc?")


def test_a_closed_pipe_is_not_reported(folder: Path) -> None:
    process = subprocess.Popen(
        [*IRSIM, "check", *["scene.yaml"] * 3], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    assert process.stderr.read() == b""
    assert process.wait(60) == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="takes a device that is full")
@pytest.mark.parametrize(
    ("program", "words", "unbuffered"),
    [("irsim", ["check", "scene.yaml", "none.yaml"], "1"), ("irtrack", ["list"], "")],
)
def test_standard_output_that_cannot_be_written(program: str, words: list[str], unbuffered: str, folder: Path) -> None:
    """Also after other errors; Python adds nothing at exit."""
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", program, *words],
            cwd=folder,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            check=False,
            env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
        )
    assert done.returncode == 2
    told = [line for line in done.stderr.splitlines() if not line.startswith("none.yaml: ")]
    assert told == [f"{program}: standard output: cannot be written: No space left on device"]


@pytest.mark.parametrize("program", ["irsim", "irtrack"])
def test_ctrl_c_during_import_is_one_line(
    program: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(importlib.import_module(f"{program}.cli.app"), "main", interrupted)
    with pytest.raises((SystemExit, KeyboardInterrupt)) as caught:
        importlib.import_module(f"{program}.__main__").main()
    assert isinstance(caught.value, SystemExit)
    assert caught.value.code == 130
    assert capsys.readouterr().err == f"{program}: stopped\n"


@pytest.mark.parametrize(("number", "jobs"), [(signal.SIGINT, "1"), (signal.SIGTERM, "2")])
def test_an_interrupted_render_leaves_no_files(number: signal.Signals, jobs: str, folder: Path) -> None:
    process = subprocess.Popen(
        [*IRSIM, "render", "scene.yaml", "-o", "long.mcap", "--frames", "1000000", "--jobs", jobs],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),  # under nohup the tests, too, ignore SIGHUP
    )
    begun = time.monotonic()
    while not list(folder.glob("*long.mcap*")):  # it has begun to write
        assert process.poll() is None
        assert time.monotonic() < begun + 60, "nothing was written"
        time.sleep(0.02)
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert errors == b"irsim: stopped\n"
    assert not list(folder.glob("*long.mcap*"))


@pytest.mark.parametrize("number", [signal.SIGTERM])
def test_interrupted_masks_are_counted(number: signal.Signals, folder: Path) -> None:
    """They stay, as they may have replaced older ones."""
    words = [*IRSIM, "masks", "scene.yaml", "frames=3000", "-o", "stopped"]
    process = subprocess.Popen(
        words,
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),
    )
    wait_until(lambda: process.poll() is not None or (folder / "stopped" / "000004_jet_whole.png").exists())
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    told = re.fullmatch(
        r"irsim: stopped; masks of (\d+) of 3000 frames are written to stopped, and the same command replaces them\n",
        errors,
    )
    assert told, errors
    done = int(told[1])
    whole = {f"{frame:06}_jet_{kind}.png" for frame in range(done) for kind in ("whole", "visible")}
    last = {f"{done:06}_jet_{kind}.png" for kind in ("whole", "visible")}
    assert whole <= set(os.listdir(folder / "stopped")) <= whole | last


@pytest.mark.slow
def test_own_kinds_of_a_recording_need_import(run: Run, folder: Path) -> None:
    (folder / "own_agc.py").write_text("from irsim.camera.agc import Plain\n\n\nclass Mine(Plain):\n    pass\n")
    (folder / "scene.yaml").write_text(SMALL_SCENE.replace("{size", "{agc: {kind: 'own_agc:Mine'}, size"))
    script = Path(sys.executable).with_name("irsim")

    def call(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([script, *words], cwd=folder, capture_output=True, text=True, timeout=60)

    assert call("render", "scene.yaml").returncode == 0
    refused = call("info", "scene.mcap")
    assert refused.returncode == 2
    assert "--import own_agc" in refused.stderr
    assert call("--import", "own_agc", "info", "scene.mcap").returncode == 0
    again = call("--import", "own_agc", "render", "scene.mcap", "-o", "again.mcap")
    assert again.returncode == 0, again.stderr
    wrong = run("--import", "nosuch_module", "info", "scene.mcap", cwd=folder)
    assert wrong.returncode == 2
    assert wrong.stderr.startswith("irsim: --import nosuch_module: cannot be imported: ModuleNotFoundError: ")


def test_own_kinds_in_the_current_folder(folder: Path) -> None:
    (folder / "mine.py").write_text(
        "from irsim.backgrounds import Sky\n\n\nclass Haze(Sky):\n    haze_k: float = 1.0\n"
    )
    (folder / "scene.yaml").write_text(SMALL_SCENE.replace("{kind: sky}", "{kind: 'mine:Haze', haze_k: 2}"))
    done = subprocess.run(
        [Path(sys.executable).with_name("irsim"), "check", "scene.yaml"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
    )
    assert (done.returncode, done.stdout) == (0, "scene.yaml: ok\n"), done.stderr
