"""irtrack regress: kept failures and baselines; changes are reported, `--update` accepts them."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import planted_failure
import pytest
from command_line import Call

import irsim
from irtrack.bench import baseline, load_suite
from irtrack.falsify import find_failure, kept_failures
from irtrack.metrics import FIGURES

ROOT = Path(__file__).parents[3]
KEPT = kept_failures(ROOT / "scenarios" / "regressions")
SUITE = ROOT / "recordings" / "reference" / "golden-suite.yaml"
RECORDINGS = sorted((ROOT / "recordings" / "reference").glob("*.mcap"))


@pytest.fixture
def cli(bare_call: Call) -> Call:
    """`irtrack regress WORDS` in an empty folder: (exit status, output, errors)."""
    return lambda *words: bare_call("regress", *words)


@pytest.mark.parametrize("name", [str(each) for each in KEPT])
def test_kept_failure_is_unchanged(name: str) -> None:
    (kept,) = [each for each in KEPT if str(each) == name]
    assert not kept.changes()


def test_baseline_is_unchanged() -> None:
    """Of trackers on the small recordings; `irtrack regress --update` accepts a better figure."""
    old = baseline.read(baseline.baseline_file(SUITE))
    assert baseline.changes(old, baseline.measure(load_suite(SUITE))) == []


@pytest.mark.parametrize("figure", [name for name in baseline.HELD if name != "lost"])
def test_figure_worse_by_a_tenth_is_reported(figure: str) -> None:
    old = baseline.read(baseline.baseline_file(SUITE))
    factor = 1.1 if FIGURES[figure].better == "less" else 0.9
    tested = 0
    for run, figures in old.items():
        was = figures[figure]
        if was is None or was * 0.1 < 0.01 * (figure != "error"):  # less than one frame of a hundred
            continue
        tested += 1
        worse: Mapping[str, float | None] = {**figures, figure: was * factor}
        assert [each.verdict for each in baseline.changes({run: figures}, {run: worse})] == ["worse"], run
        assert [each.verdict for each in baseline.changes({run: worse}, {run: figures})] == ["better"]
        assert not baseline.changes({run: figures}, {run: {**figures, figure: was * (1 + (factor - 1) / 4)}})
    assert tested


def test_lost_new_and_missing_runs_are_reported() -> None:
    run = ("sky", "kalman", 0)
    held = dict.fromkeys(baseline.HELD, 0.0)
    assert [each.verdict for each in baseline.changes({run: held}, {run: {**held, "lost": 1.0}})] == ["worse"]
    assert [each.verdict for each in baseline.changes({run: held}, {})] == ["gone"]
    assert [each.verdict for each in baseline.changes({}, {run: held})] == ["new"]
    assert [each.verdict for each in baseline.changes({run: held}, {run: {**held, "error": None}})] == ["gone"]


PLANTED = """
sources: [blind.yaml]
trackers: [{label: offset, tracker: "planted_failure:Offset", parameters: {px: 2.0}}]
seeds: 2
"""


def test_worse_tracker_fails_until_updated(cli: Call) -> None:
    """Its error is 2 px, then 2.2 px."""
    Path("blind.yaml").write_text(planted_failure.SCENE)
    Path("my-suite.yaml").write_text(PLANTED)
    status, _, err = cli("my-suite.yaml")
    assert (status, err.count("\n")) == (2, 1)
    assert "my-suite.golden.json: there is no baseline yet; irtrack regress --update" in err
    assert cli("my-suite.yaml", "--update")[0] == 0
    Path("my-suite.yaml").write_text(PLANTED.replace("2.0", "2.2"))
    status, out, _ = cli("my-suite.yaml")
    assert status == 1
    row = out.splitlines()[1].split()
    assert (row[:4], row[-1]) == (["blind", "offset", "0", "error"], "worse")
    assert [float(word) for word in row[4:6]] == pytest.approx([2, 2.2], abs=0.01)
    status, out, _ = cli("my-suite.yaml", "--update")
    assert (status, "worse" in out, "updated" in out) == (0, True, True)
    Path("my-suite.yaml").write_text(PLANTED.replace("2.0", "1.0"))
    status, out, _ = cli("my-suite.yaml")
    assert (status, "better" in out) == (0, True)


FAILING = {
    "Exiting": "the process died 2 times while the tracker was at work (exit status 7)",
    "Hanging": "hangs: more than 2 s in the tracker",
}


def test_failed_runs_are_one_line_each(cli: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """They fail at frame 9; the other tracker is measured."""
    monkeypatch.setattr("irtrack.cli.regress.FRAME_LIMIT_S", 2.0)
    Path("blind.yaml").write_text(planted_failure.SCENE.replace("start: [4, 4]", "start: [34, 36]"))

    def write_suite(**classes: str) -> None:
        rows = [f"  - {{label: {name}, tracker: 'planted_failure:{kind}'}}\n" for name, kind in classes.items()]
        Path("my-suite.yaml").write_text(f"sources: [blind.yaml]\nseeds: 1\ntrackers:\n{''.join(rows)}")

    write_suite(beside="Offset", **dict.fromkeys(FAILING, "Offset"))
    assert cli("my-suite.yaml", "--update")[::2] == (0, "")
    write_suite(beside="Offset", **{name: name for name in FAILING})
    status, out, err = cli("my-suite.yaml")
    assert status == 1
    assert err.splitlines() == [
        f"irtrack: {name} failed: blind, seed 0, frame 9: {why}" for name, why in sorted(FAILING.items())
    ]
    assert {line.split()[1] for line in out.splitlines()[1:-1]} == set(FAILING)
    assert "my-suite.yaml: failed: 3 runs" in out


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the planted failure."""
    base = tmp_path_factory.mktemp("kept")
    near = planted_failure.SCENE.replace("low: 4, high: 54", "low: 32, high: 36")
    kept_in = base / "regressions"
    find_failure(irsim.loads(near), "planted_failure:Raising", base / "out", name="blind", fresh=5, keep_in=kept_in)
    return base / "regressions"


def test_mended_failure_must_stay_mended(folder: Path, cli: Call, tmp_path: Path) -> None:
    shutil.copytree(folder, "kept")
    note = next(Path("kept").glob("*.json"))
    mended = note.read_text().replace("planted_failure:Raising", "planted_failure:Offset")
    note.write_text(mended)
    status, out, _ = cli("kept")
    assert status == 1
    assert "no longer breaks never_lost" in out
    assert cli("kept", "--update")[0] == 0
    assert cli("kept")[:2] == (0, "kept: ok: 1 failure, 0 changes\n")
    note.write_text(note.read_text().replace("planted_failure:Offset", "planted_failure:Raising"))
    status, out, _ = cli("kept")
    assert status == 1
    assert "breaks never_lost again" in out
    assert "ValueError: planted" in out


def test_kept_failures_run_in_worker_processes(folder: Path, cli: Call, tmp_path: Path) -> None:
    """The log has their process ids: never this process, with one job or two. The output is the same."""
    log = tmp_path / "log"
    for name in ("one", "two"):
        for path in folder.iterdir():
            Path("kept").mkdir(exist_ok=True)
            shutil.copy(path, Path("kept", name).with_suffix(path.suffix))
        note = {"label": name, "tracker": "bench_fakes:Logger", "parameters": {"log": str(log)}}
        Path("kept", f"{name}.json").write_text(json.dumps({**note, "input": "display", "broken": True}))
    output = cli("kept")
    one = {line.split()[0] for line in log.read_text().splitlines()}
    log.unlink()
    assert cli("kept", "--jobs", "2") == output
    two = {line.split()[0] for line in log.read_text().splitlines()}
    assert len(one) == 1
    assert len(two) <= 2
    assert str(os.getpid()) not in one | two


def test_changed_frames_are_reported(folder: Path, cli: Call) -> None:
    shutil.copytree(folder, "kept")
    (kept,) = kept_failures("kept")
    warmer = irsim.change(irsim.load(kept.path), {"background.horizon_k": 284})
    kept.path.write_text(irsim.dumps(warmer))
    assert cli("kept")[0] == 1
    assert "frame 0 differs from blind-planted_failure-Raising.mcap" in kept.changes()[0]
    assert cli("kept", "--update")[0] == 0
    assert not replace(kept, broken=kept.update().broken).changes()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["none-suite.yaml"], "none-suite.yaml: cannot read it: there is no such file"),
        (["sky"], "sky: allowed: a suite (*suite*.yaml) or a folder of kept failures"),
        (["empty"], "empty: holds no kept failure"),
        (["odd-suite.yaml"], "odd-suite.golden.json: holds no baseline"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_bad_input_is_one_line(cli: Call, words: list[str], said: str) -> None:
    Path("empty").mkdir()
    Path("blind.yaml").write_text(planted_failure.SCENE)
    Path("odd-suite.yaml").write_text(PLANTED)
    Path("odd-suite.golden.json").write_text("[1]")
    status, out, err = cli(*words)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_unreadable_failures_are_reported(folder: Path, cli: Call) -> None:
    (whole,) = kept_failures(folder)
    Path("kept").mkdir()

    def put(name: str) -> tuple[Path, Path, Path]:
        copies = [
            shutil.copy(path, Path("kept", name + path.suffix)) for path in (whole.note, whole.path, whole.recording)
        ]
        note, scene, recording = map(Path, copies)
        return note, scene, recording

    put("fine")
    assert cli("kept")[:2] == (0, "kept: ok: 1 failure, 0 changes\n")
    renamed, cut, lost, bad, odd = map(put, ("renamed", "cut", "lost", "bad", "odd"))
    renamed[0].write_text(renamed[0].read_text().replace("planted_failure:Raising", "planted_failure:Raised"))
    cut[2].write_bytes(cut[2].read_bytes()[:-500])
    lost[2].unlink()
    bad[0].write_text("{}")
    odd[1].write_text(odd[1].read_text().replace("background:", "backgrund:"))
    status, out, err = cli("kept", "--jobs", "2")
    assert (status, out) == (2, "kept: incomplete: 1 failure, 0 changes, 5 not judged\n")
    lines = dict(line.removeprefix("irtrack: kept/").split(":", 1) for line in err.splitlines())
    assert list(lines) == ["bad.json", "cut.mcap", "lost.mcap", "odd.yaml", "renamed.json"]
    assert "is no note of a kept failure" in lines["bad.json"]
    assert "is missing; lost.json names it" in lines["lost.mcap"]
    assert "Raised" in lines["renamed.json"]
    assert cli("kept", "--update")[0] == 2
    (found,) = json.loads(cli("kept", "--json")[1])
    assert (found["checked"], found["failed"], len(found["faults"])) == (1, False, 5)
