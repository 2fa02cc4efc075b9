"""Recorded frames as the background: what they do not say, and what of the camera does nothing to them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from irsim.backgrounds.recorded import UNKNOWN_RANGE_K, Recorded
from irsim.camera.camera import Camera
from irsim.errors import Notice
from irsim.physics.radiometry import limits
from irsim.scenario.model import Scenario
from irsim.types import Band

ALIKE = 0.01
"""A share by which rates and pixels may differ: 29.97 Hz are 30."""

UNTOUCHED = {
    "detector": "detector",
    "netd_mk": "netd_mk",
    "range_k": "range_k",
    "noise": "noise",
    "time_constant_ms": "lag",
    "correction": "correction",
    "falloff": "falloff",
    "bloom": "bloom",
}
"""Keys of a camera by which it makes counts of light, each with the name by which it is switched off, if any."""


def unknown_scale(scenario: Scenario) -> Iterator[Notice]:
    """Something is drawn into frames of which nobody knows what light their counts stand for."""
    background = scenario.background
    if not isinstance(background, Recorded) or background.range_k is not None or not _draws(scenario):
        return
    if background.known(scenario.camera.band) is not None:
        return
    elsewhere = background.recording.camera.curve is not None
    why = "this is told for the band of its own camera only" if elsewhere else "it does not say"
    low, high = UNKNOWN_RANGE_K
    yield Notice(
        ("background", "range_k"),
        f"which temperatures do the counts of {background.file} stand for? {why}: {low:g} K for count 0 and {high:g} K "
        "for the highest are taken, and what is drawn may be far too bright or too dark; to say them, write "
        "range_k: [K of count 0, K of the highest count]",
    )


def unlike_recording(scenario: Scenario) -> Iterator[Notice]:
    """The scenario's camera is another than the one that the recording tells of."""
    background, camera = scenario.background, scenario.camera
    if not isinstance(background, Recorded):
        return
    recording = background.recording
    facts, file = recording.camera, background.file
    if facts.band is not None and not _same_band(scenario, background):
        yield Notice(
            ("camera", "band"),
            f"the camera sees {_um(camera.band)}, but {file} was taken in {_um(facts.band)}: what is drawn has light "
            f"of another band than what is behind it; the recording's is band: {_yaml(facts.band)}",
        )
    if not math.isclose(recording.rate_hz, camera.rate_hz, rel_tol=ALIKE):
        yield Notice(
            ("camera", "rate_hz"),
            f"the camera takes {camera.rate_hz:g} frames a second, but {file} has {recording.rate_hz:g}: what was "
            f"recorded passes {camera.rate_hz / recording.rate_hz:.3g} times as fast as it was",
        )
    seen = camera.geometry.ifov_rad * 1e3
    if facts.ifov_rad is not None and not math.isclose(facts.ifov_rad * 1e3, seen, rel_tol=ALIKE):
        own = facts.ifov_rad * 1e3
        yield Notice(
            ("camera", "ifov_mrad"),
            f"a pixel sees {seen:g} mrad, but one of {file} sees {own:.6g}: what is drawn is {own / seen:.3g} times as "
            "large as it would have been there",
        )


def untouched(scenario: Scenario) -> Iterator[Notice]:
    """Keys of the camera that do nothing to frames that a camera has taken already."""
    camera, background = scenario.camera, scenario.background
    if not background.has_noise:
        return
    moved = [index for index, motion in enumerate(camera.motion) if scenario.is_on(motion.name)]
    if moved and not background.mapped:
        yield Notice(
            ("camera", "motion", moved[0]),
            "moves what is drawn, but not the recorded frames behind it, which stay as they are",
        )
    for key, name in UNTOUCHED.items():
        given = {"preset": camera.preset} | ({"detector": camera.detector} if key == "noise" else {})
        if getattr(camera, key) != Camera.default_for(key, given) and scenario.is_on(name):
            yield Notice(
                ("camera", key),
                "does nothing here: counts are those of the recording, and what is drawn into them follows its scale",
            )


def _draws(scenario: Scenario) -> bool:
    """Whether there is anything that is put into the frames."""
    return any(map(scenario.is_on, (*(each.id for each in scenario.targets), *(o.name for o in scenario.occluders))))


def _same_band(scenario: Scenario, background: Recorded) -> bool:
    band = background.recording.camera.band
    return band is not None and limits(band) == limits(scenario.camera.band)


def _um(band: Band) -> str:
    return "{:g} to {:g} um".format(*limits(band))


def _yaml(band: Band) -> str:
    return band if isinstance(band, str) else str(list(band))
