"""Page of the papers: one HTML file with every experiment, claim, goal and ablation."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import irsim
from irsim.recording.output import atomic_text, make_folder
from irtrack.errors import InputError, whole_number
from irtrack.external import PEERS
from irtrack.metrics.lost import LOSS_RULE
from irtrack.papers.an_cui import AN, CAMSHIFT, CUI
from irtrack.papers.cheng import CHENG
from irtrack.papers.cost import COST
from irtrack.papers.experiment import CONTEXT, HARD, OURS, THEIRS, Experiment, Paper, Sweep
from irtrack.papers.growth import RUNS_A_SEED, growth_result
from irtrack.papers.li import LI
from irtrack.papers.points import RUNS_A_SEED as POINT_RUNS_A_SEED
from irtrack.papers.points import points_result
from irtrack.papers.runs import (
    DEVELOPMENT,
    FIRST_SEED,
    Progress,
    SceneRuns,
    plan_choices,
    plan_hard,
    plan_paper,
    run_plan,
    run_real,
    settle_choices,
)
from irtrack.papers.summary import commit, counts, growth_summary, points_summary, rows_summary, verdict_list
from irtrack.papers.tables import (
    Row,
    Speed,
    error_over_frames,
    growth_charts,
    rows,
    scores_over_frames,
    speeds,
    sweep_chart,
)
from irtrack.papers.verdicts import RULE, Effect, GoalResult, Verdict, compare_peers, effect, judge_goal, verdict
from irtrack.papers.xue import XUE
from irtrack.report.line_styles import LineStyle, styles
from irtrack.report.page import render

PAPERS = (CHENG, XUE, AN, CUI, CAMSHIFT, LI, COST)
PARTS = (*(paper.key for paper in PAPERS), "growth", "points", "hard")
RESULTS = "sources.db"
PAGE = "sources.html"
SUMMARY = "sources.json"


@dataclass(frozen=True)
class ExperimentPart:
    """Table and charts of an experiment, with the figures stated at the head of the scenario."""

    experiment: Experiment
    head: tuple[str, ...]
    styles: Mapping[str, LineStyle]
    rows: list[Row]
    charts: list[str]

    @classmethod
    def of(cls, experiment: Experiment, every: Mapping[str, SceneRuns], charted: bool = True) -> ExperimentPart:
        """Return the part of the page; `every`: runs by name of the scene; `charted`: with charts over frames."""
        found = every[experiment.scene.name]
        style = styles(experiment.charted or experiment.trackers)
        charts = [error_over_frames(experiment, found, style)] if charted else []
        if charted and "fusion_wspf" in experiment.trackers:
            charts.append(scores_over_frames("fusion_wspf", found, style["fusion_wspf"]))
        lines = irsim.find(experiment.scene.path).read_text().splitlines()
        stated = tuple(line.removeprefix("#:").strip() for line in lines if line.startswith("#:"))
        head = experiment.scene.overrides + stated
        return cls(experiment, head, style, rows(experiment, every), list(filter(None, charts)))


@dataclass(frozen=True)
class SweepPart:
    """Charts of a sweep."""

    title: str
    styles: Mapping[str, LineStyle]
    charts: list[str]

    @classmethod
    def of(cls, sweep: Sweep, found: Mapping[str, SceneRuns]) -> SweepPart:
        style = styles(sweep.labels)
        charts = [sweep_chart(sweep, words, figure, found, style) for words, figure in sweep.figures.items()]
        return cls(sweep.title, style, list(filter(None, charts)))


@dataclass(frozen=True)
class PaperPart:
    """All results of a paper."""

    paper: Paper
    experiments: list[ExperimentPart]
    verdicts: list[Verdict]
    goals: list[GoalResult]
    sweeps: list[SweepPart]
    effects: list[Effect]
    speeds: list[Speed]

    @classmethod
    def of(cls, paper: Paper, found: Mapping[str, SceneRuns]) -> PaperPart:
        return cls(
            paper,
            [ExperimentPart.of(experiment, found) for experiment in paper.experiments],
            [verdict(claim, found) for claim in paper.claims],
            [judge_goal(goal, found) for goal in paper.goals],
            [SweepPart.of(sweep, found) for sweep in paper.sweeps],
            [effect(switch, found[switch.scene.name]) for switch in paper.switches],
            speeds(paper, found),
        )


def write_papers(
    folder: Path,
    seeds: int = 50,
    first: int = FIRST_SEED,
    jobs: int = 1,
    only: Sequence[str] = (),
    real: Path | None = None,
    command: str = "",
    progress: Progress | None = None,
    papers: Sequence[Paper] = PAPERS,
) -> Path:
    """Run the experiments and write FOLDER/sources.html; return its path.

    folder   created if missing; FOLDER/sources.db keeps every run, which is then not repeated; FOLDER/sources.json has
             the numbers that the documents cite
    seeds    number of seeds, from `first` on
    only     parts of PARTS; empty: all
    real     folder of labelled sequences, for the table of real recordings; None: no table

    InputError for an unknown part and a folder that cannot be written.
    """
    unknown = [part for part in only if part not in PARTS]
    if unknown:
        raise InputError(f"{unknown[0]}: there is no such part; allowed: {', '.join(PARTS)}")
    for name, number, least in (("seeds", seeds, 1), ("first", first, 0), ("jobs", jobs, 1)):
        whole_number(name, number, least)
    chosen = set(only or PARTS)
    make_folder(folder)
    results = folder / RESULTS
    taken, development = range(first, first + seeds), DEVELOPMENT[:seeds]
    shown = [paper for paper in papers if paper.key in chosen]
    choice_runs = run_plan(plan_choices(shown), results, development, jobs, progress)
    parts = []
    for paper in (settle_choices(paper, choice_runs) for paper in shown):
        found = run_plan(plan_paper(paper), results, taken[: paper.seeds_at_most], jobs, progress)
        parts.append(PaperPart.of(paper, found))
    growth = growth_result(RUNS_A_SEED * seeds, first) if "growth" in chosen else None
    points = points_result(POINT_RUNS_A_SEED * seeds, first) if "points" in chosen else None
    hard, comparisons = None, []
    if "hard" in chosen:
        picked_on = run_plan(plan_hard(OURS), results, development, jobs, progress)
        found = run_plan(plan_hard(OURS | THEIRS), results, taken, jobs, progress)
        hard = [ExperimentPart.of(experiment, found, charted=False) for experiment in HARD]
        comparisons = compare_peers(found, picked_on)
    real_table = []
    if real is not None:
        with TemporaryDirectory() as work:
            real_table = run_real(real, Path(work), results, jobs, progress=progress)
    growth_verdicts = growth.verdicts() if growth else []
    point_verdicts = points.verdicts() if points else []
    verdicts = [each for part in parts for each in part.verdicts] + growth_verdicts + point_verdicts
    derived = [each for part in parts for each in part.paper.derived]
    goals = [each for part in parts for each in part.goals]
    text = render(
        "papers.html.j2",
        "papers",
        parts=parts,
        counts=Counter([each.judgement.word for each in verdicts] + [each.word for each in derived]),
        untested=sum(len(part.paper.untested) for part in parts),
        goals_found=goals,
        goal_counts=Counter([each.word for each in goals] + [each.word for each in comparisons]),
        inf=math.inf,
        speeds=[speed for part in parts for speed in part.speeds],
        growth=growth,
        growth_charts=growth_charts(growth) if growth else [],
        growth_verdicts=growth_verdicts,
        points=points,
        point_verdicts=point_verdicts,
        growth_styles=styles(growth.by_particles) if growth else {},
        hard=hard,
        comparisons=comparisons,
        context=CONTEXT,
        ours=len(OURS),
        theirs=len(PEERS),
        real=real_table,
        seeds=taken,
        development=development,
        fresh=first >= FIRST_SEED,
        rule=RULE,
        loss_rule=LOSS_RULE,
        command=command,
    )
    summary = {
        "commit": commit(),
        "seeds": [taken.start, len(taken)],
        "claims": {part.paper.key: counts(part.paper, part.verdicts) for part in parts if part.verdicts},
        "scenes": {each.experiment.scene.name: rows_summary(each.rows) for part in parts for each in part.experiments},
        "growth": growth_summary(growth) if growth else None,
        "points": points_summary(points) if points else None,
        "verdicts": {part.paper.key: verdict_list(part.verdicts) for part in parts},
    }
    with atomic_text(folder / SUMMARY) as file:
        file.write(json.dumps(summary, indent=1, ensure_ascii=False) + "\n")
    path = folder / PAGE
    with atomic_text(path) as file:
        file.write(text)
    return path
