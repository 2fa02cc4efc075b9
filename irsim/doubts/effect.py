"""Keys that are written, but that nothing asks for beside the others."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.detector.response import Electrons
from irsim.errors import Notice
from irsim.presets import PRESETS
from irsim.scenario import Scenario


def without_effect(scenario: Scenario) -> Iterator[Notice]:
    camera, air = scenario.camera, scenario.atmosphere
    if isinstance(camera.detector, Electrons):
        for key in ("netd_mk", "range_k"):
            if key in camera.model_fields_set and key not in PRESETS.get(camera.preset or "ideal", {}):
                yield Notice(("camera", key), "does not count for a detector of kind electrons: its own keys decide")
        if camera.smeared_ms not in (0, camera.detector.integration_ms):
            yield Notice(
                ("camera", "smear", "time_ms"),
                f"{camera.smeared_ms:g} ms are smeared, but the detector integrates for "
                f"{camera.detector.integration_ms:g} ms",
            )
    if air.preset == "none" and scenario.sky_preset is None and "visibility_km" in air.model_fields_set:
        yield Notice(("atmosphere", "visibility_km"), "does not count without a preset, whose transmittance it changes")
