"""The page: one HTML file with every experiment, claim and switch."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

import irsim
from irsim.recording.output import atomic_text, make_folder
from irtrack.errors import InputError, whole_number
from irtrack.external import PEERS
from irtrack.metrics.loss import LOSS_RULE
from irtrack.papers.cheng import CHENG
from irtrack.papers.cost import COST
from irtrack.papers.digests import AN, CAMSHIFT, CUI
from irtrack.papers.figures import growth_charts, over_frames, scores_over_frames, swept
from irtrack.papers.goals import Reached, reached
from irtrack.papers.growth import RUNS_A_SEED, GrowthResult, growth_result
from irtrack.papers.hard import HARD, Duel, duels, wanted_hard
from irtrack.papers.li import LI
from irtrack.papers.ours import CONTEXT, OURS, THEIRS
from irtrack.papers.picks import settled, wanted_choices
from irtrack.papers.real import RealRow, real_rows
from irtrack.papers.runs import DEVELOPMENT, FIRST_SEED, Outcome, Progress, outcomes, wanted
from irtrack.papers.tables import Row, Speed, rows, speeds
from irtrack.papers.values import Experiment, Paper
from irtrack.papers.verdicts import RULE, Effect, Verdict, effect, verdict
from irtrack.papers.xue import XUE
from irtrack.report.palette import LineStyle, styles

PAPERS = (CHENG, XUE, AN, CUI, CAMSHIFT, LI, COST)
PARTS = (*(paper.key for paper in PAPERS), "growth", "hard")
RESULTS = "sources.db"
PAGE = "sources.html"


@dataclass(frozen=True)
class ExperimentPart:
    experiment: Experiment
    head: tuple[str, ...]
    styles: Mapping[str, LineStyle]
    rows: list[Row]
    charts: list[str]


@dataclass(frozen=True)
class SweepPart:
    title: str
    styles: Mapping[str, LineStyle]
    charts: list[str]


@dataclass(frozen=True)
class PaperPart:
    paper: Paper
    experiments: list[ExperimentPart]
    verdicts: list[Verdict]
    goals: list[Reached]
    sweeps: list[SweepPart]
    effects: list[Effect]


@dataclass(frozen=True)
class HardPart:
    experiments: list[ExperimentPart]
    duels: list[Duel]


def write_sources(
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
    """Run the experiments and write FOLDER/sources.html; its path.

    folder   made where it is not there; FOLDER/sources.db keeps every run, which is then not run again
    seeds    how many, from `first` on
    only     parts of PARTS; all where none is named
    real     a folder of labelled sequences for the table of real recordings

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
    taken = range(first, first + seeds)
    development = DEVELOPMENT[:seeds]
    shown = [paper for paper in papers if paper.key in chosen]
    picked_by = outcomes(wanted_choices(shown), results, development, jobs, progress)
    parts = []
    for paper in (settled(paper, picked_by) for paper in shown):
        found = outcomes(wanted([paper]), results, taken[: paper.seeds_at_most], jobs, progress)
        parts.append((paper_part(paper, found), speeds(paper, found)))
    growth = growth_result(RUNS_A_SEED * seeds, first) if "growth" in chosen else None
    hard = None
    if "hard" in chosen:
        made_on = outcomes(wanted_hard(OURS), results, development, jobs, progress)
        fought = outcomes(wanted_hard(OURS | THEIRS), results, taken, jobs, progress)
        hard = HardPart([experiment_part(experiment, fought) for experiment in HARD], duels(fought, made_on))
    real_table: list[RealRow] = []
    if real is not None:
        with TemporaryDirectory() as work:
            real_table = real_rows(real, Path(work), results, jobs, progress=progress)
    then_and_now = [speed for _, speeds in parts for speed in speeds]
    text = render([part for part, _ in parts], then_and_now, growth, hard, real_table, taken, development, command)
    path = folder / PAGE
    with atomic_text(path) as file:
        file.write(text)
    return path


def paper_part(paper: Paper, found: Mapping[str, Outcome]) -> PaperPart:
    """All that the page says of a paper."""
    sweeps = []
    for sweep in paper.sweeps:
        style = styles(sweep.labels)
        charts = [swept(sweep, name, of, found, style) for name, of in sweep.figures.items()]
        sweeps.append(SweepPart(sweep.title, style, [chart for chart in charts if chart]))
    return PaperPart(
        paper,
        [experiment_part(experiment, found) for experiment in paper.experiments],
        [verdict(claim, found) for claim in paper.claims],
        [reached(goal, found) for goal in paper.goals],
        sweeps,
        [effect(switch, found[switch.scene.name]) for switch in paper.switches],
    )


def experiment_part(experiment: Experiment, every: Mapping[str, Outcome]) -> ExperimentPart:
    """The table and the charts of an experiment; `every`: the outcomes by scene."""
    found = every[experiment.scene.name]
    style = styles(experiment.charted or experiment.trackers)
    charts = [] if experiment in HARD else [over_frames(experiment, found, style)]  # too many lines to tell apart
    if "fusion_wspf" in experiment.trackers and experiment not in HARD:
        charts.append(scores_over_frames("fusion_wspf", found, style["fusion_wspf"]))
    head = scene_head(experiment)
    return ExperimentPart(experiment, head, style, rows(experiment, every), [chart for chart in charts if chart])


def scene_head(experiment: Experiment) -> tuple[str, ...]:
    """The measured figures that a scenario's head states, and what is changed of it."""
    lines = irsim.find(experiment.scene.path).read_text().splitlines()
    measured = tuple(line.removeprefix("#:").strip() for line in lines if line.startswith("#:"))
    return experiment.scene.overrides + measured


def render(
    parts: Sequence[PaperPart],
    speed: Sequence[Speed],
    growth: GrowthResult | None,
    hard: HardPart | None,
    real: Sequence[RealRow],
    seeds: range,
    development: range,
    command: str,
) -> str:
    """The page as HTML text."""
    growth_verdicts = growth.verdicts() if growth else []
    every = [each for part in parts for each in part.verdicts] + growth_verdicts
    goals = [each for part in parts for each in part.goals]
    environment = Environment(
        loader=ChoiceLoader([PackageLoader("irtrack", "papers"), PackageLoader("irtrack", "report")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"px": px, "percent": percent}
    return environment.get_template("sources.html.j2").render(
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        parts=parts,
        counts=Counter(each.judgement.word for each in every),
        untested=sum(len(part.paper.untested) for part in parts),
        goals_found=goals,
        inf=math.inf,
        goal_counts=Counter(each.word for each in goals) + Counter(each.word for each in (hard.duels if hard else [])),
        speeds=speed,
        growth=growth,
        growth_charts=growth_charts(growth) if growth else [],
        growth_verdicts=growth_verdicts,
        growth_styles=styles(growth.by_particles) if growth else {},
        hard=hard,
        context=CONTEXT,
        ours=len(OURS),
        theirs=len(PEERS),
        real=real,
        seeds=seeds,
        development=development,
        fresh=seeds.start >= FIRST_SEED,
        rule=RULE,
        loss_rule=LOSS_RULE,
        command=command,
    )


def px(value: float | None) -> str:
    """Pixels with two digits, or three figures where that is more."""
    return "–" if value is None else f"{value:.2f}" if abs(value) < 100 else f"{value:.0f}"


def percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.0f} %"
