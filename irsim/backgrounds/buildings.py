"""Buildings that stand on the ground, in a layer at their own range."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.backgrounds.panorama import Sheet
from irsim.backgrounds.parallax import Standing
from irsim.backgrounds.structures import MOST_RELIEF, NEAREST_PX, Canvas, Spacing, Structure, grain
from irsim.config.base import Name, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Kelvin, KelvinDifference, KelvinSpread, Metres, Rising
from irsim.geometry.context import SceneContext
from irsim.rng import stream
from irsim.types import Floats

Wall = Annotated[Metres, Plausible(1, 900, "m")]
"""From a shed to the highest of towers (Burj Khalifa: 828 m)."""

FLOOR_M, WINDOW_M = 3.0, 2.8
"""From floor to floor, and from window to window."""

WINDOW_SHARES = (0.3, 1.3)
"""From window to window, least and most of `windows_k`: by how lately each room was heated or aired. By eye."""


class Buildings(Structure):
    """Houses and blocks with roofs and rows of windows."""

    switches: ClassVar[Switches] = {
        "texture": ("spread_k", 0.0),
        "windows": ("windows_k", 0.0),
        "roofs": ("roof_k", 0.0),
        "relief": ("relief_m", 0.0),
    }

    id: Name = "buildings"
    """Its name for --without, and in truth where it hides a target."""
    spacing_m: Spacing = 60.0
    """Mean distance between two buildings, m."""
    width_m: Annotated[tuple[Wall, Wall], Field(strict=False), Rising] = (10.0, 30.0)
    """Least and greatest width, m."""
    height_m: Annotated[tuple[Wall, Wall], Field(strict=False), Rising] = (5.0, 14.0)
    """Least and greatest height of the walls, m."""
    temperature_k: Kelvin | None = None
    """Mean temperature of the walls, K; by the `hour` where not given, else 290."""
    spread_k: KelvinSpread = 2.0
    """Standard deviation from building to building, K."""
    windows_k: KelvinDifference = 3.0
    """Temperature of the windows less the wall's, K; of each 0.3 to 1.3 of it."""
    roof_k: KelvinDifference = -4.0
    """Temperature of the roof less the wall's, K."""

    def paint(self, sheet: Sheet, height_m: float, temperature_k: float, context: SceneContext) -> Standing:
        """The buildings, seen from `height_m` above the ground."""
        ifov, draw = context.geometry.ifov_rad, stream(context.seed, self.id)
        px_per_m = 1 / (self.range_m * ifov)
        base = self.base(sheet, height_m, ifov)
        rises = MOST_RELIEF * self.relief_m
        sheet = sheet.between(base - (self.height_m[1] + 4 + rises) * px_per_m, base + rises * px_per_m)
        canvas = Canvas(sheet)
        span = float(sheet.columns[-1] - sheet.columns[0])
        feet = self.feet(sheet, base, context, "buildings")
        standing = []
        for _ in range(max(1, round(span / max(self.spacing_m * px_per_m, NEAREST_PX)))):
            x = float(draw.uniform(sheet.columns[0], sheet.columns[-1]))
            foot = x, float(feet(np.array([x]))[0])
            standing.append((foot, list(self._outlines(temperature_k, draw))))
        for foot, outlines in sorted(standing, key=lambda each: each[0][1]):  # the nearest, which are the lowest, last
            for corners, kelvin in outlines:
                canvas.polygon(np.array(foot) + corners * [px_per_m, -px_per_m], kelvin)
        texture = grain(sheet, 2.4, 20.0, context.seed, self.id, "grain")
        return canvas.layer(self.id, self.range_m, 0.15 * self.spread_k * texture, context)

    def windows(self, context: SceneContext) -> float:
        """About how many windows are drawn of all buildings, which takes nearly all the time."""
        px_per_m = 1 / (self.range_m * context.geometry.ifov_rad)
        count = len(Sheet.of(context.geometry).columns) / max(self.spacing_m * px_per_m, NEAREST_PX)
        across, up = (float(np.mean(ends)) for ends in (self.width_m, self.height_m))
        return count * (across / WINDOW_M) * (up / FLOOR_M)

    def _outlines(self, kelvin: float, draw: np.random.Generator) -> Iterator[tuple[Floats, float]]:
        """Polygons (n, 2) of a building, m right of its middle and above its foot, and their temperatures, K; what is
        behind comes first."""
        width, height = (float(draw.uniform(*ends)) for ends in (self.width_m, self.height_m))
        wall, half = kelvin + self.spread_k * float(draw.standard_normal()), width / 2
        if draw.random() < 0.5:
            yield _box(-half, 0, half, height + 0.6), wall + self.roof_k
        else:
            ridge = [[-half - 0.5, height], [half + 0.5, height], [half * 0.7, height + 3], [-half * 0.7, height + 3]]
            yield np.array(ridge), wall + self.roof_k
        yield _box(-half, 0, half, height), wall
        for floor in np.arange(1.0, height - 1.7, FLOOR_M):
            for left in np.arange(-half + 1.0, half - 1.7, WINDOW_M):
                pane = _box(left, floor, left + 1.3, floor + 1.5)
                yield pane, wall + self.windows_k * float(draw.uniform(*WINDOW_SHARES))


def _box(left: float, low: float, right: float, high: float) -> Floats:
    """(4, 2) corners."""
    return np.array([[left, low], [right, low], [right, high], [left, high]])
