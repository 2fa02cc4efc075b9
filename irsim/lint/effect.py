"""Keys that are written, but that nothing asks for beside the others."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.camera.camera import Camera
from irsim.config.base import Part
from irsim.errors import Notice
from irsim.scenario.model import Scenario


def overruled(scenario: Scenario) -> Iterator[Notice]:
    """Keys beside others that hold in their place."""
    yield from _overruled(scenario, ())


def _overruled(value: object, at: tuple[str | int, ...]) -> Iterator[Notice]:
    """The same of a part, or a list of parts, at a place in the scenario."""
    if isinstance(value, tuple):
        for index, item in enumerate(value):
            yield from _overruled(item, (*at, index))
    elif isinstance(value, Part):
        for key, others in value.overrules.items():
            if getattr(value, key) is not None:
                for other in others:
                    if other in value.model_fields_set:
                        yield Notice((*at, other), f"does not count beside {key}, which holds in its place")
        for name in type(value).model_fields:
            yield from _overruled(getattr(value, name), (*at, name))


def without_effect(scenario: Scenario) -> Iterator[Notice]:
    """Keys of the camera and the air that what they go with leaves without a meaning."""
    camera, air = scenario.camera, scenario.atmosphere
    detector = camera.detector
    for key in ("netd_mk", "range_k"):
        if key not in detector.camera_keys and _is_written(camera, key):
            what = f"does not count for a detector of kind {detector.kind}: its own keys decide"
            yield Notice(("camera", key), what)
    if air.preset == "none" and scenario.sky_preset is None and "visibility_km" in air.model_fields_set:
        yield Notice(("atmosphere", "visibility_km"), "does not count without a preset, whose transmittance it changes")
    yield from _elsewhere(scenario)


def _elsewhere(scenario: Scenario) -> Iterator[Notice]:
    """An altitude at which a camera so high above its ground or sea cannot be."""
    said, air, surface = scenario.atmosphere, scenario.air, scenario.background.surface
    counts = scenario.is_on("atmosphere") and not (air.is_clear and scenario.sky_preset is None)
    if counts and "altitude_m" in said.model_fields_set and said.altitude_m != air.altitude_m:
        what = f"{said.altitude_m:g} m does not count: the camera is {air.altitude_m:g} m above the {surface}"
        yield Notice(("atmosphere", "altitude_m"), what)


def _is_written(camera: Camera, key: str) -> bool:
    """Whether the camera's text has the key, and not its preset alone."""
    if key not in camera.model_fields_set:
        return False
    return camera.preset is None or getattr(camera, key) != Camera.default_for(key, {"preset": camera.preset})


def two_exposures(scenario: Scenario) -> Iterator[Notice]:
    """Motion that blurs for another time than the detector looks."""
    camera = scenario.camera
    exposure_ms = camera.detector.integration_time_ms
    if exposure_ms is not None and camera.exposure_ms not in (0, exposure_ms):
        yield Notice(
            ("camera", "smear", "time_ms"),
            f"{camera.exposure_ms:g} ms are smeared, but the detector integrates for {exposure_ms:g} ms",
        )
