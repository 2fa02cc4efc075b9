"""From somebody's own recording to a scenario: its camera, and a background like the one it saw."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import Any

from irsim.errors import InputError
from irsim.fitting.scene import Scene
from irsim.fitting.summary import summary_lines
from irsim.fitting.written import check_replaced, sealed
from irsim.measure import FRAMES, Figures, Region, Timed, measure_figures, read_timed
from irsim.measure.boxes import boxes_of_targets
from irsim.render.sources import open_source
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario
from irsim.types import Source


@dataclass(frozen=True)
class Fit:
    """What a recording tells of its camera and background, and a scenario that has it.

    figures     in counts, px and frames, with intervals
    text        the scenario as YAML, with the ranges as comments; `irsim render` takes it. Its last line tells a later
                `irsim fit -o` that nothing in it was changed
    notes       what could not be told, and what was taken for it; what limits all figures first
    """

    name: str
    figures: Figures
    text: str
    notes: tuple[str, ...]

    @cached_property
    def scenario(self) -> Scenario:
        return loads(self.text, f"fit of {self.name}")

    def summary(self) -> Iterator[tuple[str, str]]:
        """Labels and texts of what was found, for people."""
        return summary_lines(self.figures)

    def _ages(self) -> dict[str, float | None]:
        """Times since a correction, of those figures whose noise began at one; None where it was always there."""
        found = self.figures
        lines = {"rows": found.rows, "columns": found.columns}
        ages = {"memory": found.memory_age_s} | {name: each.age_s for name, each in lines.items() if each is not None}
        return {name: age if math.isfinite(age) else None for name, age in ages.items()}

    def _of_bad_pixels(self) -> dict[str, list[float | None]]:
        """Figures of them that have no interval."""
        bad = self.figures.flaws
        found = {"cluster": bad.cluster if self.figures.flawed else None, "dead_level": bad.dead_level}
        return {f"flaws.{name}": [value, None, None] for name, value in found.items() if value is not None}

    def as_json(self) -> dict[str, Any]:
        """Plain values, ready for json.dumps."""
        measured = dict(self.figures.measured())
        return {
            "source": self.name,
            "frames": self.figures.frames,
            "region": list(self.figures.region),
            "mean": self.figures.mean,
            "histogram": list(self.figures.histogram),
            "figures": {name: m.as_json() for name, m in measured.items()} | self._of_bad_pixels(),
            "ages_s": self._ages(),
            "bounds": [name for name, m in measured.items() if m.bound],
            "notes": list(self.notes),
        }


def fit(
    source: str | PathLike[str] | Scenario | Source,
    region: Region | None = None,
    start: int = 0,
    stop: int | None = None,
) -> Fit:
    """Measure a recording (or a scenario, rendered for it) and write a scenario with its camera and background.

    region      where only noise is seen, px; the flattest still window, off truth's boxes, where not given
    start, stop frames that are looked at; the first 300 where not given

    InputError where frames are too few or too small, or a source cannot be opened.
    """
    opened = open_source(source)
    last = min(start + FRAMES, len(opened)) if stop is None else min(stop, len(opened))
    return fit_frames(read_timed(opened, range(start, last)), opened, region, start)


def fit_frames(
    read: Timed,
    source: Source,
    region: Region | None = None,
    start: int = 0,
) -> Fit:
    """The same of frames that were read from a source already, from frame `start` on."""
    stack, times = read
    boxes = boxes_of_targets(source, start, start + len(stack))
    top = 2.0**source.bits - 1
    figures = measure_figures(stack, source.rate_hz, region, top, start=start, times=times, boxes=boxes)
    scene = Scene.of(source, figures)
    lines = "\n".join(scene.lines(len(stack)))
    notes = (*scene.notes, *_refused(lines))
    return Fit(source.name, figures, sealed(lines + "\n"), notes)


def _refused(text: str) -> Iterator[str]:
    """What of a fit no scenario can say: pictures may be smaller, and noise more, than any camera's."""
    try:
        loads(text, "the fit")
    except InputError as error:
        yield from (f"irsim render refuses this: {line}" for line in str(error).splitlines())


__all__ = ["Fit", "check_replaced", "fit", "fit_frames", "sealed"]
