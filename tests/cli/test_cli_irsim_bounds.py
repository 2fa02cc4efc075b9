"""`irsim bounds` and `irsim render --bounds`: lines, tables, the recording's channel, wrong input."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import Run

import irsim
from irsim.recording.messages import BOUNDS

SCENE = """
seed: 2
frames: 6
camera: {size: [64, 48], netd_mk: 40}
background: {kind: sky}
targets:
  - {id: a, shape: {kind: point, contrast_k: 30}, path: {kind: straight, start: [20, 20], speed: 1, range_m: 3000}}
  - {id: b, shape: {kind: point, contrast_k: 5}, path: {kind: stop_and_go, start: [40, 30], range_m: 3000}}
  - {id: away, shape: {kind: point}, path: {kind: straight, start: [400, 50], speed: 0, range_m: 3000}}
"""


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "pair.yaml"
    path.write_text(SCENE)
    return path


def test_tables_hold_the_bounds_by_value(run: Run, scene: Path) -> None:
    rows = irsim.bounds(irsim.load(scene), ["a"], 2, 4)
    done = run(
        "bounds", "pair.yaml", "--target", "a", "--frames", "2:4", "--pfa", "1e-3", "-o", "a.csv", cwd=scene.parent
    )
    assert (done.returncode, done.stdout) == (0, "a.csv\n")
    with open("a.csv", newline="") as file:
        found = list(csv.DictReader(file))
    assert [(int(each["index"]), float(each["sd_x"]), float(each["d"])) for each in found] == [
        (row.index, row.sd_x, row.d) for row in rows
    ]
    assert float(found[0]["pd"]) > 0.9
    assert found[0]["predicted_x"] == ""
    parquet = pytest.importorskip("pyarrow.parquet")
    assert run("bounds", "pair.yaml", "-o", "both.parquet", cwd=scene.parent).returncode == 0
    table = parquet.read_table("both.parquet").to_pylist()
    assert {each["target"] for each in table} == {"a", "b"}
    assert table[1]["predicted_x"] > table[1]["sd_x"]


def test_lines_have_medians_and_say_what_is_missing(run: Run, scene: Path) -> None:
    done = run("bounds", "pair.yaml", "--start-error", "1", "--gate", "31", cwd=scene.parent)
    assert done.returncode == 0
    assert "target     a: 6 frames" in done.stdout
    assert "gate 31 px" in done.stdout
    assert done.stdout.count("sequence") == 1
    assert "irsim: note: target b: no bound of the sequence: its path has no linear law" in done.stderr


def test_recordings_return_the_bounds_by_value(run: Run, scene: Path) -> None:
    assert (
        run("render", "pair.yaml", "--bounds", "--frames", "2:6", "-o", "with.mcap", cwd=scene.parent).returncode == 0
    )
    assert run("render", "pair.yaml", "--frames", "2:6", "-o", "plain.mcap", cwd=scene.parent).returncode == 0
    found, plain = irsim.open_recording("with.mcap"), irsim.open_recording("plain.mcap")
    of_frame = irsim.FrameBounds(irsim.load(scene)).of
    expected = [tuple(replace(row, index=k) for row in of_frame(k + 2)) for k in range(4)]
    assert list(found.bounds()) == expected
    assert list(found.bounds(1, 2)) == expected[1:2]
    assert found.info()["topics"][BOUNDS] == 4
    assert not plain.has_bounds
    assert list(plain.bounds()) == []
    for one, other in zip(found.pairs(), plain.pairs(), strict=True):
        np.testing.assert_array_equal(one[0].image, other[0].image)
        assert one[1] == other[1]
    again = run("bounds", "plain.mcap", "--target", "a", "-o", "again.csv", cwd=scene.parent)
    assert again.returncode == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--target", "c"), "target: there is no 'c'; allowed: a, b, away"),
        (("--target", "away"), "target away: is in view in none of the frames 0:6"),
        (("--gate", "0"), "--gate 0.0: allowed: a number above 0, px"),
        (("--start-error", "-1"), "--start-error -1.0: allowed: a number above 0, px"),
        (("--pfa", "2"), "--pfa 2: allowed: between 0 and 1"),
        (("--target", "a,"), "--target 'a,': an id is empty"),
        (("-o", "a.txt"), "a.txt"),
    ],
)
def test_wrong_input(run: Run, scene: Path, words: tuple[str, ...], message: str) -> None:
    done = run("bounds", "pair.yaml", *words, cwd=scene.parent)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("irsim: ") == 1


def test_recordings_without_scenario_and_truth_are_refused(run: Run, scene: Path) -> None:
    np.save("frames.npy", np.zeros((3, 24, 32), np.uint16))
    assert run("import", "frames.npy", "-o", "real.mcap", cwd=scene.parent).returncode == 0
    done = run("bounds", "real.mcap", cwd=scene.parent)
    assert done.returncode == 2
    assert "holds no scenario and no truth; allowed: a recording with one of them" in done.stderr
