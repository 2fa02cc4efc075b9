"""The commands check, info and show of irsim, and --help."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import SMALL_SCENE, Run

import irsim


def test_help_imports_no_slow_modules(folder: Path) -> None:
    code = (
        "import sys; sys.argv = ['irsim', '--help']\n"
        "from irsim.cli.app import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'cv2', 'pydantic', 'mcap', 'scipy', 'matplotlib', 'hypothesis', 'rich', 'yaml'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "[]"
    for command in ("check", "show", "info", "render", "import"):
        assert f"\n  {command} " in done.stdout


def test_check_prints_ok_or_errors_of_each_scenario(run: Run, folder: Path) -> None:
    (folder / "bad.yaml").write_text(SMALL_SCENE.replace("seed: 3", "sead: 3").replace("point", "pont"))
    done = run("check", "scene.yaml", "bad.yaml", "none.yaml", "sky", cwd=folder)
    assert done.returncode == 2
    assert done.stdout.splitlines() == ["scene.yaml: ok", "sky: ok"]
    lines = done.stderr.splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("bad.yaml:1:1: sead: unknown key; allowed: ")
    assert lines[0].endswith("did you mean 'seed'?")
    assert lines[1].startswith("bad.yaml:7:19: targets.jet.shape.kind: unknown shape kind 'pont'; ")
    assert lines[2] == "none.yaml: cannot read it: there is no such file"


def test_check_applies_overrides_to_all_scenarios(run: Run, folder: Path) -> None:
    done = run("check", "scene.yaml", "camera.netd_mk=-1", "sky", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    told = "override camera.netd_mk: -1 is out of range; allowed: a number, from 0 to 10000"
    assert done.stderr.splitlines() == [f"scene.yaml: {told}", f"sky: {told}"]
    assert run("check", "scene.yaml", "camera.netd_mk=1", cwd=folder).stdout == "scene.yaml: ok\n"


def test_info_of_a_recording(run: Run, folder: Path) -> None:
    run("render", "scene.yaml", cwd=folder)
    done = run("info", "scene.mcap", cwd=folder)
    assert done.returncode == 0
    for line in (
        "recording  scene.mcap",
        "frames     6 at 30 Hz, 0.2 s",
        "picture    48x32 px, 14 bits",
        "truth      exact",
        "target     jet (point): 6 frames from 0 on",
        "follow     jet",
        "topic      /ir/image: 6 messages",
        "scenario   attached",
        f"file hash  {irsim.open_recording(folder / 'scene.mcap').hash}",
    ):
        assert line in done.stdout.splitlines()


def test_info_of_a_scenario_equals_that_of_its_recording(run: Run, folder: Path) -> None:
    run("render", "scene.yaml", cwd=folder)
    told = [run("info", name, cwd=folder).stdout.splitlines() for name in ("scene.yaml", "scene.mcap")]
    assert told[0][0] == "scenario   scene.yaml"
    assert any("px/frame, SCR" in line for line in told[0])
    assert told[0][1:-2] == told[1][1 : len(told[0]) - 2]
    scene_hash = f"scene hash {irsim.load(folder / 'scene.yaml').hash}"
    assert told[0][-2] == scene_hash
    assert told[1][len(told[0]) - 2].startswith(f"{scene_hash} ")
    assert told[0][-1] == f"names      {', '.join(name for name, _ in irsim.load(folder / 'scene.yaml').names())}"


@pytest.mark.parametrize("source", ["scene.yaml", "scene.mcap"])
def test_show_draws_a_picture(run: Run, folder: Path, source: str) -> None:
    if source.endswith("mcap"):
        run("render", "scene.yaml", cwd=folder)
    done = run("show", source, "-o", "sheet.png", cwd=folder)
    assert (done.returncode, done.stdout) == (0, "sheet.png\n"), done.stderr
    picture = cv2.imread(str(folder / "sheet.png"))
    assert picture is not None
    # The truth boxes are its only colour (#ffb000, as B, G, R).
    assert np.any(np.all(picture == (0x00, 0xB0, 0xFF), axis=-1))


@pytest.mark.parametrize("ending", ["webm", "gif"])
def test_show_writes_videos(run: Run, folder: Path, ending: str) -> None:
    done = run("show", "scene.yaml", "-o", f"moving.{ending}", "--frames", "1:3", cwd=folder)
    assert (done.returncode, done.stdout) == (0, f"moving.{ending}\n"), done.stderr
    assert done.stderr == ""
    capture = cv2.VideoCapture(str(folder / f"moving.{ending}"))
    assert [capture.read()[0] for _ in range(3)] == [True, True, False]


def test_info_reports_damage(run: Run, folder: Path) -> None:
    path = folder / "scene.mcap"
    irsim.record(irsim.Rendering(irsim.loads(SMALL_SCENE)), path)
    whole = path.read_bytes()
    image = irsim.open_recording(path).frame(3).image.astype("<u2").tobytes()
    at = whole.index(image) + 100
    path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
    done = run("info", "scene.mcap", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines() == [
        "irsim: scene.mcap: damaged: frames 2 to 3; irsim import scene.mcap -o NEW.mcap keeps what is whole"
    ]


@pytest.mark.parametrize("name", ["irsim", "irtrack"])
def test_both_commands_print_their_version(folder: Path, name: str) -> None:
    script = Path(sys.executable).with_name(name)
    done = subprocess.run([script, "--version"], cwd=folder, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, f"{name} {irsim.__version__}\n")
