"""Wrong input to irsim: one line, status 2, and no files written."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
import typer
from command_line import SMALL_SCENE, Run

import irsim
from irsim.cli.terminal import run as run_app

BAD = {
    "no such scenario": (["render", "nosuch"], "irsim: nosuch: there is no such file and no shipped scenario"),
    "broken scenario": (["render", "broken.yaml"], "irsim: broken.yaml:1:9: seed: expected a whole number, not 'x'; "),
    "a suite": (["check", "a-suite.yaml"], "a-suite.yaml:1:1: has the keys of a suite, not of a scenario; allowed: "),
    "no scenario": (["check", "camera.netd_mk=1"], "irsim: camera.netd_mk=1: no scenario to override; allowed: "),
    "wrong override": (["render", "scene.yaml", "camera.bitz=3"], "irsim: override camera.bitz: unknown key 'bitz'; "),
    "no override": (["render", "scene.yaml", "camera"], "irsim: override 'camera': not KEY=VALUE; "),
    "unknown part": (["render", "scene.yaml", "--without", "x"], "irsim: override without: without.0: there is no 'x'"),
    "no frames": (["render", "scene.yaml", "--frames", "0"], "irsim: --frames 0: no such range; allowed: "),
    "seed below 0": (["render", "scene.yaml", "--seed", "-1"], "irsim: override seed: -1 is out of range; allowed: "),
    "no output folder": (["render", "scene.yaml", "-o", "no/x.mcap"], "irsim: no/x.mcap: the folder no does not exist"),
    "no name": (["info", ""], "irsim: '': the name is empty; allowed: a file, or a shipped scenario's name"),
    "output is a folder": (["render", "scene.yaml", "-o", "dir"], "irsim: dir: is a folder"),
    "imported recording to render": (
        ["render", "imported.mcap", "-o", "x.mcap"],
        "irsim: imported.mcap: holds no scenario, its frames were imported; allowed: ",
    ),
    "render onto its scenario": (
        ["render", "scene.yaml", "-o", "scene.yaml"],
        "irsim: scene.yaml: would replace scene.yaml, ",
    ),
    "show onto its recording": (
        ["show", "good.mcap", "-o", "good.mcap"],
        "irsim: good.mcap: would replace good.mcap, ",
    ),
    "import onto a frame": (
        ["import", "clip", "-o", "clip/0.png"],
        "irsim: clip/0.png: would replace clip, ",
    ),
    "an empty name to switch off": (
        ["render", "scene.yaml", "--without", "white,,jet"],
        "irsim: --without 'white,,jet': a name is empty; allowed: ",
    ),
    "no class": (["realism", "good.mcap", "--like", "x"], "irsim: --like 'x': no such class; allowed: cloud, "),
    "no sort": (["realism", "good.mcap", "--camera", "x"], "irsim: --camera 'x': no such sort of camera; allowed: "),
    "no region": (["noise", "good.mcap", "--region", "1,2"], "irsim: --region '1,2': is no region; allowed: x,y,w,h"),
    "masks of nobody": (["masks", "scene.yaml", "--target", "x"], "irsim: --target 'x': there is no such target; "),
    "unknown AGC": (
        ["import", "clip", "-o", "x.mcap", "--agc", "platau"],
        "irsim: import: agc.kind: unknown agc kind 'platau'; allowed: ",
    ),
    "AGC that is no YAML": (["import", "clip", "-o", "x.mcap", "--agc", "{kind: ["], "irsim: --agc: "),
    "nobody to follow": (
        ["import", "clip", "--truth", "boxes.csv", "--follow", "x", "-o", "x.mcap"],
        "irsim: boxes.csv: there is no target 'x'; allowed: target",
    ),
    "render onto itself": (
        ["render", "good.mcap"],
        "irsim: good.mcap: would replace good.mcap, ",
    ),
    "accuracy of no truth": (["import", "clip", "--accuracy", "2"], "irsim: clip: accuracy describes ground truth; "),
    "too many bits": (["import", "clip", "--bits", "17"], "irsim: clip/0.png: 17 bits do not fit; allowed: 1 to 8"),
    "no such recording": (["info", "none.mcap"], "irsim: none.mcap: there is no such file"),
    "foreign recording": (["info", "forged.mcap"], "irsim: forged.mcap: is not an MCAP file"),
    "recording to check": (["check", "good.mcap"], "good.mcap: is a recording, not YAML; irsim info"),
    "empty recording": (["info", "empty.mcap"], "irsim: empty.mcap: "),
    "cut recording": (["info", "cut.mcap"], "irsim: cut.mcap: "),
    "unknown kind of picture": (
        ["show", "scene.yaml", "-o", "x.mp4"],
        "irsim: x.mp4: allowed: a name that ends in .png or .webm or .gif",
    ),
    "fit into no scenario": (["fit", "good.mcap", "-o", "x.json"], "irsim: x.json: allowed: a name that ends in .yaml"),
    "schema into no JSON": (["schema", "-o", "x.yaml"], "irsim: x.yaml: allowed: a name that ends in .json"),
    "gallery into no picture": (["gallery", "-o", "x.jpg"], "irsim: x.jpg: allowed: a name that ends in .png"),
    "override of a recording": (
        ["show", "good.mcap", "camera.bits=8"],
        "irsim: camera.bits=8: overrides are for scenarios; good.mcap cannot be changed",
    ),
    "parts of a recording": (
        ["info", "good.mcap", "--without", "white"],
        "irsim: without=white: parts are switched off in scenarios; good.mcap cannot be changed",
    ),
    "seed of a recording": (["show", "good.mcap", "--seed", "1"], "irsim: good.mcap: a recording has no seed; "),
    **{
        f"frames past the end to {command}": (
            [command, source, "--frames", "2:2000"],
            "irsim: --frames 2:2000: no such range; allowed: N above 0, or A:B with A below B, within 0:6",
        )
        for command, source in (*(("show", "scene.yaml"), ("masks", "good.mcap"), ("noise", "good.mcap")),)
    },
    "a device for a source": (
        ["info", "device"],
        "irsim: device: is no regular file; allowed: a file, or a shell's <(",
    ),
    **{
        f"a pipe for what {command} reads": (
            [command, "pipe.yaml"],
            f"{'' if command == 'check' else 'irsim: '}pipe.yaml: is no regular file; allowed: a file, or a shell's <(",
        )
        for command in ("check", "info", "sample", "fit")
    },
    "a pipe for a recording": (["info", "pipe.mcap"], "irsim: pipe.mcap: is no regular file; allowed: a recording"),
    "a pipe for a video": (["import", "pipe.yaml", "-o", "x.mcap"], "irsim: pipe.yaml: is no regular file; allowed: a"),
    "a pipe among pictures": (["import", "pipes", "-o", "x.mcap"], "irsim: pipes/0.png: is no regular file; allowed: "),
    "import onto itself": (
        ["import", "good.mcap"],
        "irsim: good.mcap: would replace good.mcap, ",
    ),
}


@pytest.fixture(scope="module")
def messy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("messy")
    (folder / "scene.yaml").write_text(SMALL_SCENE)
    (folder / "a-suite.yaml").write_text("sources: [sky]\ntrackers: [kalman]\n")
    (folder / "broken.yaml").write_text(SMALL_SCENE.replace("seed: 3", "seed:   x"))
    (folder / "dir").mkdir()
    irsim.record(irsim.Rendering(irsim.loads(SMALL_SCENE)), folder / "good.mcap")
    (folder / "clip").mkdir()
    cv2.imwrite(str(folder / "clip" / "0.png"), np.zeros((8, 8), np.uint8))
    irsim.import_frames(folder / "clip", folder / "imported.mcap")
    (folder / "boxes.csv").write_text("frame,x,y,w,h\n0,1,2,5,5\n")
    (folder / "empty.mcap").write_bytes(b"")
    (folder / "forged.mcap").write_text("a text")
    (folder / "device").symlink_to(os.devnull)
    (folder / "pipes").mkdir()
    for name in ("pipe.yaml", "pipe.mcap", "pipes/0.png"):
        os.mkfifo(folder / name)
    (folder / "cut.mcap").write_bytes((folder / "good.mcap").read_bytes()[:2000])
    return folder


@pytest.mark.parametrize("case", BAD)
def test_wrong_input_is_one_line_and_status_2(run: Run, messy: Path, case: str) -> None:
    arguments, expected = BAD[case]
    before = sorted(messy.iterdir())
    done = run(*arguments, cwd=messy)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith(expected), done.stderr
    assert sorted(messy.iterdir()) == before


WRONG_USAGE = {
    "nothing to render": (["render"], "irsim: SCENARIO|REC: is missing; see irsim render --help"),
    "nothing to check": (["check"], "irsim: SCENARIO|KEY=VALUE: is missing; see irsim check --help"),
    "nothing to begin from": (
        ["new"],
        "irsim: KIND: is missing; allowed: sky, ground, sea, landscape, recording (yours), severities or vary; "
        "see irsim new --help",
    ),
    "no jobs": (["render", "scene.yaml", "--jobs", "0"], "irsim: --jobs: must be 1 or more, not 0"),
    "part of a job": (["render", "scene.yaml", "--jobs", "1.5"], "irsim: --jobs: must be a whole number, not 1.5"),
    "rate in words": (["import", "clip", "--rate", "abc"], "irsim: --rate: must be a number, not abc"),
    "option of no value": (["render", "scene.yaml", "--seed"], "irsim: --seed: requires an argument"),
    "misspelt option": (["render", "scene.yaml", "--sed", "1"], "irsim: --sed: no such option; did you mean '--seed'?"),
    "unknown option": (["--foo", "check"], "irsim: --foo: no such option; see irsim --help"),
    "unknown command": (["paint"], "irsim: no such command 'paint'; see irsim --help"),
}


@pytest.mark.parametrize("case", WRONG_USAGE)
def test_wrong_usage_is_one_line_and_status_2(run: Run, messy: Path, case: str) -> None:
    arguments, expected = WRONG_USAGE[case]
    done = run(*arguments, cwd=messy)
    assert (done.returncode, done.stdout, done.stderr.splitlines()) == (2, "", [expected])


def test_out_of_memory_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.argv", ["irsim"])
    app = typer.Typer()

    @app.command()
    def hold() -> None:
        raise MemoryError("Unable to allocate 839. MiB")

    with pytest.raises(SystemExit) as caught:
        run_app(app, "irsim")
    assert caught.value.code == 2
    assert capsys.readouterr().err == (
        "irsim: out of memory: Unable to allocate 839. MiB; allowed: fewer or smaller frames\n"
    )
