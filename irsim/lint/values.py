"""Warnings about implausible numbers, such as temperatures in degrees Celsius, and about keys without effect."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from irsim.camera.camera import Camera
from irsim.config.base import KeyPath, Part
from irsim.config.fields import Plausible
from irsim.config.schema import Slot
from irsim.errors import Notice
from irsim.scenario.model import Scenario


def implausible_values(slot: Slot, value: Any, at: KeyPath = ()) -> Iterator[Notice]:
    """Yield a warning for each number in `value` outside the `Plausible` interval of its field.

    value  plain value of a field: a number, or a tree of mappings and lists
    slot   field that holds the value
    at     key path of the value
    """
    if isinstance(value, dict | list):
        for step, item in value.items() if isinstance(value, dict) else enumerate(value):
            inner = slot.child(value, step)
            if inner is not None:
                yield from implausible_values(inner, item, (*at, step))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        for plausible in slot.metadata:
            if isinstance(plausible, Plausible) and not plausible.low <= value <= plausible.high:
                yield Notice(at, f"{value!r} is allowed but implausible; plausible: {plausible}")


def key_overruled(scenario: Scenario) -> Iterator[Notice]:
    """Warn of keys without effect because another key replaces them."""
    yield from _overruled_keys(scenario, ())


def _overruled_keys(value: object, at: tuple[str | int, ...]) -> Iterator[Notice]:
    """Yield a warning for each key that another key overrules, in the part or parts at a key path."""
    if isinstance(value, tuple):
        for index, item in enumerate(value):
            yield from _overruled_keys(item, (*at, index))
    elif isinstance(value, Part):
        for key, others in value.overrules.items():
            if getattr(value, key) is not None:
                for other in others:
                    if other in value.model_fields_set:
                        yield Notice((*at, other), f"does not count beside {key}, which replaces it")
        for name in type(value).model_fields:
            yield from _overruled_keys(getattr(value, name), (*at, name))


def key_without_effect(scenario: Scenario) -> Iterator[Notice]:
    """Warn of keys of the camera and the atmosphere that have no effect together with the other keys."""
    camera, air = scenario.camera, scenario.atmosphere
    detector = camera.detector
    for key in ("netd_mk", "range_k"):
        if key not in detector.camera_keys and _is_written(camera, key):
            message = f"does not count for a detector of kind {detector.kind}: its own keys decide"
            yield Notice(("camera", key), message)
    if air.preset == "none" and scenario.sky_preset is None and "visibility_km" in air.model_fields_set:
        yield Notice(("atmosphere", "visibility_km"), "does not count without a preset, whose transmittance it changes")
    yield from _altitude_overruled(scenario)


def _altitude_overruled(scenario: Scenario) -> Iterator[Notice]:
    """Yield the warning of an altitude that the height of the camera above its ground or sea replaces."""
    given, air, surface = scenario.atmosphere, scenario.air, scenario.background.surface
    matters = scenario.is_on("atmosphere") and not (air.is_clear and scenario.sky_preset is None)
    if matters and "altitude_m" in given.model_fields_set and given.altitude_m != air.altitude_m:
        message = f"{given.altitude_m:g} m does not count: the camera is {air.altitude_m:g} m above the {surface}"
        yield Notice(("atmosphere", "altitude_m"), message)


def _is_written(camera: Camera, key: str) -> bool:
    """Return True if the scenario's text sets a camera key, False if only the camera's preset does."""
    if key not in camera.model_fields_set:
        return False
    return camera.preset is None or getattr(camera, key) != Camera.default_for(key, {"preset": camera.preset})
