"""Bodies that would reflect what is around them, where nothing is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

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
    """Of a part of the scene at a place in it."""
    band = scenario.camera.band
    for key, emissivity in _emissivities(part):
        if emissivity < CLEARLY:
            own = _own_k(part, key[-1])
            seen = float(temperature(band, emissivity * radiance(band, own)))
            yield Notice(
                (*at, *key),
                f"there is nothing around it to reflect, so that {own:g} K look like {seen:.0f} K; "
                "try atmosphere: {surroundings_k: 280}, or a preset of the atmosphere",
            )


def _emissivities(part: Part) -> Iterator[tuple[tuple[str, ...], float]]:
    """Place and value of each that counts; not of gases, whose emissivity is low from the first: they reflect
    nothing."""
    overruled = {key for by, keys in part.overrules.items() if getattr(part, by) is not None for key in keys}
    fields = type(part).model_fields
    gases = {key for key, field in fields.items() if isinstance(field.default, float) and field.default < CLEARLY}
    for key in fields:
        value = getattr(part, key)
        if key == "emissivities" and isinstance(value, Mapping):
            yield from (((key, name), each) for name, each in value.items())
        elif key.endswith("emissivity") and isinstance(value, float) and key not in overruled | gases:
            yield (key,), value


def _own_k(part: Part, key: str) -> float:
    """Temperature, K, of what has the emissivity of that key, or of that name in `emissivities`."""
    materials = getattr(part, "materials_k", {})
    name = key.removesuffix("_emissivity")
    candidates = (materials.get(key), getattr(part, f"{name}_k", None), getattr(part, "temperature_k", None))
    return float(next((kelvin for kelvin in candidates if isinstance(kelvin, int | float)), USUAL_K))
