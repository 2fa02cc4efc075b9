"""What stands on the ground: rows of trees, and buildings. Each is a layer at its own range."""

from __future__ import annotations

from typing import Annotated

import cv2
import numpy as np
from pydantic import Field

from irsim.backgrounds.fields import profile, spectral
from irsim.backgrounds.painting import Painting
from irsim.backgrounds.panorama import Panorama, Sheet, Standing
from irsim.backgrounds.texture import TILE
from irsim.kinds import Fraction, Kelvin, KelvinDifference, KelvinSpread, Metres, Name, Part, Range
from irsim.radiometry import radiance
from irsim.rng import stream
from irsim.stage import Stage
from irsim.types import Floats

Spacing = Annotated[float, Field(ge=0.5, le=100_000)]
"""Metres; nearer to each other they would be too many to draw."""
FINE = 2
"""Outlines are drawn on a grid this much finer than pixels, then averaged."""


class _Canvas:
    """Cover and temperature, drawn on a fine grid over a sheet."""

    def __init__(self, sheet: Sheet) -> None:
        rows, columns = sheet.shape
        self.sheet = sheet
        self.cover = np.zeros((rows * FINE, columns * FINE), np.uint8)
        self.kelvin = np.zeros((rows * FINE, columns * FINE), np.float32)

    def polygon(self, points: Floats, kelvin: float) -> None:
        """A polygon of map places (n, 2) of one temperature."""
        origin = np.array([self.sheet.columns[0], self.sheet.rows[0]])
        fine = np.rint((np.asarray(points) - origin + 0.5) * FINE * 16 - 8).astype(np.int32)
        cv2.fillPoly(self.cover, [fine], 1, shift=4)
        cv2.fillPoly(self.kelvin, [fine], kelvin, shift=4)

    def layer(self, name: str, range_m: float, texture_k: Floats | float, stage: Stage) -> Standing:
        """The layer that was drawn, its temperatures varied by texture_k (rows, cols) of the sheet."""
        size = self.sheet.shape[::-1]
        cover: Floats = np.asarray(
            cv2.resize(self.cover.astype(np.float32), size, interpolation=cv2.INTER_AREA), np.float32
        )
        mean = cv2.resize(self.kelvin * self.cover, size, interpolation=cv2.INTER_AREA) / np.maximum(cover, 1e-6)
        kelvin = np.maximum(mean + texture_k, 1.0)
        emission = stage.through(cover * radiance(stage.band, kelvin), cover, range_m, 0.0)
        pictures = tuple(Panorama.on(self.sheet, np.asarray(part), stage.psf_px) for part in (1 - cover, emission))
        return Standing(name, range_m, Painting(pictures))


def _texture(sheet: Sheet, beta: float, size_px: float, seed: int, *address: str) -> Floats:
    """(rows, cols) of a sheet: a field of mean 0 and variance 1."""
    field = spectral(TILE, beta, None, size_px, 1.0, seed, *address)
    rows, columns = (np.mod(np.arange(length), TILE) for length in sheet.shape)
    return np.asarray(field[np.ix_(rows, columns)])


class Structure(Part):
    """Something that stands on the ground, all around."""

    id: Name
    """Its name for --without, and in truth where it hides a target."""
    range_m: Range = 800.0
    """Metres; targets farther away are behind it."""

    def base(self, sheet: Sheet, height_m: float, ifov_rad: float) -> float:
        """Row of the map where it meets the ground, seen from `height_m` above it."""
        return float(sheet.horizon + np.arctan(height_m / self.range_m) / ifov_rad)


class Trees(Structure):
    """A row of trees: crowns of many lobes, leafy or bare, with undergrowth."""

    id: Name = "trees"
    """Its name for --without, and in truth where it hides a target."""
    height_m: Metres = 14.0
    """Mean height, m; single trees differ by a quarter."""
    spacing_m: Spacing = 6.0
    """Mean distance between two trees, m."""
    leaves: Fraction = 0.9
    """How much of a crown hides what is behind it: 0.4 is a bare tree."""
    undergrowth: Fraction = 0.25
    """Height of the bushes between them, as a share of the trees'."""
    temperature_k: Kelvin | None = None
    """Mean temperature, K; by the `hour` where not given, else 288."""
    spread_k: KelvinSpread = 1.5
    """Standard deviation of temperature, K: half of it from tree to tree."""
    beta: Annotated[float, Field(ge=0, le=6)] = 2.2
    """Slope of the spectrum within the crowns (real bare trees: 2.2)."""

    def paint(self, sheet: Sheet, height_m: float, temperature_k: float, stage: Stage) -> Standing:
        """The row of trees, seen from `height_m` above the ground."""
        ifov, draw = stage.geometry.ifov_rad, stream(stage.seed, self.id)
        px_per_m = 1 / (self.range_m * ifov)
        base, tall = self.base(sheet, height_m, ifov), self.height_m * px_per_m
        sheet = sheet.between(base - 1.9 * tall, base)
        canvas = _Canvas(sheet)
        span = float(sheet.columns[-1] - sheet.columns[0])
        for _ in range(max(1, round(span / (self.spacing_m * px_per_m)))):
            self._tree(
                canvas, float(draw.uniform(sheet.columns[0], sheet.columns[-1])), base, tall, temperature_k, draw
            )
        if self.undergrowth:
            self._bushes(canvas, base, tall, temperature_k, stage.seed)
        grain = _texture(sheet, self.beta, max(tall / 2, 2.0), stage.seed, self.id, "grain")
        if self.leaves < 1:
            self._thin(canvas, tall, stage.seed)
        return canvas.layer(self.id, self.range_m, self.spread_k * np.sqrt(0.5) * grain, stage)

    def _tree(
        self, canvas: _Canvas, x: float, base: float, tall: float, kelvin: float, draw: np.random.Generator
    ) -> None:
        height = tall * float(np.clip(1 + 0.25 * draw.standard_normal(), 0.4, 1.7))
        width = height * float(draw.uniform(0.35, 0.75))
        own = kelvin + self.spread_k * np.sqrt(0.5) * float(draw.standard_normal())
        trunk = max(0.04 * height, 0.5)
        foot = [[x - trunk / 2, base], [x + trunk / 2, base], [x + trunk / 2, base - 0.5 * height]]
        canvas.polygon(np.array([*foot, [x - trunk / 2, base - 0.5 * height]]), own)
        angles = np.linspace(0, 2 * np.pi, 14, endpoint=False)
        for _ in range(30):  # lobes within an ellipse
            angle, out = draw.uniform(0, 2 * np.pi), np.sqrt(draw.random())
            up = 0.5 + 0.5 * out * np.sin(angle)
            middle = (x + 0.42 * width * out * np.cos(angle), base - height * (0.3 + 0.6 * up))
            radius = width * draw.uniform(0.1, 0.2) * draw.uniform(0.8, 1.15, len(angles))
            lobe = np.stack([middle[0] + radius * np.cos(angles), middle[1] + radius * np.sin(angles)], axis=-1)
            canvas.polygon(lobe, own - 0.3 * self.spread_k * (1 - up) + 0.15 * self.spread_k * draw.standard_normal())

    def _bushes(self, canvas: _Canvas, base: float, tall: float, kelvin: float, seed: int) -> None:
        columns = canvas.sheet.columns
        bumps = profile(len(columns), 2.4, max(2 * tall, 4.0), seed, self.id, "bushes")
        tops = base - self.undergrowth * tall * np.clip(1 + 0.4 * bumps, 0, None)
        ends = [[columns[-1], base], [columns[0], base]]
        canvas.polygon(np.concatenate([np.stack([columns, tops], axis=-1), ends]), kelvin - 0.3 * self.spread_k)

    def _thin(self, canvas: _Canvas, tall: float, seed: int) -> None:
        """Gaps between the leaves: fewer where many lobes lie behind each other, so at the middle of a crown."""
        rows, columns = canvas.cover.shape
        soft = cv2.blur(canvas.cover.astype(np.float32), (2 * max(int(tall * FINE / 8), 1) + 1,) * 2)
        grain = spectral(TILE, 1.6, None, max(tall * FINE / 6, 2.0), 1.0, seed, self.id, "leaves")
        rank = 1 / (1 + np.exp(-1.702 * grain))  # the normal distribution's shares within 0.01
        gaps = rank[np.ix_(np.mod(np.arange(rows), TILE), np.mod(np.arange(columns), TILE))]
        canvas.cover[gaps > self.leaves + (1 - self.leaves) * (2 * soft - 1)] = 0


class Buildings(Structure):
    """Houses and blocks with roofs and rows of windows."""

    id: Name = "buildings"
    """Its name for --without, and in truth where it hides a target."""
    spacing_m: Spacing = 60.0
    """Mean distance between two buildings, m."""
    width_m: Annotated[tuple[Metres, Metres], Field(strict=False)] = (10.0, 30.0)
    """Least and greatest width, m."""
    height_m: Annotated[tuple[Metres, Metres], Field(strict=False)] = (5.0, 14.0)
    """Least and greatest height of the walls, m."""
    temperature_k: Kelvin | None = None
    """Mean temperature of the walls, K; by the `hour` where not given, else 290."""
    spread_k: KelvinSpread = 2.0
    """Standard deviation from building to building, K."""
    windows_k: KelvinDifference = 3.0
    """Temperature of the windows less the wall's, K."""
    roof_k: KelvinDifference = -4.0
    """Temperature of the roof less the wall's, K."""

    def paint(self, sheet: Sheet, height_m: float, temperature_k: float, stage: Stage) -> Standing:
        """The buildings, seen from `height_m` above the ground."""
        ifov, draw = stage.geometry.ifov_rad, stream(stage.seed, self.id)
        px_per_m = 1 / (self.range_m * ifov)
        base = self.base(sheet, height_m, ifov)
        sheet = sheet.between(base - (max(self.height_m) + 4) * px_per_m, base)
        canvas = _Canvas(sheet)
        span = float(sheet.columns[-1] - sheet.columns[0])
        for _ in range(max(1, round(span / (self.spacing_m * px_per_m)))):
            self._building(
                canvas, float(draw.uniform(sheet.columns[0], sheet.columns[-1])), base, px_per_m, temperature_k, draw
            )
        grain = _texture(sheet, 2.4, 20.0, stage.seed, self.id, "grain")
        return canvas.layer(self.id, self.range_m, 0.15 * self.spread_k * grain, stage)

    def _building(
        self, canvas: _Canvas, x: float, base: float, px_per_m: float, kelvin: float, draw: np.random.Generator
    ) -> None:
        width, height = (float(draw.uniform(min(ends), max(ends))) for ends in (self.width_m, self.height_m))
        wall = kelvin + self.spread_k * float(draw.standard_normal())

        def box(left: float, low: float, right: float, high: float, own: float) -> None:
            """A rectangle in metres right of the middle and above the ground."""
            corners = np.array([[left, low], [right, low], [right, high], [left, high]])
            canvas.polygon(np.array([x, base]) + corners * [px_per_m, -px_per_m], own)

        half = width / 2
        if draw.random() < 0.5:
            box(-half, 0, half, height + 0.6, wall + self.roof_k)
        else:
            ridge = np.array(
                [[-half - 0.5, height], [half + 0.5, height], [half * 0.7, height + 3], [-half * 0.7, height + 3]]
            )
            canvas.polygon(np.array([x, base]) + ridge * [px_per_m, -px_per_m], wall + self.roof_k)
        box(-half, 0, half, height, wall)
        for floor in np.arange(1.0, height - 1.7, 3.0):
            for left in np.arange(-half + 1.0, half - 1.7, 2.8):
                box(left, floor, left + 1.3, floor + 1.5, wall + self.windows_k * float(draw.uniform(0.3, 1.3)))
