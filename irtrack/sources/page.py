"""The page: one HTML file with every experiment, claim and switch."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

import irsim
from irsim.files import replacing_text
from irtrack.errors import InputError
from irtrack.metrics.loss import LOSS_RULE
from irtrack.report.palette import Look, looks
from irtrack.sources.cheng import CHENG
from irtrack.sources.digests import AN, CUI
from irtrack.sources.figures import growth_charts, over_frames, scores_over_frames, swept
from irtrack.sources.growth import RUNS_A_SEED, GrowthResult, growth_result
from irtrack.sources.hard import CONTEXT, HARD, OURS, THEIRS, Duel, duels, wanted_hard
from irtrack.sources.li import LI
from irtrack.sources.real import RealRow, real_rows
from irtrack.sources.runs import FIRST_SEED, Outcome, Progress, outcomes, wanted
from irtrack.sources.tables import Row, Speed, rows, speeds
from irtrack.sources.values import Experiment, Paper
from irtrack.sources.verdicts import RULE, Effect, Verdict, effect, verdict
from irtrack.sources.xue import XUE

PAPERS = (CHENG, XUE, AN, CUI, LI)
PARTS = (*(paper.key for paper in PAPERS), "growth", "hard")
RESULTS = "sources.db"
PAGE = "sources.html"


@dataclass(frozen=True)
class ExperimentPart:
    experiment: Experiment
    head: tuple[str, ...]
    looks: Mapping[str, Look]
    rows: list[Row]
    charts: list[str]


@dataclass(frozen=True)
class SweepPart:
    title: str
    looks: Mapping[str, Look]
    charts: list[str]


@dataclass(frozen=True)
class PaperPart:
    paper: Paper
    experiments: list[ExperimentPart]
    verdicts: list[Verdict]
    sweeps: list[SweepPart]
    effects: list[Effect]


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
    chosen = set(only or PARTS)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
    results = folder / RESULTS
    shown = [paper for paper in papers if paper.key in chosen]
    taken = range(first, first + seeds)
    found = outcomes(wanted(shown), results, taken, jobs, progress)
    parts = [paper_part(paper, found) for paper in shown]
    growth = growth_result(RUNS_A_SEED * seeds, first) if "growth" in chosen else None
    hard = outcomes(wanted_hard(), results, taken, jobs, progress) if "hard" in chosen else {}
    real_table: list[RealRow] = []
    if real is not None:
        with TemporaryDirectory() as work:
            real_table = real_rows(real, Path(work), results, jobs)
    text = render(parts, speeds(shown, found), growth, hard, real_table, taken, command)
    path = folder / PAGE
    with replacing_text(path) as file:
        file.write(text)
    return path


def paper_part(paper: Paper, found: Mapping[str, Outcome]) -> PaperPart:
    """All that the page says of a paper."""
    sweeps = []
    for sweep in paper.sweeps:
        look = looks(sweep.labels)
        charts = [swept(sweep, name, of, found, look) for name, of in sweep.figures.items()]
        sweeps.append(SweepPart(sweep.title, look, [chart for chart in charts if chart]))
    return PaperPart(
        paper,
        [experiment_part(experiment, found) for experiment in paper.experiments],
        [verdict(claim, found) for claim in paper.claims],
        sweeps,
        [effect(switch, found[switch.scene.name]) for switch in paper.switches],
    )


def experiment_part(experiment: Experiment, every: Mapping[str, Outcome]) -> ExperimentPart:
    """The table and the charts of an experiment; `every`: the outcomes by scene."""
    found = every[experiment.scene.name]
    look = looks(experiment.trackers)
    charts = [] if experiment in HARD else [over_frames(experiment, found, look)]  # too many lines to tell apart
    if "fusion_wspf" in experiment.trackers and experiment not in HARD:
        charts.append(scores_over_frames("fusion_wspf", found, look["fusion_wspf"]))
    head = scene_head(experiment)
    return ExperimentPart(experiment, head, look, rows(experiment, every), [chart for chart in charts if chart])


def scene_head(experiment: Experiment) -> tuple[str, ...]:
    """The measured figures that a scenario's head states."""
    lines = irsim.find(experiment.scene.path).read_text().splitlines()
    return tuple(line.removeprefix("#:").strip() for line in lines if line.startswith("#:"))


def render(
    parts: Sequence[PaperPart],
    speed: Sequence[Speed],
    growth: GrowthResult | None,
    hard: Mapping[str, Outcome],
    real: Sequence[RealRow],
    seeds: range,
    command: str,
) -> str:
    """The page as HTML text."""
    every = [each for part in parts for each in part.verdicts] + (growth.verdicts() if growth else [])
    environment = Environment(
        loader=ChoiceLoader([PackageLoader("irtrack", "sources"), PackageLoader("irtrack", "report")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"px": px, "percent": percent}
    found_duels: list[Duel] = duels(hard) if hard else []
    return environment.get_template("sources.html.j2").render(
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        parts=parts,
        counts=Counter(each.word for each in every),
        speeds=speed,
        growth=growth,
        growth_charts=growth_charts(growth) if growth else [],
        growth_verdicts=growth.verdicts() if growth else [],
        growth_looks=looks(growth.by_particles) if growth else {},
        hard=[experiment_part(experiment, hard) for experiment in HARD] if hard else [],
        duels=found_duels,
        context=CONTEXT,
        ours=len(OURS),
        theirs=len(THEIRS),
        real=real,
        seeds=seeds,
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
