"""Fit of a camera and a background to a recording, written as a scenario."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

from irsim.calibration.figures import FRAMES, Figures, measure_figures
from irsim.calibration.report import fit_summary
from irsim.calibration.scenario_writer import BY, ScenarioWriter
from irsim.calibration.selection import Region, TimedFrames, read_frames, target_boxes
from irsim.errors import InputError
from irsim.render.sources import open_source
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario
from irsim.types import Source

_SEAL = "# A later fit replaces this file as long as nothing is changed in it: "
"""Beginning of the last line of a fitted scenario; the digest of the text above follows."""


@dataclass(frozen=True)
class Fit:
    """Camera and background fitted to a recording.

    figures     in counts, px and frames, with intervals
    text        scenario as YAML, with intervals as comments; its last line has a digest, by which a later
                `irsim fit -o` recognises an unchanged file
    notes       sentences on the limits of the fit
    """

    name: str
    figures: Figures
    text: str
    notes: tuple[str, ...]

    @cached_property
    def scenario(self) -> Scenario:
        return loads(self.text, f"fit of {self.name}")

    def summary(self) -> Iterator[tuple[str, str]]:
        """Yield labels and texts of the figures, to print."""
        return fit_summary(self.figures)

    def as_json(self) -> dict[str, Any]:
        """Return the fit as JSON values."""
        found, flaws = self.figures, self.figures.flaws
        estimates = dict(found.estimates())
        plain = {"flaws.cluster": flaws.cluster if flaws.any else None, "flaws.dead_level": flaws.dead_level}
        return {
            "source": self.name,
            "frames": found.frames,
            "region": list(found.region),
            "mean": found.mean,
            "histogram": list(found.histogram),
            "figures": {name: value.as_json() for name, value in estimates.items()}
            | {name: [value, None, None] for name, value in plain.items() if value is not None},
            "bounds": [name for name, value in estimates.items() if value.bound],
            "notes": list(self.notes),
        }


def fit(
    source: str | PathLike[str] | Scenario | Source,
    region: Region | None = None,
    start: int = 0,
    stop: int | None = None,
) -> Fit:
    """Return the fit to a recording, or to the rendering of a scenario.

    region      window that shows only noise, px; default: the flattest still window outside the targets
    start, stop frames start .. stop-1 are measured; default: the first 300

    Raises InputError where frames are too few or too small, or the source cannot be opened.
    """
    opened = open_source(source)
    last = min(start + FRAMES, len(opened)) if stop is None else min(stop, len(opened))
    return fit_frames(read_frames(opened, range(start, last)), opened, region, start)


def fit_frames(read: TimedFrames, source: Source, region: Region | None = None, start: int = 0) -> Fit:
    """Return the fit to frames that were read from a source, of which the first is frame `start`."""
    counts, times = read
    boxes, top = target_boxes(source, start, start + len(counts)), 2.0**source.bits - 1
    figures = measure_figures(counts, source.rate_hz, region, top, start=start, times=times, boxes=boxes)
    writer = ScenarioWriter(source, figures)
    text = "\n".join(writer.lines(len(counts))) + "\n"
    return Fit(source.name, figures, sealed(text), (*writer.notes, *_refusals(text)))


def _refusals(text: str) -> Iterator[str]:
    """Yield the errors of a fitted scenario that exceeds the limits of scenarios, such as by a small picture or strong
    noise."""
    try:
        loads(text, "the fit")
    except InputError as error:
        yield from (f"irsim render refuses this: {line}" for line in str(error).splitlines())


def sealed(text: str) -> str:
    """Return the text of a fitted scenario with a digest as its last line, which replaces an older digest."""
    before, seal, rest = text.rpartition(_SEAL)
    body = before if seal else rest
    return f"{body}{_SEAL}{hashlib.blake2b(body.encode(), digest_size=16).hexdigest()}\n"


def check_replaced(path: Path | None) -> None:
    """Raise InputError where the file exists and is not an unchanged fitted scenario."""
    if path is None or not path.exists():
        return
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    if _SEAL in text and text == sealed(text):
        return
    if BY not in text.partition("\n")[0]:
        reason = "exists and is no fit"
    else:
        reason = "was changed after irsim fit wrote it" if _SEAL in text else "the last line of a fit is missing"
    raise InputError(f"{path}: {reason}, and a fit would replace it; allowed: another name")
