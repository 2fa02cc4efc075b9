"""The papers' experiments: every declared run exists, and the page is complete and offline."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from html_page import Page
from paper_runs import TINY, run_at, runs_of
from tracker_scenes import blob, follow

from irsim.types import Box
from irtrack.bench import parse_tracker_spec
from irtrack.errors import InputError
from irtrack.external import PEERS
from irtrack.features.trajectory import trajectory_similarity
from irtrack.papers import rules, runs
from irtrack.papers import search as search_module
from irtrack.papers.experiment import (
    BETTER,
    HARD,
    OF_PAPERS,
    OURS,
    THEIRS,
    Choice,
    Claim,
    Experiment,
    Goal,
    Paper,
    Printed,
    Scene,
    Sweep,
    Switch,
    Untested,
)
from irtrack.papers.growth import growth_result
from irtrack.papers.page import PAPERS, write_papers
from irtrack.papers.runs import plan_paper, run_plan
from irtrack.papers.search import SEARCHES, Search, search
from irtrack.papers.tables import rows
from irtrack.papers.xue import XUE
from irtrack.points import FILTERS
from irtrack.registry.table import TRACKERS, make
from irtrack.trackers import cascade_pf
from irtrack.trackers.appearance import Appearance


@pytest.mark.parametrize("paper", PAPERS, ids=lambda paper: paper.key)
def test_trackers_and_scenes_of_a_paper_exist(paper: Paper) -> None:
    plan = plan_paper(paper)
    assert all(len(scene.open()) > 0 for scene in plan)
    for spec in {spec for trackers in plan.values() for spec in trackers.values()}:
        parse_tracker_spec(spec)
    for goal in paper.goals:
        assert goal.label in plan[goal.scene]
    for claim in paper.claims:
        assert set(claim.rule.labels) <= plan[claim.scene].keys()


def test_cost_of_the_cascade_in_closed_form(monkeypatch: pytest.MonkeyPatch) -> None:
    """With N1 = 30, N2 = 15 the cascade weighs 30 particles by grey levels and at most 15 by velocity; the product 45
    by both (Xue et al. 2011, section 3.2)."""
    counts = {"grey": 0, "velocity": 0}
    likelihood, similarity = Appearance.likelihood, trajectory_similarity

    def grey(self: Appearance, picture: Any, centers: Any, *others: Any) -> Any:
        counts["grey"] += len(centers)
        return likelihood(self, picture, centers, *others)

    def velocity(trajectory: Any, places: Any, speed: Any) -> Any:
        counts["velocity"] += len(places)
        return similarity(trajectory, places, speed)

    monkeypatch.setattr(Appearance, "likelihood", grey)
    monkeypatch.setattr(cascade_pf, "trajectory_similarity", velocity)
    scene = blob(0, count=11)
    for name, most in (("cascade_pf", 15), ("product_pf", 45)):
        counts.update(grey=0, velocity=0)
        follow(make(name), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10))
        assert counts["grey"] == 10 * (30 if name == "cascade_pf" else 45)
        assert 0 < counts["velocity"] <= 6 * most  # from the fifth place of the trajectory on
        assert (counts["velocity"] == 6 * 45) is (name == "product_pf")
    assert [each.word for each in XUE.derived] == ["not held"]


def test_hard_scenes_have_all_trackers_and_peers() -> None:
    assert len(THEIRS) == 2 * len(PEERS)
    assert OURS.keys() >= TRACKERS.keys() == {*OF_PAPERS, *BETTER}
    for spec in OURS.values():
        parse_tracker_spec(spec)
    assert all(experiment.trackers == OURS | THEIRS for experiment in HARD)


def test_row_has_runs_without_loss_and_all_runs() -> None:
    found = runs_of("tiny", a=[run_at(1), run_at(41), None])
    row, absent = rows(Experiment(Scene.of("tiny"), "", {"a": "a", "b": "b"}, {"a": Printed((0.8, 0.9))}), found)
    assert (row.runs, row.failed, row.lost, row.decided) == (3, 1, 1, 2)
    assert row.kept is not None
    assert row.all is not None
    assert (row.kept.abs_x, row.all.abs_x) == pytest.approx((1, 21))
    assert absent.absent


def test_growth_claims_are_judged_run_by_run() -> None:
    """Weight selection has the larger RMSE than SIR in most runs (5.72, 5.55, 5.40 against 5.44, 5.08, 4.77), and a
    smaller one than SIS, of which few particles keep a weight."""
    found = growth_result(runs=20).verdicts()
    lower = [each for each in found if "square error" in each.text]
    assert len(lower) == 16
    assert all(each.judgement.decided == 20 for each in found)
    words = {standard: {each.judgement.word for each in lower if standard in each.words} for standard in ("SIR", "SIS")}
    assert "held" not in words["SIR"]
    assert words["SIS"] == {"held"}


@pytest.mark.slow
def test_filters_of_points_have_a_section_and_verdicts(tmp_path: Path) -> None:
    """The likelihood filter degenerates more than the bootstrap filter in all runs; bearings alone do not suit it."""
    path = write_papers(tmp_path / "out", seeds=2, first=1000, only=["points"])
    assert "tabu_ekpf_imm, metropolis" in path.read_text()
    found = json.loads((tmp_path / "out" / "sources.json").read_text())["points"]
    assert found["runs"] == 8
    assert len(found["rows"]) == 3 * len(FILTERS) - 3
    assert all(row["low"] < row["rmse"] < row["high"] for row in found["rows"])
    degenerate = [each["seeds"] for each in found["verdicts"] if "likelihood" in each["claim"]]
    assert degenerate == [[8, 8], [8, 8]]


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Paper:
    (tmp_path / "tiny.yaml").write_text(TINY)
    monkeypatch.chdir(tmp_path)
    scene, points = Scene("tiny", "tiny.yaml"), (20, 40)
    trackers = {"grey_pf": "grey_pf", "gone": "gone"}
    return Paper(
        "cheng",
        "Somebody 2006: a paper",
        (Experiment(scene, "One", trackers, {"grey_pf": Printed((1.0, 2.0), None, 125)}),),
        (
            Claim("It holds.", "p. 3", scene, rules.holds("grey_pf")),
            Claim("It too.", "", scene, rules.holds("gone")),
        ),
        (Untested("It flies.", "p. 4", "nothing here flies"),),
        (Goal("not lost", scene, "grey_pf", rules.holds("grey_pf"), 0.95),),
        (
            Sweep(
                "Against N",
                "N",
                {n: (scene, {"pf": f"grey_pf:particles={n:g}"}) for n in points},
                {"CPU time, ms": rules.cpu},
                log=True,
            ),
        ),
        (
            Switch("update", scene, "grey_pf", "grey_pf:update=false"),
            Switch("noise", scene, "grey_pf", Choice((scene,), ("grey_pf:noise=fixed:r0=1",))),
        ),
    )


def test_page_is_complete_and_offline(tiny: Paper, tmp_path: Path) -> None:
    path = write_papers(tmp_path / "out", seeds=4, only=["cheng"], papers=[tiny], command="irtrack papers")
    page = Page(path.read_text())
    summary = json.loads(path.with_suffix(".json").read_text())
    assert summary["seeds"] == [2000, 4]
    assert summary["claims"] == {"cheng": {"held": 1, "not held": 0, "no difference": 0, "not decidable": 2}}
    assert summary["scenes"]["tiny"]["grey_pf"]["lost"] == 0
    assert summary["scenes"]["tiny"].keys() == {"grey_pf"}
    assert not [link for link in page.links if not link.startswith(("#", "data:"))]
    goals, verdicts, experiment, switches, speed = page.tables
    assert goals[1][2:4] == ["≥ 95 %", "100 %"]
    assert "about 73 seeds would decide" in goals[1][1]
    assert "nothing here flies" in verdicts[3][1]
    assert "fixed:r0=1" in switches[2][0]
    assert "4 of 4" in verdicts[1][2]
    assert "not decidable" in verdicts[2][1]
    assert "unknown tracker 'gone'" in verdicts[2][1]
    assert "1.0 ± 2.0" in " ".join(experiment[2])
    assert "unknown tracker 'gone'" in experiment[3][1]
    assert switches[1][2] == "0 of 4"
    assert speed[1][3] == "8"
    assert "from 2000 on, which were not used" in page.text


def test_finished_runs_are_not_repeated(tiny: Paper, tmp_path: Path) -> None:
    calls: list[int] = []

    def note_progress(done: int, total: int | None = None, note: str = "") -> None:
        calls.append(done)

    for _ in range(2):
        calls.clear()
        found = run_plan(plan_paper(tiny), tmp_path / "r.db", range(2), 1, note_progress)
    assert calls == []
    assert len(found["tiny"].of("grey_pf")) == 2


def test_bad_input_of_the_page(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nosuch: there is no such part; allowed: cheng, xue, an"):
        write_papers(tmp_path, only=["nosuch"])
    with pytest.raises(InputError, match="holds no sequence"):
        runs.real_sequences(tmp_path)


def test_real_sequences_run_target_by_target(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two labelled spots. A tracker with random numbers runs with every seed, one without runs once."""
    folder = tmp_path / "real" / "two"
    folder.mkdir(parents=True)
    video = cv2.VideoWriter(str(folder / "frames.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), 25, (96, 64))
    labels = ["frame,x,y,w,h,id,cls"]
    for k in range(14):
        image = np.full((64, 96, 3), 60, dtype=np.uint8)
        for name, x, y in (("a", 20 + k, 20), ("b", 70 - k, 44)):
            cv2.circle(image, (x, y), 4, (220, 220, 220), -1)
            labels.append(f"{k},{x - 4},{y - 4},9,9,{name},spot")
        video.write(image)
    video.release()
    (folder / "gt.csv").write_text("\n".join(labels) + "\n")
    monkeypatch.setattr(runs, "OURS", {"grey_pf": "grey_pf", "template": "template:window=10"})
    monkeypatch.setattr(runs, "THEIRS", {"gone": "gone"})
    found = {row.label: row for row in runs.run_real(tmp_path / "real", tmp_path, tmp_path / "r.db", 1, seeds=2)}
    assert {label: (row.targets, row.seeds, row.runs, row.failed) for label, row in found.items()} == {
        "grey_pf": (2, 2, 4, 0),
        "template": (2, 1, 2, 0),
    }
    assert found["template"].lost == 0
    assert found["template"].distance is not None
    assert found["template"].distance < 2


def test_search_keeps_the_cost_of_each_combination(tiny: Paper, tmp_path: Path) -> None:
    """Particles that do not move lose a target of 1 px a frame."""
    searches = {"particles": Search("grey_pf", {"r0": (0.001, 3.0), "start_speed_sd": (0.0,)}, "noise=fixed")}
    path = tmp_path / "search.json"
    found = search(path, searches, [tiny.experiments[0].scene], [0, 1])
    assert json.loads(path.read_text()) == found
    (costs,) = found["searches"].values()
    assert [spec.split(":")[2] for spec in costs] == ["r0=3.0", "r0=0.001"]
    best, worst = costs.values()
    assert 0 < best["cost"] < worst["cost"] <= 1
    assert (best["runs"], best["lost"], best["tiny"]) == (2, 0, best["cost"])
    recorded = json.loads(Path(search_module.__file__).with_suffix(".json").read_text())
    assert {name: len(rows) for name, rows in recorded["searches"].items()} == {
        name: len(each.specs()) for name, each in SEARCHES.items()
    }
