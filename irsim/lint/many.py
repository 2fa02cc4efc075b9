"""Things that lie or stand on the ground, so many that they take long to draw and can hardly be meant."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.backgrounds import Ground, Landscape
from irsim.backgrounds.panorama import PanoramaGrid
from irsim.backgrounds.texture import tile_shape
from irsim.errors import Notice, decimal_text
from irsim.scenario.model import Scenario

DEEP = 3.0
"""Things of clutter that lie on each place: but for exp(-3), 5 %, nothing is seen of the ground between them."""

MANY = 500_000
"""Things of clutter, or windows, that take some 10 s to draw."""


def crowded(scenario: Scenario) -> Iterator[Notice]:
    """Clutter that hides its ground, or of very many things."""
    background, geometry = scenario.background, scenario.context.geometry
    if not isinstance(background, Ground | Landscape) or background.clutter is None or not scenario.is_on("clutter"):
        return
    clutter, px_per_mrad = background.clutter, 1e-3 / geometry.ifov_rad
    if isinstance(background, Ground):
        count = clutter.mean_count(tile_shape(geometry.size), px_per_mrad)
    else:
        count = clutter.mean_count_perspective(PanoramaGrid.of(geometry).shape[1], 0.0, px_per_mrad)
    share = min(DEEP / max(clutter.deep, DEEP), MANY / max(count, MANY))
    if share < 1:
        deep = f"{decimal_text(clutter.deep, 2)} of them lie on each place in the mean and hide the ground"
        long = f"there are {decimal_text(count, 2)} of them, which take long to draw"
        why = " and ".join(words for words, so in ((deep, clutter.deep > DEEP), (long, count > MANY)) if so)
        yield Notice(
            ("background", "clutter", "per_mrad2"), f"{why}; try {decimal_text(share * clutter.per_mrad2, 2)} at most"
        )


def built_up(scenario: Scenario) -> Iterator[Notice]:
    """Buildings of very many windows."""
    background = scenario.background
    for index, row in enumerate(background.buildings if isinstance(background, Landscape) else ()):
        count = row.windows(scenario.context)
        if count > MANY:
            yield Notice(
                ("background", "buildings", index),
                f"its {decimal_text(count, 2)} windows take long to draw; try a larger spacing_m, or lower or narrower "
                "ones",
            )
