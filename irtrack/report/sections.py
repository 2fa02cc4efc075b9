"""What the page says of each source: its figures, charts, pictures and commands; no HTML here."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass

from irsim import IrsimError
from irsim.errors import counted
from irsim.types import Source
from irtrack.report.figures import SourceFigures
from irtrack.report.filmstrip import Follower, Still, moments, still
from irtrack.report.measured import Measured
from irtrack.report.opening import opened
from irtrack.report.palette import LineStyle
from irtrack.report.plots import Plots, plots
from irtrack.report.repeat import render_command, run_command
from irtrack.report.replays import Replay, replayed

CHANGED = {
    "recording": "{} is not the recording that was measured, it has changed since.",
    "scenario": "this version of irsim renders the scenario in another way than the one that measured it.",
}
"""Why the frames at hand are not those that the trackers saw."""


@dataclass
class Room:
    """What is left of the page: it must stay one that a browser opens.

    strips    sources that may still have a filmstrip;  replays  those that may still have a replay
    repeats   runs that may still be repeated for their particles
    """

    strips: int = 24
    replays: int = 10
    repeats: int = 24


@dataclass(frozen=True)
class Pictures:
    """The filmstrip and the replay of one run of each tracker; without them `note` says why."""

    stills: tuple[Still, ...] = ()
    replay: Replay | None = None
    note: str = ""


@dataclass(frozen=True)
class Section:
    """One source: its table, charts, pictures and commands.

    facts        short phrases about it
    plots        None where there is no truth
    seed         of the run that is shown: the one in which most trackers are lost
    commands     that repeat it
    scenario     the scenario's text with that seed; None for a recording
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
        """The scenario as a link's target, to be saved from the page."""
        text = base64.b64encode((self.scenario or "").encode()).decode()
        return f"data:text/yaml;base64,{text}"


def section(
    measured: Measured,
    figures: SourceFigures,
    styles: Mapping[str, LineStyle],
    room: Room | None,
    at_hand: Source | None = None,
) -> Section:
    """The section of a source; what it takes of the room is taken off. Without room: no charts, no pictures.

    at_hand   the source, where the caller has it: what is opened by a results file runs no code that it names
    """
    shown = [measured.cells[place] for place in measured.shown]
    source = measured.source
    render = render_command(source, shown[0].key.scene_seed)
    return Section(
        name=source.name,
        facts=_facts(measured),
        figures=figures,
        plots=plots(measured.traces, figures.survival, styles, source.name) if room and measured.traces else None,
        pictures=_pictures(measured, styles, room, at_hand) if room else Pictures(),
        seed=shown[0].key.tracker_seed,
        commands=(*([render] if render else []), *(run_command(cell, source) for cell in shown)),
        scenario=source.text if source.kind == "scenario" else None,
    )


def _facts(measured: Measured) -> tuple[str, ...]:
    source, cells = measured.source, measured.cells
    seeds = len({cell.key.tracker_seed for cell in cells})
    targets = sorted({cell.key.target or "a box given by the user" for cell in cells})
    inputs = sorted({cell.key.input for cell in cells})
    columns, rows = source.size
    # Runs of one scene are no sample of scenes: say which of the two the intervals speak of.
    varied = "scene and tracker change with each" if source.kind == "scenario" else "one scene, only trackers change"
    return (
        source.kind,
        f"{columns} × {rows} px at {source.rate_hz:g} Hz",
        counted(source.length, "frame"),
        f"followed: {', '.join(targets)}",
        f"trackers see: {', '.join(inputs)}",
        counted(seeds, "seed") + (f" ({varied})" if seeds > 1 else ""),
    )


def _pictures(measured: Measured, styles: Mapping[str, LineStyle], room: Room, at_hand: Source | None) -> Pictures:
    if not room.strips:
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
        return Pictures(note="No tracker finished on the seed that is shown: there is nothing to see.")
    try:
        found = at_hand or opened(source)
        if found.hash != source.hash:
            return Pictures(note=f"No pictures: {CHANGED[source.kind].format(source.text)}")
        stills = tuple(
            still(found.frame(index, "display").image, index, why, followers)
            for index, why in moments(followers).items()
        )
        replay = None
        if room.replays:
            replay, repeated = replayed(found, cells, followers, room.repeats)
            room.replays -= 1
            room.repeats -= repeated
    except IrsimError as error:
        return Pictures(note=f"No pictures: the source cannot be opened any more ({error}).")
    room.strips -= 1
    return Pictures(stills, replay)
