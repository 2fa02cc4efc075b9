"""Temperatures that differences to others put below that of empty space."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.backgrounds import Ground, Landscape
from irsim.backgrounds.ground_cover import typical
from irsim.backgrounds.structures import WINDOW_SHARES
from irsim.config.base import KeyPath
from irsim.errors import Notice
from irsim.scenario.model import Scenario

SPACE_K = 2.725
"""Temperature of the cosmic background (Fixsen, Astrophys. J. 707 (2009) 916)."""


def colder_than_space(scenario: Scenario) -> Iterator[Notice]:
    """What lies or stands on the ground and would be colder than anything is."""
    for at, of, whole_k, less_k in _differences(scenario):
        if whole_k + less_k < SPACE_K:
            yield Notice(
                ("background", *at),
                f"{less_k:g} K from {of} of {whole_k:g} K is {whole_k + less_k:g} K, colder than empty space "
                f"({SPACE_K:.2g} K): it is drawn as if it sent no light",
            )


def _differences(scenario: Scenario) -> Iterator[tuple[KeyPath, str, float, float]]:
    """Place in the background, what a difference is to, that one's temperature and the least difference, K."""
    background = scenario.shown.background
    if not isinstance(background, Ground | Landscape):
        return
    mean_k = background.mean_k if isinstance(background, Ground) else background.ground_k
    fields, clutter = background.fields, background.clutter
    if fields is not None and fields.lane_mrad and scenario.is_on("fields"):
        yield ("fields", "lane_k"), "ground", mean_k, fields.lane_k
    for name, even in (("roads", background.roads), ("water", background.water)):
        if even is not None and scenario.is_on(name):
            yield (name, "contrast_k"), "ground", mean_k, typical(even.contrast_k, background.hour, name)
    if clutter is not None and clutter.cold and scenario.is_on("clutter"):
        yield ("clutter", "contrast_k"), "ground", mean_k, -clutter.contrast_k[1]
    for index, houses in enumerate(background.buildings if isinstance(background, Landscape) else ()):
        wall_k = typical(houses.temperature_k, background.hour, "walls")
        yield ("buildings", index, "roof_k"), "walls", wall_k, houses.roof_k
        yield ("buildings", index, "windows_k"), "walls", wall_k, max(WINDOW_SHARES) * houses.windows_k
