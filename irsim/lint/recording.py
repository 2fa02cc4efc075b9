"""Warnings about recorded frames as the background, and about camera keys without effect on them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from irsim.backgrounds.recorded import UNKNOWN_RANGE_K, Recorded
from irsim.camera.camera import Camera
from irsim.errors import Notice
from irsim.physics.radiometry import limits
from irsim.scenario.model import Scenario
from irsim.types import Band

_TOLERANCE = 0.01
"""Relative tolerance of frame rates and angles of a pixel: 29.97 Hz count as 30 Hz."""
_WITHOUT_EFFECT = {
    "detector": "detector",
    "netd_mk": "netd_mk",
    "range_k": "range_k",
    "noise": "noise",
    "time_constant_ms": "lag",
    "correction": "correction",
    "falloff": "falloff",
    "bloom": "bloom",
}
"""Keys of a camera that turn radiance into counts, each with the name under which `without` switches it off."""


def recording_scale_unknown(scenario: Scenario) -> Iterator[Notice]:
    """Warn of objects drawn into recorded frames if the radiance of the recording's counts is unknown."""
    background = scenario.background
    if not isinstance(background, Recorded) or background.range_k is not None or not _draws_objects(scenario):
        return
    if background.known(scenario.camera.band) is not None:
        return
    elsewhere = background.recording.camera.curve is not None
    reason = "it gives them for its own band only" if elsewhere else "it does not say"
    low, high = UNKNOWN_RANGE_K
    yield Notice(
        ("background", "range_k"),
        f"the temperatures of the counts of {background.file} are unknown ({reason}): {low:g} K for count 0 and "
        f"{high:g} K for the highest are assumed, and drawn objects may be far too bright or too dark; to set them, "
        "write range_k: [K of count 0, K of the highest count]",
    )


def recording_camera_mismatch(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a camera whose band, frame rate or pixel angle differs from the recording's."""
    background, camera = scenario.background, scenario.camera
    if not isinstance(background, Recorded):
        return
    recording = background.recording
    facts, file = recording.camera, background.file
    if facts.band is not None and not _same_band(scenario, background):
        yield Notice(
            ("camera", "band"),
            f"the camera sees {_um(camera.band)}, but {file} was taken in {_um(facts.band)}: drawn objects have the "
            f"radiance of another band than the background; the recording's is band: {_yaml(facts.band)}",
        )
    if not math.isclose(recording.rate_hz, camera.rate_hz, rel_tol=_TOLERANCE):
        yield Notice(
            ("camera", "rate_hz"),
            f"the camera takes {camera.rate_hz:g} frames a second, but {file} has {recording.rate_hz:g}: the "
            f"recording plays {camera.rate_hz / recording.rate_hz:.3g} times as fast",
        )
    seen = camera.geometry.ifov_rad * 1e3
    if facts.ifov_rad is not None and not math.isclose(facts.ifov_rad * 1e3, seen, rel_tol=_TOLERANCE):
        own = facts.ifov_rad * 1e3
        yield Notice(
            ("camera", "ifov_mrad"),
            f"a pixel sees {seen:g} mrad, but one of {file} sees {own:.6g}: drawn objects are {own / seen:.3g} "
            "times as large as in the recording",
        )


def camera_key_without_effect(scenario: Scenario) -> Iterator[Notice]:
    """Warn of camera keys without effect on recorded frames."""
    camera, background = scenario.camera, scenario.background
    if not background.has_noise:
        return
    moved = [index for index, motion in enumerate(camera.motion) if scenario.is_on(motion.name)]
    if moved and not background.mapped:
        yield Notice(
            ("camera", "motion", moved[0]),
            "it moves drawn objects, but not the recorded frames behind them",
        )
    for key, name in _WITHOUT_EFFECT.items():
        given = {"preset": camera.preset} | ({"detector": camera.detector} if key == "noise" else {})
        if getattr(camera, key) != Camera.default_for(key, given) and scenario.is_on(name):
            yield Notice(
                ("camera", key),
                "it has no effect: counts are those of the recording, and drawn objects follow its scale",
            )


def _draws_objects(scenario: Scenario) -> bool:
    """Return True if any target or occluder is drawn into the frames."""
    return any(map(scenario.is_on, (*(each.id for each in scenario.targets), *(o.name for o in scenario.occluders))))


def _same_band(scenario: Scenario, background: Recorded) -> bool:
    band = background.recording.camera.band
    return band is not None and limits(band) == limits(scenario.camera.band)


def _um(band: Band) -> str:
    return "{:g} to {:g} um".format(*limits(band))


def _yaml(band: Band) -> str:
    return band if isinstance(band, str) else str(list(band))
