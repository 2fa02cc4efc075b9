"""The commands of irsim, as a user gives them: output, exit status, one clear line for each thing wrong."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import Run

import irsim

TEXT = """\
seed: 3
frames: 6
camera: {size: [48, 32], noise: [{kind: white}]}
background: {kind: sky}
targets:
  - id: jet
    shape: {kind: point, temperature_k: 600}
    path: {kind: straight, start: [10, 16], speed: 2}
"""

COMMAND = [sys.executable, "-c", "from irsim.cli import main; main()"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "scene.yaml").write_text(TEXT)
    return tmp_path


def test_help_names_every_command(run: Run, folder: Path) -> None:
    done = run("--help", cwd=folder)
    assert done.returncode == 0
    for command in ("check", "show", "info", "render", "import"):
        assert f"\n  {command} " in done.stdout


def test_help_does_not_wait_for_heavy_modules(folder: Path) -> None:
    code = (
        "import sys; sys.argv = ['irsim', '--help']\n"
        "from irsim.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'cv2', 'pydantic', 'mcap', 'scipy', 'matplotlib', 'hypothesis', 'rich', 'yaml'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "[]"


def test_check_says_ok_or_what_is_wrong_of_each(run: Run, folder: Path) -> None:
    (folder / "bad.yaml").write_text(TEXT.replace("seed: 3", "sead: 3").replace("point", "pont"))
    done = run("check", "scene.yaml", "bad.yaml", "none.yaml", "sky", cwd=folder)
    assert done.returncode == 2
    assert done.stdout.splitlines() == ["scene.yaml: ok", "sky: ok"]
    lines = done.stderr.splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("bad.yaml:1:1: sead: unknown key; allowed: ")
    assert lines[0].endswith("did you mean 'seed'?")
    assert lines[1].startswith("bad.yaml:7:19: targets.jet.shape.kind: unknown shape kind 'pont'; ")
    assert lines[2] == "none.yaml: cannot read it: there is no such file"


def test_check_of_good_scenarios_is_status_0(run: Run, folder: Path) -> None:
    done = run("check", "scene.yaml", "sky", "ground", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")


def test_render_writes_the_frames_of_the_library(run: Run, folder: Path) -> None:
    done = run("render", "scene.yaml", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""  # no bar where standard error is no terminal
    assert done.stdout.splitlines()[0] == "scene.mcap"
    recording = irsim.open_recording(folder / "scene.mcap")
    expected = list(irsim.frames(irsim.load(folder / "scene.yaml")))
    assert len(recording) == len(expected) == 6
    for frame, (wanted, _) in zip(recording.frames(), expected, strict=True):
        assert np.array_equal(frame.image, wanted.image)
    assert recording.scenario_text is not None
    assert irsim.loads(recording.scenario_text) == irsim.load(folder / "scene.yaml")


def test_render_options_change_the_scenario(run: Run, folder: Path) -> None:
    done = run(
        *("render", "scene.yaml", "-o", "x.mcap", "--seed", "5", "--frames", "8", "--without", "white"),
        *("--jobs", "2", "camera.bits=12", "targets.jet.path.speed=1"),
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    text = irsim.open_recording(folder / "x.mcap").scenario_text
    overrides = ["seed=5", "frames=8", "without=[white]", "camera.bits=12", "targets.jet.path.speed=1"]
    assert text is not None
    assert irsim.loads(text) == irsim.load(folder / "scene.yaml", overrides)


def test_frames_n_and_frames_a_to_b(run: Run, folder: Path) -> None:
    assert run("render", "scene.yaml", "-o", "n.mcap", "--frames", "9", cwd=folder).returncode == 0
    assert run("render", "scene.yaml", "-o", "ab.mcap", "--frames", "4:9", cwd=folder).returncode == 0
    whole, part = (list(irsim.open_recording(folder / name).frames()) for name in ("n.mcap", "ab.mcap"))
    assert (len(whole), len(part)) == (9, 5)
    for frame, wanted in zip(part, whole[4:], strict=True):
        assert frame.time == wanted.time
        assert np.array_equal(frame.image, wanted.image)


def test_without_adds_to_what_the_scenario_has_off(run: Run, folder: Path) -> None:
    (folder / "off.yaml").write_text(TEXT + "without: [jet]\n")
    done = run("render", "off.yaml", "--without", "white", cwd=folder)
    assert done.returncode == 0, done.stderr
    text = irsim.open_recording(folder / "off.mcap").scenario_text
    assert text is not None
    assert irsim.loads(text).without == ("jet", "white")


def same_pictures(folder: Path, one: str, other: str) -> bool:
    first, second = (irsim.open_recording(folder / name) for name in (one, other))
    return list(first.truths()) == list(second.truths()) and all(
        a.time == b.time and np.array_equal(a.image, b.image)
        for a, b in zip(first.frames(), second.frames(), strict=True)
    )


@pytest.mark.parametrize("frames", ["6", "2:5"])
def test_a_recording_is_rendered_again_from_itself(run: Run, folder: Path, frames: str) -> None:
    assert run("render", "scene.yaml", "--seed", "7", "--frames", frames, cwd=folder).returncode == 0
    (folder / "scene.yaml").unlink()
    done = run("render", "scene.mcap", "-o", "again.mcap", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert same_pictures(folder, "scene.mcap", "again.mcap")
    first, again = (irsim.open_recording(folder / name).header for name in ("scene.mcap", "again.mcap"))
    assert again == first


def test_a_recording_is_rendered_again_with_changes(run: Run, folder: Path) -> None:
    run("render", "scene.yaml", "-o", "first.mcap", "--frames", "2:5", cwd=folder)
    run("render", "first.mcap", "-o", "a.mcap", "--frames", "1:4", "--seed", "9", "camera.netd_mk=90", cwd=folder)
    run("render", "scene.yaml", "-o", "b.mcap", "--frames", "3:6", "--seed", "9", "camera.netd_mk=90", cwd=folder)
    assert same_pictures(folder, "a.mcap", "b.mcap")
    run("render", "first.mcap", "-o", "c.mcap", "frames=9", cwd=folder)
    run("render", "scene.yaml", "-o", "d.mcap", "--frames", "2:9", cwd=folder)
    assert same_pictures(folder, "c.mcap", "d.mcap")


def test_a_recording_renders_no_code_that_it_names(run: Run, folder: Path) -> None:
    from recording_forge import forge

    (folder / "evil_scene.py").write_text("raise SystemExit('code of a file was run')")
    forge(folder / "r.mcap", scenario=b"background: {kind: 'evil_scene:X'}\n")
    done = run("render", "r.mcap", "-o", "x.mcap", cwd=folder)
    assert done.returncode == 2
    assert done.stderr.startswith("irsim: r.mcap: scenario:1:"), done.stderr
    assert "is not imported" in done.stderr
    assert "evil_scene" not in sys.modules


def test_info_says_what_is_in_a_recording(run: Run, folder: Path) -> None:
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
        f"hash       {irsim.open_recording(folder / 'scene.mcap').hash}",
    ):
        assert line in done.stdout.splitlines()


def test_info_says_of_a_scenario_what_it_says_of_its_recording(run: Run, folder: Path) -> None:
    run("render", "scene.yaml", cwd=folder)
    told = [run("info", name, cwd=folder).stdout.splitlines() for name in ("scene.yaml", "scene.mcap")]
    assert told[0][0] == "scenario   scene.yaml"
    assert any("px/frame, SCR" in line for line in told[0])
    assert told[0][1:-1] == told[1][1 : len(told[0]) - 1]  # the last is the hash: each has its own


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


@pytest.mark.parametrize(("agc", "kind"), [("clahe", "clahe"), ("{kind: plateau, time_constant_frames: 3}", "plateau")])
def test_import_says_how_frames_are_shown(run: Run, folder: Path, agc: str, kind: str) -> None:
    (folder / "few").mkdir()
    for index in range(2):
        cv2.imwrite(str(folder / "few" / f"{index}.png"), np.full((20, 20), 100 + index, np.uint8))
    done = run("import", "few", "--agc", agc, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert irsim.open_recording(folder / "few.mcap").header.agc.kind == kind


@pytest.mark.parametrize("ending", ["webm", "gif"])
def test_show_writes_moving_pictures(run: Run, folder: Path, ending: str) -> None:
    done = run("show", "scene.yaml", "-o", f"moving.{ending}", "--frames", "1:3", cwd=folder)
    assert (done.returncode, done.stdout) == (0, f"moving.{ending}\n"), done.stderr
    assert done.stderr == ""
    capture = cv2.VideoCapture(str(folder / f"moving.{ending}"))
    assert [capture.read()[0] for _ in range(3)] == [True, True, False]


def test_show_takes_changes_and_a_seed(run: Run, folder: Path) -> None:
    def picture(*words: str) -> bytes:
        done = run("show", "scene.yaml", *words, "-o", "sheet.png", cwd=folder)
        assert done.returncode == 0, done.stderr
        return (folder / "sheet.png").read_bytes()

    assert picture() == picture("--seed", "3") == picture("targets.jet.path.speed=2.0")
    assert len({picture(), picture("--seed", "4"), picture("targets.jet.path.speed=4")}) == 3


def test_info_says_what_is_damaged(run: Run, folder: Path) -> None:
    path = folder / "scene.mcap"
    irsim.record(irsim.Rendering(irsim.loads(TEXT)), path)
    whole = path.read_bytes()
    image = irsim.open_recording(path).frame(3).image.astype("<u2").tobytes()
    at = whole.index(image) + 100
    path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
    done = run("info", "scene.mcap", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines() == [
        "irsim: scene.mcap: damaged: frames 2 to 3; irsim import scene.mcap -o NEW.mcap keeps what is whole"
    ]


def test_import_makes_a_recording_of_pictures(run: Run, folder: Path) -> None:
    (folder / "clip").mkdir()
    for index in range(3):
        cv2.imwrite(str(folder / "clip" / f"{index}.png"), np.full((16, 20), 10 * index, np.uint8))
    (folder / "boxes.csv").write_text("frame,x,y,w,h\n0,1,2,5,5\n2,3,4,5,5\n")
    done = run("import", "clip", "--truth", "boxes.csv", "--rate", "25", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0] == "clip.mcap"
    recording = irsim.open_recording(folder / "clip.mcap")
    assert [int(frame.image[0, 0]) for frame in recording.frames()] == [0, 10, 20]
    assert recording.rate_hz == 25
    assert [len(truth.targets) for truth in recording.truths()] == [1, 0, 1]
    assert done.stderr == ""


def test_import_tells_what_it_assumed_and_whom_it_renamed(run: Run, folder: Path) -> None:
    (folder / "clip").mkdir()
    cv2.imwrite(str(folder / "clip" / "0.png"), np.zeros((16, 20), np.uint8))
    (folder / "boxes.csv").write_text("frame,x,y,w,h,id\n0,1,2,5,5,7\n0,9,9,5,5,8\n")
    done = run("import", "clip", "--truth", "boxes.csv", "--follow", "8", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines() == [
        "irsim: note: no rate was given: 30 Hz assumed",
        "irsim: note: id '7' is called target-7",
        "irsim: note: id '8' is called target-8",
    ]
    facts = run("info", "clip.mcap", cwd=folder).stdout.splitlines()
    assert "follow     target-8" in facts
    assert "topic      /ir/image: 1 message" in facts
    assert "target     target-7: 1 frame from 0 on" in facts


def test_import_of_deep_pictures_and_loose_boxes(run: Run, folder: Path) -> None:
    (folder / "clip").mkdir()
    cv2.imwrite(str(folder / "clip" / "0.png"), np.full((16, 20), 4095, np.uint16))
    (folder / "boxes.csv").write_text("frame,x,y,w,h\n0,1,2,5,5\n")
    done = run("import", "clip", "--truth", "boxes.csv", "--bits", "12", "--accuracy", "2.5", cwd=folder)
    assert done.returncode == 0, done.stderr
    recording = irsim.open_recording(folder / "clip.mcap")
    assert (recording.bits, recording.header.accuracy_px) == (12, 2.5)


BAD = {
    "no such scenario": (["render", "nosuch"], "irsim: nosuch: there is no such file and no shipped scenario"),
    "broken scenario": (["render", "broken.yaml"], "irsim: broken.yaml:1:9: seed: expected a whole number, not 'x'; "),
    "wrong override": (["render", "scene.yaml", "camera.bitz=3"], "irsim: override camera.bitz: unknown key 'bitz'; "),
    "no override": (["render", "scene.yaml", "camera"], "irsim: override 'camera': this is no KEY=VALUE; "),
    "unknown part": (["render", "scene.yaml", "--without", "x"], "irsim: override without: without.0: there is no 'x'"),
    "no frames": (["render", "scene.yaml", "--frames", "0"], "irsim: --frames 0: no such range; allowed: "),
    "frames backwards": (["render", "scene.yaml", "--frames", "5:5"], "irsim: --frames 5:5: no such range; allowed: "),
    "frames in words": (["render", "scene.yaml", "--frames", "all"], "irsim: --frames all: no such range; allowed: "),
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
    "import onto the truth": (
        ["import", "clip", "--truth", "boxes.csv", "-o", "boxes.csv"],
        "irsim: boxes.csv: would replace boxes.csv, ",
    ),
    "unknown AGC": (
        ["import", "clip", "-o", "x.mcap", "--agc", "platau"],
        "irsim: import: agc.kind: unknown agc kind 'platau'; allowed: ",
    ),
    "AGC with a wrong key": (
        ["import", "clip", "-o", "x.mcap", "--agc", "{kind: clahe, tails: [0, 0]}"],
        "irsim: import: agc.tails: unknown key; allowed: ",
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
    "accuracy of no truth": (["import", "clip", "--accuracy", "2"], "irsim: clip: an accuracy is that of the truth; "),
    "too many bits": (["import", "clip", "--bits", "17"], "irsim: clip/0.png: 17 bits do not fit; allowed: 1 to 8"),
    "bits of a recording": (
        ["import", "good.mcap", "-o", "x.mcap", "--bits", "12"],
        "irsim: good.mcap: is a recording and is kept as it is; allowed: no bits",
    ),
    "no such recording": (["info", "none.mcap"], "irsim: none.mcap: there is no such file"),
    "foreign recording": (["info", "forged.mcap"], "irsim: forged.mcap: is not an MCAP file"),
    "recording to check": (["check", "good.mcap"], "good.mcap: is a recording, no YAML; irsim info tells"),
    "empty recording": (["info", "empty.mcap"], "irsim: empty.mcap: "),
    "cut recording": (["info", "cut.mcap"], "irsim: cut.mcap: "),
    "nothing to show": (["show", "none.mcap"], "irsim: none.mcap: there is no such file"),
    "no folder to show to": (["show", "scene.yaml", "-o", "no/x.png"], "irsim: no/x.png: the folder no does not exist"),
    "unknown kind of picture": (
        ["show", "scene.yaml", "-o", "x.mp4"],
        "irsim: x.mp4: allowed: a name that ends in .png or .webm or .gif",
    ),
    "unknown kind of recording": (
        ["render", "scene.yaml", "-o", "x.avi"],
        "irsim: x.avi: allowed: a name that ends in .mcap",
    ),
    "import into no recording": (["import", "clip", "-o", "clip.bag"], "irsim: clip.bag: allowed: a name that ends in"),
    "fit into no scenario": (["fit", "good.mcap", "-o", "x.json"], "irsim: x.json: allowed: a name that ends in .yaml"),
    "new scenario of no kind": (["new", "sky", "-o", "x.txt"], "irsim: x.txt: allowed: a name that ends in .yaml"),
    "schema into no JSON": (["schema", "-o", "x.yaml"], "irsim: x.yaml: allowed: a name that ends in .json"),
    "gallery into no picture": (["gallery", "-o", "x.jpg"], "irsim: x.jpg: allowed: a name that ends in .png"),
    "override of a recording": (
        ["show", "good.mcap", "camera.bits=8"],
        "irsim: camera.bits=8: overrides are for scenarios; good.mcap cannot be changed",
    ),
    "seed of a recording": (["show", "good.mcap", "--seed", "1"], "irsim: good.mcap: a recording has no seed; "),
    "no such frames to show": (
        ["show", "scene.yaml", "--frames", "2:2000"],
        "irsim: --frames 2:2000: scene.yaml has ",
    ),
    "nothing to import": (["import", "none"], "irsim: none: "),
    "empty folder": (["import", "dir"], "irsim: dir: "),
    "import onto itself": (
        ["import", "good.mcap"],
        "irsim: good.mcap: would replace good.mcap, ",
    ),
}


@pytest.fixture(scope="module")
def messy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("messy")
    (folder / "scene.yaml").write_text(TEXT)
    (folder / "broken.yaml").write_text(TEXT.replace("seed: 3", "seed:   x"))
    (folder / "dir").mkdir()
    irsim.record(irsim.Rendering(irsim.loads(TEXT)), folder / "good.mcap")
    (folder / "clip").mkdir()
    cv2.imwrite(str(folder / "clip" / "0.png"), np.zeros((8, 8), np.uint8))
    irsim.import_frames(folder / "clip", folder / "imported.mcap")
    (folder / "boxes.csv").write_text("frame,x,y,w,h\n0,1,2,5,5\n")
    (folder / "empty.mcap").write_bytes(b"")
    (folder / "forged.mcap").write_text("a text")
    (folder / "cut.mcap").write_bytes((folder / "good.mcap").read_bytes()[:2000])
    return folder


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_status_2(run: Run, messy: Path, case: str) -> None:
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
    "nothing to check": (["check"], "irsim: SCENARIO: is missing; see irsim check --help"),
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


def test_the_command_alone_shows_its_help(run: Run, folder: Path) -> None:
    done = run(cwd=folder)
    assert done.returncode == 2
    assert "Commands:" in done.stderr


@pytest.mark.parametrize("name", ["irsim", "irtrack"])
def test_both_commands_say_their_version(folder: Path, name: str) -> None:
    script = Path(sys.executable).with_name(name)
    done = subprocess.run([script, "--version"], cwd=folder, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, f"{name} {irsim.__version__}\n")


def test_a_terminal_of_few_letters_gets_what_it_knows(folder: Path) -> None:
    (folder / "sc\u00e9ne.yaml").write_text(TEXT)
    done = subprocess.run(
        [*COMMAND, "check", "sc\u00e9ne.yaml"],
        cwd=folder,
        capture_output=True,
        timeout=60,
        env={**os.environ, "LC_ALL": "C", "PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(b"sc?")


def test_a_reader_that_leaves_is_no_error_to_tell(messy: Path) -> None:
    process = subprocess.Popen(
        [*COMMAND, "check", *["scene.yaml"] * 3], cwd=messy, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    assert process.stderr.read() == b""
    assert process.wait(60) == 1


def test_interrupted_it_leaves_nothing_behind(messy: Path) -> None:
    process = subprocess.Popen(
        [*COMMAND, "render", "scene.yaml", "-o", "long.mcap", "--frames", "1000000"],
        cwd=messy,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    begun = time.monotonic()
    while not list(messy.glob("*long.mcap*")):  # it has begun to write
        assert process.poll() is None
        assert time.monotonic() < begun + 60, "waited in vain"
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"Traceback" not in errors
    assert not list(messy.glob("*long.mcap*"))


def test_what_a_recording_names_is_known_where_the_user_imports_it(run: Run, folder: Path) -> None:
    (folder / "own_agc.py").write_text("from irsim.display import Plain\n\n\nclass Mine(Plain):\n    pass\n")
    (folder / "scene.yaml").write_text(TEXT.replace("{size", "{agc: {kind: 'own_agc:Mine'}, size"))
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


def test_a_kind_of_the_users_own_lies_where_the_command_is_given(folder: Path) -> None:
    (folder / "mine.py").write_text(
        "from irsim.backgrounds import Sky\n\n\nclass Haze(Sky):\n    haze_k: float = 1.0\n"
    )
    (folder / "scene.yaml").write_text(TEXT.replace("{kind: sky}", "{kind: 'mine:Haze', haze_k: 2}"))
    done = subprocess.run(
        [Path(sys.executable).with_name("irsim"), "check", "scene.yaml"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
    )
    assert (done.returncode, done.stdout) == (0, "scene.yaml: ok\n"), done.stderr
