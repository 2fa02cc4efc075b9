"""The command line of irtrack: what it prints, its exit status, and what it says of bad input."""

from __future__ import annotations

import csv
import html
import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import irsim
from irsim.render import Renderer
from irtrack import Results
from irtrack.cli import main
from irtrack.trackers import TRACKERS

SCENE = """
seed: 3
frames: 20
camera: {size: [96, 72], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [30, 36], speed: 1, range_m: 3000}}
  - {id: bird, shape: {kind: point, temperature_k: 400}, path: {kind: straight, start: [60, 20], range_m: 3000}}
"""
MINE = """
from irtrack.types import Estimate

class Broken:
    resumable = True
    def init(self, frame, box, rng):
        return box
    def step(self, state, frame, rng):
        raise ValueError("planted")

class Careless(Broken):
    what = "none"
    def step(self, state, frame, rng):
        print("seen", frame.index)
        if self.what == "leave":
            raise SystemExit(3)
        if self.what == "command":
            raise ValueError("\\x1b[31m<b>red\\x9b0m \\x07\\u202e \\x00 \\udc9b")
        if self.what == "write":
            frame.image[0, 0] = 1
        return {"none": None, "pair": (state.cx, state.cy), "good": (state, Estimate((9, 9), (5, 5)))}[self.what]
    def __init__(self, what="none"):
        self.what = what

class Typed(Broken):
    def __init__(self, reach: int = 3):
        self.reach = reach

class Reaching(Broken):
    def __init__(self, reach=1.0):
        self.reach = reach
    def step(self, state, frame, rng):
        return state, Estimate((state.cx, state.cy), (state.w, state.h))
"""


@dataclass(frozen=True)
class Answer:
    status: int
    out: str
    err: str


Call = Callable[..., Answer]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cli")
    (folder / "scene.yaml").write_text(SCENE)
    irsim.record(irsim.open_source(folder / "scene.yaml"), folder / "clip.mcap")
    (folder / "cut.mcap").write_bytes((folder / "clip.mcap").read_bytes()[:5000])
    (folder / "empty.mcap").write_bytes(b"")
    (folder / "mine.py").write_text(MINE)
    return folder


@pytest.fixture
def call(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    """Runs the command in a folder that holds what `made` holds."""
    for file in made.iterdir():
        (tmp_path / file.name).symlink_to(file)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))

    def run(*words: str) -> Answer:
        monkeypatch.setattr(sys, "argv", ["irtrack", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        status = ended.value.code
        return Answer(status if isinstance(status, int) else int(status is not None), out, err)

    return run


def test_list_names_every_tracker(call: Call) -> None:
    answer = call("list")
    assert answer.status == 0
    assert {line.split()[0] for line in answer.out.splitlines() if line[0] != " "} >= set(TRACKERS)
    rows = json.loads(call("list", "--json").out)
    assert {row["name"] for row in rows} >= set(TRACKERS)


def test_a_source_may_be_given_a_label(call: Call, tmp_path: Path) -> None:
    answer = call("bench", "clip.mcap", "AGAIN=clip.mcap", "--trackers", "kalman", "--seeds", "1", "--results", "a.db")
    assert answer.status == 0, answer.err
    assert [line.split()[0] for line in answer.out.splitlines()[1:3]] == ["AGAIN", "clip"]
    assert call("report", "a.db", "-o", "a.html").status == 0


def test_run_prints_scores_and_a_command_that_repeats_them(call: Call) -> None:
    first = call("run", "grey_pf", "scene.yaml", "particles=30")
    assert (first.status, first.err) == (0, "")
    lines = first.out.splitlines()
    assert lines[0] == "grey_pf on scene: jet, frames 0 to 19, seed 3"  # the scenario's own seed
    assert lines[-1] == "repeat it: irtrack run grey_pf scene.yaml particles=30 --seed 3"
    again = call(*lines[-1].removeprefix("repeat it: irtrack ").split())
    assert [line for line in again.out.splitlines() if not line.startswith("time")][:-1] == [
        line for line in lines if not line.startswith("time")
    ][:-1]


def test_run_as_json_is_one_document(call: Call) -> None:
    answer = call(
        "run", "grey_pf", "scene.yaml", "particles=30", "frames=8", "--target", "bird", "--json", "--seed", "5"
    )
    assert (answer.status, answer.err) == (0, "")
    value = json.loads(answer.out)
    assert len(value["frames"]) == 8  # the scenario's key
    assert value["config"]["parameters"]["particles"] == 30  # the tracker's
    assert (value["target"], value["scene_seed"], value["tracker_seed"]) == ("bird", 5, 5)
    assert value["score"]["frames"] == 7  # the start frame is not scored
    assert value["repeat"].startswith("irtrack run grey_pf scene.yaml particles=30")


def test_run_of_a_recording_equals_run_of_its_scene(call: Call) -> None:
    scene = json.loads(call("run", "kalman", "scene.yaml", "--json").out)
    clip = json.loads(call("run", "kalman", "clip.mcap", "--json", "--seed", "3").out)
    assert clip["scene_seed"] is None
    for one, other in zip(scene["frames"], clip["frames"], strict=True):
        assert {**one, "ms": 0} == {**other, "ms": 0}


def test_run_writes_the_track(call: Call, tmp_path: Path) -> None:
    answer = call("run", "grey_pf", "clip.mcap", "-o", "track.mcap", "--csv", "track.csv", "--json")
    assert answer.status == 0
    frames = json.loads(answer.out)["frames"]
    track = irsim.read_tracks(tmp_path / "track.mcap")
    assert (track.header.tracker, track.header.target, track.header.source) == ("grey_pf", "jet", "clip")
    assert [state.box.cx for state in track.states] == [row["cx"] for row in frames]
    assert [state.status for state in track.states] == [row["status"] for row in frames]
    assert [state.neff for state in track.states] == [row["neff"] for row in frames]
    assert track.states[1].covariance is not None
    with (tmp_path / "track.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["cx"]) for row in rows] == [row["cx"] for row in frames]


def test_a_run_draws_each_scene_once(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[int] = []
    plain = Renderer.scene

    def counted(self: Renderer, index: int) -> Any:
        drawn.append(index)
        return plain(self, index)

    monkeypatch.setattr(Renderer, "scene", counted)
    assert call("run", "kalman", "scene.yaml", "--json").status == 0
    assert drawn[:2] == [0, 0]  # to find the start; then the frames with their truth
    assert drawn[1:] == list(range(20))


def test_a_parameter_of_infinity_is_still_one_document(call: Call) -> None:
    answer = call("run", "mine:Reaching", "clip.mcap", "reach=.inf", "--json")
    assert (answer.status, answer.err) == (0, "")
    assert json.loads(answer.out)["config"]["parameters"] == {"reach": ".inf"}


def test_run_from_a_given_box_has_no_scores(call: Call) -> None:
    answer = call("run", "template", "clip.mcap", "--init", "25,32,12,8@4")
    assert answer.status == 0
    assert "a given box, frames 4 to 19" in answer.out
    assert "no scores: a box was given, and truth does not know whose; --target ID says whose" in answer.out
    named = call("run", "template", "clip.mcap", "--init", "25,32,12,8@4", "--target", "jet")
    assert "rmse" in named.out
    last = call("run", "template", "clip.mcap", "--init", "25,32,12,8@19", "--target", "jet")
    assert "no scores: there is no frame after the start" in last.out
    value = json.loads(call("run", "template", "clip.mcap", "--init", "25,32,12,8@4", "--json").out)
    assert value["start"] == {"frame": 4, "cx": 30.5, "cy": 35.5, "w": 12, "h": 8}
    assert value["score"]["rmse"] is None


def test_bench_and_report(call: Call, tmp_path: Path) -> None:
    words = ("bench", "scene.yaml", "clip.mcap", "--trackers", "grey_pf,few=grey_pf:particles=20", "--seeds", "2")
    answer = call(*words)
    assert (answer.status, answer.err) == (0, "")
    table = [line.split()[:4] for line in answer.out.splitlines()[1:5]]
    assert sorted((row[0], row[2], row[3]) for row in table) == [
        (source, label, "2") for source in ("clip", "scene") for label in ("few", "grey_pf")
    ]
    assert answer.out.splitlines()[-1] == "results: irtrack.db    next: irtrack report irtrack.db"
    value = json.loads(call(*words, "--json").out)
    assert value["results"] == "irtrack.db"
    assert {(row["source"], row["label"], row["runs"]) for row in value["rows"]} == {
        (source, label, 2) for source in ("clip", "scene") for label in ("few", "grey_pf")
    }
    # Only what was asked for now, however much the file holds.
    part = json.loads(call("bench", "clip.mcap", "--trackers", "grey_pf", "--seeds", "1", "--json").out)
    assert [(row["source"], row["label"], row["runs"]) for row in part["rows"]] == [("clip", "grey_pf", 1)]
    written = call("report", "irtrack.db")
    assert (written.status, written.out) == (0, "report.html\n")
    assert (tmp_path / "report.html").stat().st_size > 10_000
    assert call("report", "irtrack.db", "-o", "other.html").out == "other.html\n"


def test_a_failing_tracker_fails_alone_and_the_status_says_so(call: Call, tmp_path: Path) -> None:
    answer = call("bench", "clip.mcap", "--trackers", "template,mine:Broken", "--seeds", "1", "--results", "x.db")
    assert answer.status == 1
    assert "Traceback" not in answer.err
    assert answer.err == "irtrack: 1 of 2 runs failed; the report shows why\n"
    with Results(tmp_path / "x.db") as results:
        assert {(cell.label, cell.status) for cell in results.cells()} == {
            ("template", "ok"),
            ("mine:Broken", "failed"),
        }


FAILING = [
    (("mine:Broken",), "mine:Broken: frame 1: ValueError: planted", True),
    (("mine:Careless", "what=none"), "mine:Careless: frame 1: step gave None; allowed: (state, Estimate)", False),
    (("mine:Careless", "what=pair"), "mine:Careless: frame 1: step gave (state, float); allowed", False),
    (("mine:Careless", "what=leave"), "mine:Careless: frame 1: SystemExit: 3", True),
    (("mine:Careless", "what=write"), "mine:Careless: frame 1: ValueError: assignment destination is read-only", True),
]


@pytest.mark.parametrize(("words", "said", "raises"), FAILING, ids=str)
def test_a_tracker_that_fails_is_one_headline_and_its_own_calls(
    call: Call, words: tuple[str, ...], said: str, raises: bool
) -> None:
    answer = call("run", words[0], "clip.mcap", *words[1:])
    assert (answer.status, answer.out) == (1, "")
    *lines, where = [line for line in answer.err.splitlines() if not line.startswith("seen")]
    assert where.startswith("on clip, seed 0; repeat it: irtrack run ")
    assert lines[0].startswith(f"irtrack: {said}")
    if not raises:
        assert len(lines) == 1
        return
    assert all(line.startswith("  ") for line in lines[1:])
    files = [line for line in lines if line.lstrip().startswith("File ")]
    assert len(files) == 1
    assert "mine.py" in files[0]
    name = words[0] + "".join(f":{word}" for word in words[1:])
    answer = call("bench", "clip.mcap", "--trackers", f"kalman,{name}", "--seeds", "1", "--results", "f.db", "--json")
    assert answer.status == 1
    assert {row["label"]: row["failed"] for row in json.loads(answer.out)["rows"]} == {"kalman": 0, name: 1}


def test_a_terminal_and_a_page_obey_nothing_that_a_tracker_raises(call: Call) -> None:
    said = r"ValueError: \x1b[31m<b>red\x9b0m \x07\u202e \x00 \udc9b"
    answer = call("run", "mine:Careless", "clip.mcap", "what=command")
    assert answer.err.splitlines()[1] == f"irtrack: mine:Careless: frame 1: {said}"
    assert all(letter.isprintable() for letter in answer.err.replace("\n", ""))
    call("bench", "clip.mcap", "--trackers", "mine:Careless:what=command", "--seeds", "1", "--results", "c.db")
    call("report", "c.db", "-o", "c.html")
    assert html.escape(said) in Path("c.html").read_text(encoding="utf-8")


def test_a_run_takes_parameters_as_a_bench_does(call: Call) -> None:
    words = ("run", "big=grey_pf:particles=40:bins=8", "clip.mcap", "alpha=0.5", "--json")
    track = json.loads(call(*words).out)
    assert (track["tracker"], track["config"]["tracker"]) == ("big", "grey_pf")
    assert {key: track["config"]["parameters"][key] for key in ("particles", "bins", "alpha")} == {
        "particles": 40,
        "bins": 8,
        "alpha": 0.5,
    }


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_what_a_tracker_prints_is_no_part_of_the_document(made: Path, jobs: str) -> None:
    for words in (
        ("run", "mine:Careless", "clip.mcap", "what=good"),
        (
            "bench",
            "clip.mcap",
            "scene.yaml",
            "--trackers",
            "mine:Careless:what=good",
            "--seeds",
            "1",
            "--jobs",
            jobs,
            "--results",
            str(made / f"{jobs}.db"),
        ),
    ):
        process = start(made, *words, "--json")
        out, err = process.communicate(timeout=60)
        assert process.returncode == 0
        assert json.loads(out)
        assert "seen 1" in err


BAD = [
    (("run", "grey_pff", "clip.mcap"), "did you mean 'grey_pf'?"),
    (("run", "nowhere:Tracker", "clip.mcap"), "nowhere"),
    (("run", "grey_pf", "none.mcap"), "none.mcap"),
    (("run", "grey_pf", "none.yaml"), "none.yaml"),
    (("run", "grey_pf", "cut.mcap"), "cut.mcap"),
    (("run", "grey_pf", "empty.mcap"), "empty.mcap"),
    (("run", "grey_pf", "clip.mcap", "particels=3"), "did you mean 'particles'?"),
    (("run", "grey_pf:particels=3", "clip.mcap"), "did you mean 'particles'?"),
    (("run", "grey_pf:particles=30", "clip.mcap", "particles=40"), "'particles' is given twice"),
    (("run", "grey_pf", "clip.mcap", "particles=0"), "particles"),
    (("run", "grey_pf", "clip.mcap", "particles=many"), "particles"),
    (("run", "grey_pf", "clip.mcap", "particles"), "KEY=VALUE"),
    (("run", "grey_pf", "clip.mcap", "camera.netd_mk=3"), "camera.netd_mk=3"),
    (("run", "grey_pf", "scene.yaml", "camera.netd=3"), "did you mean 'netd_mk'?"),
    (("run", "grey_pf", "clip.mcap", "--target", "jett"), "did you mean 'jet'?"),
    (("run", "grey_pf", "clip.mcap", "--init", "500,500,9,9"), "outside the frame"),
    (("run", "grey_pf", "clip.mcap", "--init", "5,5,9"), "X,Y,W,H"),
    (("run", "grey_pf", "clip.mcap", "--init", "5,5,9,9@99"), "no such frame"),
    (("run", "grey_pf", "clip.mcap", "--input", "colour"), "display or counts"),
    (("run", "grey_pf", "clip.mcap", "-o", "no/track.mcap"), "the folder no does not exist"),
    (("run", "grey_pf", "clip.mcap", "--csv", "no/track.csv"), "the folder no does not exist"),
    (("bench", "clip.mcap", "--trackers", "grey_pff", "--results", "x.db"), "did you mean 'grey_pf'?"),
    (("bench", "clip.mcap", "--trackers", "grey_pf:particels=3", "--results", "x.db"), "did you mean 'particles'?"),
    (("bench", "clip.mcap", "--trackers", "grey_pf,grey_pf", "--results", "x.db"), "labels that differ"),
    (("bench", "suites/quick", "--results", "x.db"), "did you mean 'suites/quick-suite'?"),
    (("bench", "quick-suite", "--results", "x.db"), "did you mean 'suites/quick-suite'?"),
    (("bench", "clip.mcap", "--results", "x.db"), "--trackers: is missing"),
    (("check", "kalman", "--only", ""), "--only '': a name is empty"),
    (("check", "kalman", "--only", "flip,"), "--only 'flip,': a name is empty"),
    (("stress", "kalman", "--only", "", "--results", "x.db"), "--only '': a name is empty"),
    (("sources", "--only", "", "-o", "x"), "--only '': a name is empty"),
    (("compare", "a", "b", "--metrics", ""), "--metrics '': a name is empty"),
    (("bench", "none.mcap", "--trackers", "grey_pf", "--results", "x.db"), "none.mcap"),
    (("bench", "clip.mcap", "--trackers", "grey_pf", "--results", "no/x.db"), "the folder no does not exist"),
    (("bench", "clip.mcap", "--trackers", "grey_pf", "--results", "scene.yaml"), "scene.yaml"),
    (("bench", "clip.mcap", "--trackers", "grey_pf", "--target", "jett", "--results", "x.db"), "did you mean 'jet'?"),
    (("bench", "clip.mcap", "--trackers", "grey_pf", "--results", "clip.mcap"), "would replace clip.mcap"),
    (("bench", "A=clip.mcap", "--trackers", "kalman", "--results", "clip.mcap"), "would replace clip.mcap"),
    (("bench", "clip.mcap", "./clip.mcap", "--trackers", "kalman", "--results", "x.db"), "as in NEW=./clip.mcap"),
    (
        ("bench", "clip.mcap", "particles=300", "--trackers", "grey_pf", "--results", "x.db"),
        "and no KEY=VALUE",
    ),
    (("run", "kalman", "clip.mcap", "-o", "clip.mcap"), "would replace clip.mcap"),
    (("run", "kalman", "clip.mcap", "--csv", "clip.mcap"), "would replace clip.mcap"),
    (("run", "kalman", "scene.yaml", "-o", "scene.yaml"), "would replace scene.yaml"),
    (("run", "kalman", "clip.mcap", "-o", "same", "--csv", "same"), "would replace same"),
    (("run", "kalman", "clip.mcap", "-o", "track.csv"), "track.csv: allowed: a name that ends in .mcap"),
    (("run", "kalman", "clip.mcap", "--csv", "track.txt"), "track.txt: allowed: a name that ends in .csv"),
    (("bench", "clip.mcap", "--trackers", "kalman", "--results", "x.csv"), "x.csv: allowed: a name that ends in .db"),
    (("compare", "a", "b", "--junit", "x.html"), "x.html: allowed: a name that ends in .xml"),
    (("run", "kalman", "clip.mcap", "gate=3", "gate=4"), "'gate' is given twice"),
    (("run", "kalman", "."), "irsim import"),
    (("run", "./mine.py:Reaching", "clip.mcap"), "did you mean 'mine:Reaching'?"),
    (("run", "mine:Typed", "clip.mcap", "reach=x"), "mine:Typed: reach: expected a whole number, not 'x'"),
    (("run", "mine:Reaching", "clip.mcap", "bogus=3"), "allowed: the tracker's reach\n"),
    (("report", "clip.mcap", "-o", "clip.mcap"), "would replace clip.mcap"),
    (("report", "none.db"), "none.db"),
    (("report", "clip.mcap"), "clip.mcap"),
    (("report", "none.db", "-o", "no/report.html"), "the folder no does not exist"),
]


@pytest.mark.parametrize(("words", "said"), BAD, ids=lambda value: " ".join(value) if isinstance(value, tuple) else "")
def test_bad_input_is_one_line_and_leaves_nothing(
    call: Call, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    before = {path.name for path in tmp_path.iterdir()}
    answer = call(*words)
    assert answer.status == 2
    assert answer.out == ""
    assert answer.err.startswith("irtrack: ")
    assert answer.err.count("\n") == 1
    assert said in answer.err
    assert {path.name for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("words", [("run", "grey_pf"), ("bench", "clip.mcap"), ("walk",), ("bench", "--seeds", "x")])
def test_wrong_usage_has_status_2(call: Call, words: tuple[str, ...]) -> None:
    answer = call(*words)
    assert answer.status == 2
    assert answer.out == ""
    assert "Traceback" not in answer.err


def start(folder: Path, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", "from irtrack.cli import main; main()", *words]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=pipe, text=True, start_new_session=True)


def cells_in(results: Path) -> int:
    """How many cells a results file holds while somebody else writes it."""
    try:
        with closing(sqlite3.connect(f"file:{results}?mode=ro", uri=True)) as database:
            return int(database.execute("SELECT count(*) FROM cells").fetchone()[0])
    except sqlite3.OperationalError:  # not there yet, or being written
        return 0


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_ctrl_c_ends_with_status_130_and_keeps_a_valid_file(made: Path, tmp_path: Path, jobs: str) -> None:
    results = tmp_path / "long.db"
    words = ("bench", "scene.yaml", "--trackers", "grey_pf", "--seeds", "500", "--results", str(results))
    process = start(made, *words, "--jobs", jobs)
    until = time.monotonic() + 60
    while time.monotonic() < until:
        if cells_in(results):
            break
        time.sleep(0.05)
    else:
        process.kill()
        pytest.fail("waited in vain for the first cells")
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to the workers too
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    told = re.fullmatch(r"irtrack: stopped; (\d+) runs? of this call kept in \S+, the same command goes on\n", err)
    assert told, err
    with Results(results) as kept:
        assert len(kept.cells()) == int(told[1]) > 0
        assert all(cell.status == "ok" for cell in kept.cells())


def test_a_reader_that_goes_away_is_no_error(made: Path) -> None:
    process = start(made, "run", "template", "clip.mcap", "--json")
    assert process.stdout is not None
    process.stdout.close()  # long before it has something to say
    assert process.stderr is not None
    assert process.stderr.read() == ""
    assert process.wait(timeout=60) == 1
