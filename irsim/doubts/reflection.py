"""Bodies that would reflect what is around them, where nothing is."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.errors import Notice
from irsim.kinds import Part
from irsim.radiometry import radiance, temperature
from irsim.scenario import Scenario

CLEARLY = 0.8
"""An emissivity below this reflects so much that it shows: at 300 K, surroundings of 0 K make LWIR 13 K colder."""
USUAL_K = 300.0
"""Temperature of a part that has no key for it."""


def unreflecting(scenario: Scenario) -> Iterator[Notice]:
    """Emissivities that were written low where surroundings are missing: what is not emitted is not there at all."""
    if scenario.stage.surroundings > 0:
        return
    for index, target in enumerate(scenario.targets):
        yield from _cold(scenario, target.shape, ("targets", index, "shape"))
    for index, occluder in enumerate(scenario.occluders):
        yield from _cold(scenario, occluder, ("occluders", index))


def _cold(scenario: Scenario, part: Part, at: tuple[str | int, ...]) -> Iterator[Notice]:
    """Of a part of the scene at a place in it; gases, whose emissivity is low from the first, reflect nothing."""
    band = scenario.camera.band
    overruled = {key for by, keys in part.overrules.items() if getattr(part, by) is not None for key in keys}
    for key, field in type(part).model_fields.items():
        if not key.endswith("emissivity") or field.default < CLEARLY or key in overruled:
            continue
        emissivity = getattr(part, key)
        if 0 < emissivity < CLEARLY:
            own = getattr(part, key.removesuffix("_emissivity") + "_k", getattr(part, "temperature_k", USUAL_K))
            seen = float(temperature(band, emissivity * radiance(band, own)))
            yield Notice(
                (*at, key),
                f"there is nothing around it to reflect, so that {own:g} K look like {seen:.0f} K; "
                "try atmosphere: {surroundings_k: 280}, or a preset of the atmosphere",
            )
