"""How counts are shown."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.camera.agc import Agc
from irsim.camera.agc_local import Clahe, NestedAgc
from irsim.errors import Notice
from irsim.lint.bare import bare
from irsim.scenario.model import Scenario


def odd_greys(scenario: Scenario) -> Iterator[Notice]:
    """Given counts for black and white that the camera does not give, or that show nothing of the background."""
    camera = scenario.camera
    ends, full = camera.agc.fixed_range(camera.bits), 2**camera.bits - 1
    if ends is None:
        return
    black, white = ends
    of = f"counts of {camera.bits} bits are 0 to {full}"
    if black >= full:
        yield Notice(("camera", "agc", "low"), f"{of}: every picture is black; try less than {full}")
    elif white > full:
        yield Notice(("camera", "agc", "high"), f"{of}: white is never reached; try {full} at most")
    else:
        yield from _even(scenario, black, white)


def _even(scenario: Scenario, black: int, white: int) -> Iterator[Notice]:
    """Where all of the clear sky and of the bare ground or sea is black, or all of it white, noise apart."""
    response = scenario.camera.response()
    signals = [response.signal(part.light.astype(np.float32)).ravel() for part in bare(scenario)]
    if not signals:
        return
    counts = np.clip(np.concatenate(signals) / response.gain + response.offset, 0, response.full)
    least, most = round(float(counts.min())), round(float(counts.max()))
    seen = f"the background's counts, {least} to {most}, are all"
    if 0 < black >= most:
        yield Notice(("camera", "agc", "low"), f"{seen} black; try less than {most}")
    elif response.full > white <= least:
        yield Notice(("camera", "agc", "high"), f"{seen} white; try more than {least}")


FEWEST = 16
"""Pixels of a CLAHE tile: fewer fill less than one in sixteen of 256 greys, so that a tile's curve is a stair of a few
steps, made by noise above all."""


def tiny_tiles(scenario: Scenario) -> Iterator[Notice]:
    """CLAHE with tiles of hardly any pixels, each of which then has a curve of its own noise."""
    camera = scenario.camera
    agc: Agc = camera.agc
    at: tuple[str, ...] = ("camera", "agc")
    while isinstance(agc, NestedAgc) and not isinstance(agc, Clahe):
        agc, at = agc.inner, (*at, "base")
    if not isinstance(agc, Clahe) or agc.clip_limit == 0:
        return
    (columns, rows), (across, down) = camera.size, agc.tiles
    wide, high = math.ceil(columns / across), math.ceil(rows / down)
    if wide * high < FEWEST:
        yield Notice(
            (*at, "tiles"),
            f"each tile of {wide}x{high} px equalises its own noise; try fewer tiles than {across}x{down} "
            f"in {columns}x{rows} px",
        )
