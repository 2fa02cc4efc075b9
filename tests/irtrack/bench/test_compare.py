"""Old results against new ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from bench_fakes import Strip, Walker
from command_line import Call

from irtrack.bench import Entry, Key, RunRecord, run_bench
from irtrack.bench.compare import Comparison, Gate, compare, junit
from irtrack.errors import InputError
from irtrack.metrics import FIGURES, Score


def cell(seed: int, source: str = "s", label: str = "t", failed: bool = False, **figures: Any) -> RunRecord:
    key = Key(f"{source}{seed}", "a", "visible", "display", seed, seed, "{}", "c")
    if failed:
        return RunRecord(key, label, source, source, "failed", "broke")
    unsaid = dict.fromkeys(FIGURES) | {"frames": 10, "held_frames": 10, "lost": False, "returns": 0, "reacquired": 0}
    return RunRecord(key, label, source, source, "ok", score=Score.from_dict(unsaid | figures))


def test_pairs_are_runs_of_the_same_scene() -> None:
    old = [cell(k, success_auc=0.1 * k) for k in range(8)]
    new = [cell(k, success_auc=0.1 * k + 0.2) for k in range(2, 11)]
    (found,) = compare(old, new, ["success_auc"])
    assert (found.difference.pairs, found.verdict) == (6, "better")
    assert found.difference.mean == pytest.approx(0.2)
    assert (found.old, found.new) == pytest.approx((0.45, 0.65))


def test_a_failed_run_is_lost_and_has_no_other_figure() -> None:
    old, new = [cell(k, error_held=1.0) for k in range(6)], [cell(k, failed=True) for k in range(6)]
    (found,) = compare(old, new)
    assert (found.figure, found.old, found.new, found.verdict) == ("lost", 0, 1, "worse")


def test_direction_of_figures() -> None:
    old = [cell(k, error_held=1.0, success_auc=0.5) for k in range(6)]
    new = [cell(k, error_held=1.2 + 0.01 * k, success_auc=0.6) for k in range(6)]
    found = {each.figure: each for each in compare(old, new)}
    assert (found["error_held"].verdict, found["success_auc"].verdict, found["lost"].verdict) == (
        "worse", "better", "tie",
    )  # fmt: skip
    assert found["error_held"].is_worse_by(0.1)
    assert not found["error_held"].is_worse_by(0.3)
    assert Gate.parse("error_held:0.1").failures(list(found.values())) == [found["error_held"]]
    assert Gate.parse("success_auc").failures(list(found.values())) == []


def test_junit_has_the_failures() -> None:
    old, new = [cell(k, off_share=0.0) for k in range(6)], [cell(k, off_share=0.5) for k in range(6)]
    gates = [Gate.parse("off_share:0.1"), Gate.parse("lost:0")]
    suite = ElementTree.fromstring(junit(compare(old, new), gates).encode())
    assert (suite.get("tests"), suite.get("failures")) == ("2", "1")
    (failure,) = suite.iter("failure")
    assert (failure.get("message") or "").startswith("t on s: off_share 0 -> 0.5, +0.5")


def test_too_few_runs() -> None:
    old, new = [cell(k) for k in range(5)], [cell(k, failed=True) for k in range(5)]
    found = compare(old, new, ["lost"])
    assert [each.verdict for each in found] == ["too few"]
    gate = Gate.parse("lost:0")
    with pytest.raises(InputError, match="lost: too few runs to tell whether it is worse; allowed: at least 6"):
        gate.require_enough(found)
    suite = ElementTree.fromstring(junit(found, [gate]).encode())
    assert (suite.get("tests"), suite.get("failures"), len(list(suite.iter("skipped")))) == ("1", "0", 1)
    gate.require_enough(compare([cell(k) for k in range(6)], [cell(k) for k in range(6)], ["lost"]))


def of_six() -> list[Comparison]:
    """Lost 3 of 6 before, 5 of 6 after, one of the 3 no more."""
    old = [cell(k, lost=k < 3) for k in range(6)]
    return compare(old, [cell(k, lost=k != 2) for k in range(6)], ["lost"])


def test_gate_with_too_few_seeds() -> None:
    (found,) = of_six()
    gate = Gate.parse("lost:0.05")
    assert (found.verdict, gate.failures([found])) == ("tie", [])
    (doubt,) = gate.doubts([found])
    most = found.difference.high
    assert doubt.startswith(f"t on s: lost: a worsening of up to {most:.2g} is not excluded by these 6 seeds; about ")
    assert doubt.endswith(" would resolve 0.05")
    assert Gate.parse(f"lost:{most}").doubts([found]) == []
    assert Gate.parse("lost:0").doubts([found])[0].endswith("by these 6 seeds")  # no number of seeds tells 0
    suite = ElementTree.fromstring(junit([found], [gate]).encode())
    assert [each.text for each in suite.iter("system-out")] == [doubt]


@pytest.mark.parametrize(
    ("old", "new", "figures", "words"),
    [
        ([cell(0)], [cell(1)], ["lost"], "the two have no run in common; allowed: "),
        ([cell(0)], [cell(0)], ["lots"], "figure 'lots': allowed: .*did you mean 'lost'"),
        ([cell(0)], [cell(0)], ["auc"], "figure 'auc': allowed: .*did you mean 'success_auc'"),
        ([cell(0)], [cell(0)], ["neff"], "figure 'neff': allowed: "),
    ],
)
def test_bad_input(old: list[RunRecord], new: list[RunRecord], figures: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        compare(old, new, figures)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("compare") / "r.db"
    entries = [Entry("right", Walker()), Entry("wrong", Walker(speed=3.0, jitter=0.5))]
    run_bench([Strip()], entries, results=path, seeds=6).close()
    return path


def test_the_command(results: Path, bare_call: Call, tmp_path: Path) -> None:
    def run(*words: str) -> tuple[int, str, str]:
        return bare_call("compare", *words)

    xml = tmp_path / "checks.xml"
    of_file = ("--results", str(results))
    status, out, err = run("right", "wrong", *of_file, "--fail-if-worse", "error:1", "--junit", str(xml))
    assert status == 1
    assert out.splitlines()[0].split()[:4] == ["source", "tracker", "figure", "old"]
    assert "right -> wrong on strip: error 0 -> " in err
    assert ElementTree.parse(xml).getroot().get("failures") == "1"
    status, out, err = run(str(results), str(results), "--json")
    assert (status, err) == (0, "")
    # The six runs of one of them are the same to the bit, and count once.
    assert {row["verdict"] for row in json.loads(out)} == {"tie", "too few"}
    status, out, err = run("rihgt", "wrong", *of_file)
    assert (status, out) == (2, "")
    assert err.endswith("no tracker is labelled 'rihgt'; allowed: right, wrong; did you mean 'right'?\n")
