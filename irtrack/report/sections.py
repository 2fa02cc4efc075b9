"""Sections of the page: metrics, charts, pictures and commands of each source, as values without HTML."""

from __future__ import annotations

import base64
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irsim import IrsimError
from irsim.errors import counted
from irsim.types import Source
from irtrack.metrics.statistics import HALF
from irtrack.report.figure_data import Measured, SeverityFigures, SourceFigures, source_figures
from irtrack.report.frames import Follower, Still, moments, still
from irtrack.report.line_styles import LineStyle
from irtrack.report.plots import Axis, Line, Plots, line_chart, plots
from irtrack.report.repeat import render_command, reopen, run_command
from irtrack.report.replays import Replay, replayed

CHANGED = {
    "recording": "{} is not the recording that was measured, it has changed since.",
    "scenario": "this version of irsim renders the scenario differently.",
}
"""Reasons why the present frames of a source differ from those on which the trackers ran."""


@dataclass
class Budget:
    """Budget of a page: numbers of pictures that may still be added, to limit its size.

    strips    number of sources with a filmstrip;  replays   number of sources with a replay
    repeats   number of runs repeated to obtain their particles
    """

    strips: int = 24
    replays: int = 10
    repeats: int = 24


@dataclass(frozen=True)
class Pictures:
    """Filmstrip and replay of one run of each tracker; `note`: the reason where there are none."""

    stills: tuple[Still, ...] = ()
    replay: Replay | None = None
    note: str = ""


@dataclass(frozen=True)
class Section:
    """Table, charts, pictures and commands of one source.

    facts        short phrases about the source
    plots        None without truth
    seed         seed of the pictures: the one with the most losses
    commands     commands that repeat its runs
    scenario     text of the scenario with that seed; None for a recording
    """

    name: str
    facts: tuple[str, ...]
    figures: SourceFigures
    plots: Plots | None
    pictures: Pictures
    seed: int
    commands: tuple[str, ...]
    scenario: str | None

    @property
    def has_truth(self) -> bool:
        return any(row.scored for row in self.figures.rows)

    @property
    def scenario_link(self) -> str:
        """Scenario as a data link, by which it is saved from the page."""
        text = base64.b64encode((self.scenario or "").encode()).decode()
        return f"data:text/yaml;base64,{text}"


def section(
    measured: Measured,
    figures: SourceFigures,
    styles: Mapping[str, LineStyle],
    budget: Budget | None,
    at_hand: Source | None = None,
) -> Section:
    """Return the section of a source and reduce the budget; with `budget` None it has no charts and pictures.

    at_hand   the open source; by default it is reopened, without running code that it names
    """
    shown = [measured.cells[place] for place in measured.shown]
    source = measured.source
    render = render_command(source, shown[0].key.scene_seed)
    return Section(
        name=source.name,
        facts=_facts(measured),
        figures=figures,
        plots=_plots(measured, figures, styles) if budget and measured.traces else None,
        pictures=_pictures(measured, styles, budget, at_hand) if budget else Pictures(),
        seed=shown[0].key.tracker_seed,
        commands=(*([render] if render else []), *(run_command(cell, source) for cell in shown)),
        scenario=source.text if source.kind == "scenario" else None,
    )


def _plots(measured: Measured, figures: SourceFigures, styles: Mapping[str, LineStyle]) -> Plots | None:
    scenes = {measured.cells[place].key.source_hash: bound for place, bound in measured.bounds.items()}
    return plots(
        measured.traces, figures.survival, styles, measured.source.name, list(scenes.values()), measured.bounded
    )


def _facts(measured: Measured) -> tuple[str, ...]:
    source, cells = measured.source, measured.cells
    seeds = len({cell.key.tracker_seed for cell in cells})
    targets = sorted({cell.key.target or "a box given by the user" for cell in cells if cell.key.task == "single"})
    inputs = sorted({cell.key.input for cell in cells})
    columns, rows = source.size
    # Runs on one scene say nothing about other scenes.
    varied = "scene and tracker change with each" if source.kind == "scenario" else "one scene, only trackers change"
    return (
        source.kind,
        f"{columns} × {rows} px at {source.rate_hz:g} Hz",
        counted(source.length, "frame"),
        f"followed: {', '.join(targets) or 'all targets'}",
        f"trackers see: {', '.join(inputs)}",
        counted(seeds, "seed") + (f" ({varied})" if seeds > 1 else ""),
    )


def _pictures(measured: Measured, styles: Mapping[str, LineStyle], budget: Budget, at_hand: Source | None) -> Pictures:
    if not budget.strips:
        return Pictures(note="No pictures: the page would grow too large; report fewer sources to see them.")
    source = measured.source
    cells, followers = [], []
    for place in measured.shown:
        cell, trace = measured.cells[place], measured.tracks.get(place)
        if trace is not None:
            cells.append(cell)
            followers.append(
                Follower(cell.label, styles[cell.label], trace, cell.score.lost_at if cell.score else None)
            )
    if not followers:
        return Pictures(note="No tracker finished on the seed that is shown: there are no pictures.")
    try:
        found = at_hand or reopen(source)
        if found.hash != source.hash:
            return Pictures(note=f"No pictures: {CHANGED[source.kind].format(source.text)}")
        stills = tuple(
            still(found.frame(index, "display").image, index, why, followers)
            for index, why in moments(followers).items()
        )
        replay = None
        if budget.replays:
            replay, repeated = replayed(found, cells, followers, budget.repeats)
            budget.replays -= 1
            budget.repeats -= repeated
    except IrsimError as error:
        return Pictures(note=f"No pictures: the source cannot be opened any more ({error}).")
    budget.strips -= 1
    return Pictures(stills, replay)


@dataclass(frozen=True, eq=False)
class Chapter:
    """Chapter of the page: one source, or one scenario at all of its severities.

    severities   breaking points; None without severities
    curves       failure curves as an SVG element
    section      section with charts and pictures, at the severity of `main_severity`
    others       sections at the other severities, tables only
    """

    name: str
    severities: SeverityFigures | None
    curves: str
    section: Section
    others: tuple[Section, ...]


def chapters(
    sources: Iterable[Measured], severities: Sequence[SeverityFigures], styles: Mapping[str, LineStyle], budget: Budget
) -> list[Chapter]:
    """Return the chapters in the order of the sources, of which only one is in memory at a time."""
    by_family = {each.family: each for each in severities}
    found: defaultdict[str, list[tuple[int, Section]]] = defaultdict(list)
    for measured in sources:
        cell = measured.cells[0]
        family = by_family.get(cell.family) if cell.severity is not None else None
        is_main = family is None or cell.severity == main_severity(family)
        name = measured.name if family is None else family.family
        made = section(measured, source_figures(measured), styles, budget if is_main else None)
        found[name].append((cell.severity or 0, made))
    return [_chapter(name, by_family.get(name), members, styles) for name, members in found.items()]


def main_severity(family: SeverityFigures) -> int:
    """Return the least severity at which half of all runs are lost, else the highest."""
    points = list(family.breaking.values())
    levels = np.unique(np.concatenate([point.severities for point in points]))
    for level in levels:
        at = [(int(p.runs[k]), int(p.lost[k])) for p in points for k in np.flatnonzero(p.severities == level)]
        if sum(lost for _, lost in at) >= HALF * sum(runs for runs, _ in at):
            return int(level)
    return int(levels[-1])


def _chapter(
    name: str, family: SeverityFigures | None, members: list[tuple[int, Section]], styles: Mapping[str, LineStyle]
) -> Chapter:
    if family is None:
        return Chapter(name, None, "", members[0][1], ())
    main = main_severity(family)
    ordered = sorted(members, key=lambda member: (member[0] != main, member[0]))
    curves = line_chart(
        [Line(styles[label], p.severities, p.shares, p.low, p.high) for label, p in family.breaking.items()],
        Axis("severity"),
        Axis("share of runs lost", (0, 1.02)),
        size=(460, 260),
        name=f"{name}: failure curves",
        level=HALF,
    )
    return Chapter(name, family, curves, ordered[0][1], tuple(made for _, made in ordered[1:]))
