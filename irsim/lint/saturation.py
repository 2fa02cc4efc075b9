"""Warnings about saturated pixels and about grey scales that clip."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from irsim.backgrounds import Background
from irsim.camera.agc import Agc
from irsim.camera.agc_local import Clahe, NestedAgc
from irsim.camera.camera import Camera
from irsim.camera.sensor import Sensor
from irsim.config.quantities import SCALE_K
from irsim.errors import Notice
from irsim.geometry.context import SceneContext
from irsim.lint.sampling import elevation_range
from irsim.physics.radiometry import temperature
from irsim.render.exposure import Instant
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import sampled_frames
from irsim.types import Floats

_LARGE_PART = 0.2
"""Least fraction of the picture whose saturation is reported: sun glint on waves always saturates a little."""
_ROUND_K = 10.0
"""Step, K, to which the ends of a proposed `range_k` are rounded."""
_FEWEST = 16
"""Least pixels of a CLAHE tile: fewer fill less than a sixteenth of 256 grey levels, so that noise shapes its curve."""
_GROUND_FRAMES = 3
"""Number of evenly spread frames at which the radiance of ground and sea is sampled."""
_SKY_ELEVATIONS = 65
"""Number of evenly spread elevations at which the radiance of a clear sky is sampled."""


def background_saturated(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a clear sky, ground or sea that saturates completely or in a large part of the picture."""
    camera, response = scenario.camera, scenario.camera.response()
    for name, light, share in _regions(scenario):
        signal = response.signal(light.astype(np.float32))
        least, most = temperature(scenario.context.band, np.array([light.min(), light.max()])).tolist()
        for beyond, above, lies in (
            (signal >= response.top, True, "above{}: its pixels are full"),
            (signal <= response.bottom, False, "below{}: its pixels are at count 0"),
        ):
            part = float(beyond.mean())
            if part == 1 or part * share >= _LARGE_PART:
                of, where = "all", ""
                if part < 1:
                    of, where = (f"{math.floor(100 * each)}%" for each in (part, part * share))
                    where = f", in {where} of the picture"
                yield Notice(
                    ("camera", *_scale(camera.detector)),
                    f"{of} of {name}, {least:.0f} to {most:.0f} K, lies {lies.format(where)}"
                    + _remedy(camera, least, most, above),
                )


def _scale(detector: Sensor) -> tuple[str, ...]:
    """Return the path, below the camera, of the key that sets the scale from radiance to counts."""
    if "range_k" in detector.camera_keys:
        return ("range_k",)
    return ("detector",) if detector.integration_key is None else ("detector", detector.integration_key)


def _remedy(camera: Camera, least: float, most: float, above: bool) -> str:
    """Return the text that proposes a scale for temperatures from `least` to `most`, K; empty if there is none."""
    if "range_k" not in camera.detector.camera_keys:
        return f"; try a shorter {camera.detector.integration_key}" if above and camera.detector.integration_key else ""
    (low, high), (lowest, highest) = camera.range_k, SCALE_K
    low = min(low, max(math.floor((least - 1) / _ROUND_K) * _ROUND_K, lowest))
    high = max(high, math.ceil((most + 1) / _ROUND_K) * _ROUND_K)
    return f"; range_k: [{low:g}, {high:g}] holds it" if low < least and high <= highest else ""


def agc_range_unused(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a fixed grey scale with an end outside the counts, or one that makes all the background black or
    white."""
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
        yield from _background_clipped(scenario, black, white)


def _background_clipped(scenario: Scenario, black: int, white: int) -> Iterator[Notice]:
    """Yield the warning of a background that is all black or all white, clutter and noise aside."""
    response = scenario.camera.response()
    signals = [response.signal(part.light.astype(np.float32)).ravel() for part in _regions(scenario)]
    if not signals:
        return
    counts = np.clip(np.concatenate(signals) / response.gain + response.offset, 0, response.full)
    least, most = round(float(counts.min())), round(float(counts.max()))
    counted = f"the background's counts, {least} to {most}, are all"
    if 0 < black >= most:
        yield Notice(("camera", "agc", "low"), f"{counted} black; try less than {most}")
    elif response.full > white <= least:
        yield Notice(("camera", "agc", "high"), f"{counted} white; try more than {least}")


def clahe_tiles_too_small(scenario: Scenario) -> Iterator[Notice]:
    """Warn of CLAHE tiles with so few pixels that each tile equalises its own noise."""
    camera = scenario.camera
    agc: Agc = camera.agc
    at: tuple[str, ...] = ("camera", "agc")
    while isinstance(agc, NestedAgc) and not isinstance(agc, Clahe):
        agc, at = agc.inner, (*at, "base")
    if not isinstance(agc, Clahe) or agc.clip_limit == 0:
        return
    (columns, rows), (across, down) = camera.size, agc.tiles
    wide, high = math.ceil(columns / across), math.ceil(rows / down)
    if wide * high < _FEWEST:
        yield Notice(
            (*at, "tiles"),
            f"each tile of {wide}x{high} px equalises its own noise; try fewer tiles than {across}x{down} "
            f"in {columns}x{rows} px",
        )


class _Region(NamedTuple):
    """Region of a background without objects: name, samples of its radiance, W/m2/sr, and fraction of the picture."""

    name: str
    light: Floats
    share: float


def _regions(scenario: Scenario) -> Iterator[_Region]:
    """Yield the visible clear sky of the camera at rest, and the visible ground or sea."""
    background, context = scenario.background, scenario.context
    bottom, top = elevation_range(context)
    lowest = bottom if background.surface_m is None else max(bottom, 0.0)
    clear = background.clear(context)
    if clear is not None and top > lowest:
        elevations = np.linspace(lowest, top, _SKY_ELEVATIONS)[None]
        yield _Region("the clear sky", clear.radiance(elevations), (top - lowest) / (top - bottom))
    still = Instant.of(scenario.model_copy(update={"targets": ()}), context)  # trajectories of targets are not needed
    camera = still.camera
    motion = tuple(each.tobytes() for each in (camera.turns, camera.places, camera.zooms))
    below = _ground_radiance(_GroundView(background.bare, context, scenario.frames, motion, still))
    if below.size:
        pixels = math.prod(context.geometry.size) * min(scenario.frames, _GROUND_FRAMES)
        yield _Region(f"the {background.surface}", below, below.size / pixels)


@dataclass(frozen=True)
class _GroundView:
    """Values that determine the radiance of ground or sea without objects: a cache key, equal at many severities."""

    background: Background = field(hash=False)
    context: SceneContext = field(hash=False)
    frames: int
    motion: tuple[bytes, ...]
    instant: Instant = field(compare=False)


@lru_cache(maxsize=1)
def _ground_radiance(view: _GroundView) -> Floats:
    """Return the radiance of ground or sea, W/m2/sr, at its visible pixels in _GROUND_FRAMES frames, (n,). The result
    is cached for all warnings and severities."""
    light = view.background.ground_radiance(view.context)
    if light is None:
        return np.zeros(0)
    frames = sampled_frames(view.frames, _GROUND_FRAMES).astype(int).tolist()
    below = np.concatenate([light(view.instant.view_direction(frame)) for frame in frames])
    below.setflags(write=False)
    return below
