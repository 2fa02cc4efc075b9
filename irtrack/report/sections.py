"""What the report says of each source, gathered from the results file: no HTML here."""

from __future__ import annotations

import base64
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from irsim import IrsimError, Rendering, loads, open_recording
from irsim.types import Source
from irtrack.bench import Cell, Results, SourceRow, SummaryRow, summary
from irtrack.metrics import Trace
from irtrack.report.filmstrip import Follower, Still, moments, still
from irtrack.report.palette import Look
from irtrack.report.plots import Plots, plots
from irtrack.report.repeat import render_command, run_command

CHANGED = {
    "recording": "{} is not the recording that was measured, it has changed since.",
    "scenario": "this version of irsim renders the scenario in another way than the one that measured it.",
}
"""Why the frames at hand are not those that the trackers saw."""


@dataclass(frozen=True)
class Failure:
    """A failed cell: who, on what, and its error text; `more` other cells failed in the same words."""

    label: str
    source: str
    seed: int
    error: str
    more: int

    @property
    def brief(self) -> str:
        """The last line: what was raised."""
        return self.error.strip().splitlines()[-1] if self.error.strip() else "no error text"


@dataclass(frozen=True)
class Section:
    """One source: its table, charts, pictures and commands.

    facts        short phrases about it
    plots        None where there is no truth
    stills       the filmstrip; empty where it cannot be shown, then strip_note says why
    commands     that repeat the first seed
    scenario     the scenario's text with the first seed; None for a recording
    """

    name: str
    facts: tuple[str, ...]
    rows: tuple[SummaryRow, ...]
    plots: Plots | None
    stills: tuple[Still, ...]
    strip_note: str
    strip_seed: int
    commands: tuple[str, ...]
    scenario: str | None

    @property
    def has_truth(self) -> bool:
        return any(row.scored for row in self.rows)

    @property
    def scenario_link(self) -> str:
        """The scenario as a link's target, to be saved from the page."""
        text = base64.b64encode((self.scenario or "").encode()).decode()
        return f"data:text/yaml;base64,{text}"


def sections(results: Results, cells: Sequence[Cell], looks: Mapping[str, Look]) -> list[Section]:
    """A section for each source of the cells, in the order of their names."""
    by_name: defaultdict[str, list[Cell]] = defaultdict(list)
    for cell in cells:
        by_name[cell.source].append(cell)
    known = results.sources()
    return [_section(results, members, known, looks) for _, members in sorted(by_name.items())]


def failures(cells: Sequence[Cell]) -> list[Failure]:
    """The failed cells, one for each tracker, source and error."""
    alike: defaultdict[tuple[str, str, str], list[Cell]] = defaultdict(list)
    for cell in cells:
        if cell.status == "failed":
            last_line = (cell.failure or "").strip().rpartition("\n")[2]
            alike[cell.label, cell.source, last_line].append(cell)
    return [
        Failure(label, source, members[0].key.tracker_seed, members[0].failure or "", len(members) - 1)
        for (label, source, _), members in alike.items()
    ]


def _section(
    results: Results,
    cells: Sequence[Cell],
    known: Mapping[tuple[str, str], SourceRow],
    looks: Mapping[str, Look],
) -> Section:
    # Seeds are paired: all cells of the least seed saw the same frames.
    first = min(cells, key=lambda cell: (cell.key.tracker_seed, cell.label)).key
    seeds = (first.source_hash, first.tracker_seed)
    firsts = [cell for cell in cells if (cell.key.source_hash, cell.key.tracker_seed) == seeds]
    source = known[cells[0].source, first.source_hash]
    traces: dict[str, list[Trace]] = {}
    for cell in cells:
        trace = results.trace(cell.key)
        if trace is not None:
            traces.setdefault(cell.label, []).append(trace)
    followers = [
        Follower(cell.label, looks[cell.label], trace, cell.score.lost_at if cell.score else None)
        for cell in firsts
        if (trace := results.trace(cell.key)) is not None
    ]
    stills, note = _filmstrip(source, followers)
    render = render_command(source, first.scene_seed)
    return Section(
        name=source.name,
        facts=_facts(source, cells),
        rows=tuple(summary(cells)),
        plots=plots(traces, looks, source.name) if traces else None,
        stills=stills,
        strip_note=note,
        strip_seed=first.tracker_seed,
        commands=(*([render] if render else []), *(run_command(cell, source) for cell in firsts)),
        scenario=source.text if source.kind == "scenario" else None,
    )


def _facts(source: SourceRow, cells: Sequence[Cell]) -> tuple[str, ...]:
    seeds = len({cell.key.tracker_seed for cell in cells})
    targets = sorted({cell.key.target or "a box given by the user" for cell in cells})
    inputs = sorted({cell.key.input for cell in cells})
    columns, rows = source.size
    # Runs of one scene are no sample of scenes: say which of the two the intervals speak of.
    varied = "scene and tracker change with each" if source.kind == "scenario" else "one scene, only trackers change"
    return (
        source.kind,
        f"{columns} × {rows} px at {source.rate_hz:g} Hz",
        f"{source.length} frames",
        f"followed: {', '.join(targets)}",
        f"trackers see: {', '.join(inputs)}",
        f"{seeds} seed{'s' if seeds > 1 else ''}" + (f" ({varied})" if seeds > 1 else ""),
    )


def _filmstrip(source: SourceRow, followers: Sequence[Follower]) -> tuple[tuple[Still, ...], str]:
    """The pictures of a source, or why there are none."""
    if not followers:
        return (), "No tracker finished on the first seed: there is nothing to show."
    try:
        opened = _opened(source)
        if opened.hash != source.hash:
            return (), f"No pictures: {CHANGED[source.kind].format(source.text)}"
        stills = tuple(
            still(opened.frame(index, "display").image, index, why, followers)
            for index, why in moments(followers).items()
        )
    except IrsimError as error:
        return (), f"No pictures: the source cannot be opened any more ({error})."
    return stills, ""


def _opened(source: SourceRow) -> Source:
    opened: Source
    if source.kind == "recording":
        opened = open_recording(source.text)
    else:
        opened = Rendering(loads(source.text, source.name, trusted=False), source.name)
    return opened
