"""`irtrack explain` and `irtrack.explain_loss`: planted causes in rendered scenes, results files, and wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Call
from planted_causes import planted

import irsim
import irtrack
from irsim.types import Box, Frame
from irtrack.bench import Results, run_bench
from irtrack.explain import Explanation
from irtrack.explain.twin_runs import Seeds, Task, play
from irtrack.report import write_report
from irtrack.runner.watchdog import Heartbeat

PAIR = """
seed: 1
frames: 44
camera: {size: [112, 56], elevation_deg: 8, netd_mk: 40, range_k: [250, 330], agc: {kind: fixed}}
background: {kind: sky, horizon_k: 280, zenith_k: 260}
targets:
  - {id: drone, shape: {kind: point, temperature_k: 320, area_m2: 1},
     path: {kind: straight, start: [12, 20], speed: 2, range_m: 1500}}
  - {id: far, shape: {kind: point, temperature_k: 320, area_m2: 1},
     path: {kind: straight, start: [12, 40], speed: 2, range_m: 1500}}
occluders:
  - {kind: bar, id: post, center_px: [46, 16], size_px: [26, 40], range_m: 100, temperature_k: 275}
"""


@pytest.mark.parametrize(
    ("rule", "error", "values"),
    [
        ("a", 0.0, {"a": 1.0}),
        ("a and b", 0.0, {"a": 0.5, "b": 0.5}),
        ("a or b", 0.0, {"a": 0.5, "b": 0.5}),
        ("a", 0.05, {"a": 1.0}),
    ],
)
def test_planted_causes_are_named(rule: str, error: float, values: dict[str, float]) -> None:
    scenario, tracker = planted(4, rule, error)
    found = irtrack.explain_loss(scenario, tracker)
    assert found.seed_kind == ("tracker" if error else "noise")
    assert found.lost_at == 1
    for share in found.shares:
        assert share.value == pytest.approx(values.get(share.cause, 0.0), abs=4 * error)
    assert set(found.named) == set(values)
    assert found.verdict == ", ".join(found.named)
    assert found.p_all - found.p_none == pytest.approx(sum(share.value for share in found.shares))


def test_a_loss_without_a_cause_is_luck_or_unexplained() -> None:
    scenario, tracker = planted(5, "never", 0.5)
    seed = next(seed for seed in range(9) if irtrack.score(irtrack.run(tracker, scenario, seed=seed), scenario).lost)
    found = irtrack.explain_loss(scenario, tracker, tracker_seed=seed)
    assert found.named == ()
    assert found.verdict in ("luck", "unexplained")


def test_runs_in_twins_are_those_of_the_bench() -> None:
    """The loss is that of `irtrack.run`, whether runs are shared between twins or not."""
    scenario = irsim.loads(PAIR)
    removals = [frozenset[str](), frozenset(["post"]), frozenset(["other_targets"])]
    for name in ("kalman", "optical_flow"):
        tracker = irtrack.make(name)
        outcomes = play(Heartbeat(), Task(scenario, "drone", 0, tracker, "display"), removals, Seeds((1, 2)))
        twins = irsim.Twins(scenario, "drone")
        for removed, outcome in zip(removals, outcomes, strict=True):
            twin = twins.scenario_of(removed)
            for seed, lost_at in zip((1, 2), outcome.lost_at, strict=True):
                track = irtrack.run(tracker, twin, seed=seed)
                assert irtrack.score(track, twin).lost_at == lost_at, (name, removed)


def test_a_tracker_that_raises_is_lost() -> None:
    class Raises:
        resumable = False

        def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> int:
            return 0

        def step(self, state: int, frame: Frame, rng: np.random.Generator) -> None:
            raise ValueError("no")

    found = irtrack.explain_loss(irsim.change(irsim.loads(PAIR), {"frames": 4}), Raises(), causes=["post"])
    assert (found.lost_at, found.verdict, found.p_none) == (1, "unexplained", 1)


def test_losses_of_a_results_file(tmp_path: Path, call: Call) -> None:
    """The pair post and other target loses the Kalman tracker; the file keeps the explanation."""
    scene = tmp_path / "pair.yaml"
    scene.write_text(PAIR)
    db = tmp_path / "r.db"
    run_bench([scene], ["kalman", "template"], results=db, seeds=[1]).close()
    (row,) = json.loads(call("explain", str(db), "--tracker", "kalman", "--json").out)
    found = Explanation.from_dict(row)
    assert (found.verdict, found.scene, found.seed_kind) == ("post, other_targets", "pair", "noise")
    post = next(share for share in found.shares if share.cause == "post")
    assert post.hidden[0] > 10
    assert post.hidden[1] == 0
    assert not post.confounded
    assert {each.causes: each.restored for each in found.repairs} == {("other_targets",): 5, ("post",): 5}
    assert found.parting is not None
    assert found.parting.removed in (("post",), ("other_targets",))
    with Results(db) as results:
        (cell,) = [each for each in results.cells() if each.label == "kalman"]
        assert results.explanation(cell.key) == row
    again = call("explain", str(db), "--tracker", "kalman").out
    assert "* post" in again
    assert "another seed alone restores 0%" in again
    page = write_report(db, tmp_path / "r.html").read_text()
    assert "named 1×" in page
    assert page.count('<svg class="crop"') >= 2
    assert f"without {found.parting.removed[0]}" in page
    assert json.loads(write_report(db, tmp_path / "r.json").read_text())["explanations"] == [row]
    wrong = call("explain", str(db), "--tracker", "kalmen")
    assert wrong.status == 2
    assert "there is no 'kalmen'; allowed: kalman, template; did you mean" in wrong.err


def test_wrong_input_is_one_line(tmp_path: Path, call: Call, footage: Path) -> None:
    scene = tmp_path / "pair.yaml"
    scene.write_text(PAIR)
    for arguments, text in (
        ([footage, "--tracker", "kalman"], "holds no scenario, so it has no twins; allowed: a scenario"),
        ([scene, "--tracker", "template", "frames=30"], "the track is not lost; allowed: a lost run"),
        ([scene, "--tracker", "kalman", "--causes", "pots"], "cause: there is no 'pots'; allowed: post, white"),
        ([scene, "--tracker", "kalman", "--seeds", "3"], "seeds 3: allowed: 5 or more"),
        ([scene, "--tracker", "gnn"], "gnn: has no single track to lose"),
        ([scene], "--tracker: is missing"),
        ([scene, "--tracker", "kalman", "--scene", "x"], "--scene is an option of results files"),
    ):
        answer = call("explain", *map(str, arguments))
        assert (answer.status, answer.err.count("\n")) == (2, 1), answer.err
        assert text in answer.err


@pytest.mark.slow
def test_the_result_does_not_depend_on_jobs() -> None:
    scenario, tracker = planted(4, "a or b")
    alone, apart = (irtrack.explain_loss(scenario, tracker, jobs=jobs).as_dict() for jobs in (1, 2))
    assert alone == apart


@pytest.mark.slow
def test_falsify_names_the_cause_of_its_failure(tmp_path: Path, call: Call) -> None:
    scene = tmp_path / "pair.yaml"
    scene.write_text(PAIR + "vary: {occluders.post.size_px.0: {kind: uniform, low: 24, high: 28}}\n")
    arguments = ("--tracker", "kalman", "--budget", "2", "--fresh", "5", "--explain", "-o", str(tmp_path / "found"))
    answer = call("falsify", str(scene), *arguments)
    assert answer.status == 1
    assert "cause: " in answer.out
    assert "post" in answer.out
    report = (tmp_path / "found" / "report.md").read_text()
    assert "- Cause: " in report
