"""The chapters of the page: a source each, or a scenario at all of its severities."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irtrack.metrics.statistics import HALF
from irtrack.report.figure_data import Measured, SeverityFigures, source_figures
from irtrack.report.plots import Axis, Line, LineStyle, line_chart
from irtrack.report.sections import Room, Section, section


@dataclass(frozen=True, eq=False)
class Chapter:
    """What is said under one heading.

    severities   where each tracker breaks, and the failure curves as an SVG element; None of a source without
    section      the source with its charts and pictures, at the severity that tells most
    others       at the other severities, tables only
    """

    name: str
    severities: SeverityFigures | None
    curves: str
    section: Section
    others: tuple[Section, ...]


def chapters(
    sources: Iterable[Measured], severities: Sequence[SeverityFigures], styles: Mapping[str, LineStyle], room: Room
) -> list[Chapter]:
    """The chapters in the order of the sources; a source is held in memory only while its section is made."""
    by_family = {each.family: each for each in severities}
    found: defaultdict[str, list[tuple[int, Section]]] = defaultdict(list)
    for measured in sources:
        cell = measured.cells[0]
        family = by_family.get(cell.family) if cell.severity is not None else None
        is_told = family is None or cell.severity == telling(family)
        name = measured.name if family is None else family.family
        made = section(measured, source_figures(measured), styles, room if is_told else None)
        found[name].append((cell.severity or 0, made))
    return [_chapter(name, by_family.get(name), members, styles) for name, members in found.items()]


def telling(family: SeverityFigures) -> int:
    """The least severity at which half of all runs are lost; the highest where none is."""
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
    told = telling(family)
    ordered = sorted(members, key=lambda member: (member[0] != told, member[0]))
    curves = line_chart(
        [Line(styles[label], p.severities, p.shares, p.low, p.high) for label, p in family.breaking.items()],
        Axis("severity"),
        Axis("share of runs lost", (0, 1.02)),
        size=(460, 260),
        name=f"{name}: failure curves",
        level=HALF,
    )
    return Chapter(name, family, curves, ordered[0][1], tuple(made for _, made in ordered[1:]))
