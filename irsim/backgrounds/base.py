"""What a background is: layers from far to near, each a transmittance and an emission."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Protocol, TypeGuard

import numpy as np

from irsim.backgrounds.chart import Chart
from irsim.config.base import Kind
from irsim.geometry.context import SceneContext
from irsim.physics.climate import STANDARD_K
from irsim.physics.radiometry import hemisphere, radiance
from irsim.types import CameraFacts, Floats, Slices

if TYPE_CHECKING:
    from irsim.backgrounds.parallax import Shell

Names = Iterator[tuple[str, tuple[str | int, ...]]]
"""Names of a background's parts, each with its place in it."""

Shells = Iterator[tuple[str, tuple[str, int], "Shell"]]
"""Names of parts and where they stand in the background, and the shells that they are painted on."""

Place = tuple[float, float, float]
"""Right, below and ahead of the camera's first place, m; level, ahead is the azimuth of the first pointing."""


@dataclass(frozen=True, eq=False)
class ViewDirection:
    """One frame's pointing: time in s, and the chart of the directions that the pixels see.

    key: the pointing of a frame nearby, its chart with a margin. What is painted for it need only be
    moved for this one (see `irsim.backgrounds.painting`).
    place: where the camera is.
    """

    time: float
    chart: Chart
    key: ViewDirection | None = None
    place: Place = (0.0, 0.0, 0.0)


class Layer(Protocol):
    """Something that fills the picture at a range: L <- L * transmittance + emission."""

    @property
    def name(self) -> str: ...

    @property
    def range_m(self) -> float: ...

    def light(self, view_direction: ViewDirection) -> tuple[Floats | None, Floats]:
        """(transmittance, None where opaque; emission in W/m2/sr), each (rows, cols) float32.

        The caller must not write to them: a layer may keep them for the next frame.
        """
        ...


class SemiTransparentLayer(Layer, Protocol):
    """A layer that fills the picture by itself, which is quicker than to give what it takes."""

    def veil(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """light <- under * transmittance + emission; the transmittance of patches, (rows, columns) each, or
        (n, rows, columns) at the instants of an exposure.

        under: (rows, cols) of the same type, which may be the light itself.
        """
        ...


class ClearLayer(Layer, Protocol):
    """A sky without clouds."""

    def radiance(self, elevation_rad: Floats) -> Floats:
        """In-band radiance, W/m2/sr, at elevations, rad."""
        ...


class Filmed(Layer, Protocol):
    """Frames that a camera has taken already: what is drawn is put into their counts."""

    def put_into(self, light: Floats, index: int, uncovered: Floats) -> Floats:
        """(rows, cols) counts of frame `index` with what was drawn on its light, which gave `light`, before they are
        rounded and clipped: in float64 where the light is.

        uncovered: (rows, cols), the share 0..1 of each pixel's light that is still the frame's own.
        """
        ...


LandLight = Callable[[ViewDirection], Floats]
"""Light, W/m2/sr, (n,), of those pixels of a gaze that see nothing but ground or sea; none is written to."""


def veiled(under: Floats, light: Floats, passed: Floats, emission: Floats, behind: Sequence[Slices]) -> list[Floats]:
    """light <- under * passed + emission, as `SemiTransparentLayer.veil`; `passed` of patches (rows, columns)."""
    np.multiply(under, passed, out=light)
    light += emission
    return [passed[patch] for patch in behind]


def opaque(name: str) -> ValueError:
    """What is wrong with a layer that lets nothing through, though others lie behind it."""
    return ValueError(f"layer {name}: only the farthest layer may be opaque")


AirBefore = tuple[Floats, Floats]
"""What the air before a layer passes, and its own light, W/m2/sr: (rows, cols) float32 each."""


def in_air(passed: Floats | None, emission: Floats, air: AirBefore) -> Floats:
    """Emission, (rows, cols), of a layer as it arrives through the air, which shines where it hides what is behind."""
    tau, path = air
    return np.asarray(tau * emission + (path if passed is None else path * (1 - passed)))


def is_veil(layer: Layer) -> TypeGuard[SemiTransparentLayer]:
    """isinstance would ask for all that the protocol names: 20 us."""
    return hasattr(layer, "veil")


@dataclass(frozen=True, eq=False)
class Changed:
    """A layer whose light something changes; its name and range stay."""

    layer: Layer

    @property
    def name(self) -> str:
        return self.layer.name

    @property
    def range_m(self) -> float:
        return self.layer.range_m


class Background(Kind):
    """What is behind the targets."""

    noisy: ClassVar[bool] = False
    """Does its light hold a camera's noise already? Then the first of its layers is `Filmed`."""
    mapped: ClassVar[bool] = True
    """Is it painted over directions, so that a camera that turns sees another part of it?"""
    endless: ClassVar[bool] = False
    """Does ground fill the picture wherever the camera looks? It passes by a camera that is carried where it says how
    far below (`surface_m`)."""
    surface: ClassVar[str] = "ground"
    """What its lower part is, in a word for messages."""

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that it is read from."""
        return ()

    @abstractmethod
    def layers(self, context: SceneContext) -> Sequence[Layer]:
        """The layers, the farthest first; the first is opaque."""

    def names(self) -> Names:
        """Name and place of each layer that can be switched off (the opaque one cannot)."""
        yield from ()

    def shells(self) -> Shells:
        """Name, place and shell of each part that stands all around the camera's first place."""
        yield from ()

    @property
    def surface_m(self) -> float | None:
        """How far its level ground or sea lies below the unmoved camera, m, and reaches to the horizon; None where it
        has none, or does not say."""
        return None

    @property
    def leaves_k(self) -> float | None:
        """How warm the leaves are of what stands before it, by its `hour`, K; None where it has none."""
        return None

    def altitude_m(self, given: float) -> float:
        """How high above the sea the unmoved camera is, m, where its air has it at `given`: no lower than above its
        own ground."""
        return max(given, self.surface_m or 0.0)

    @property
    def folds(self) -> bool:
        """Does it have no true map near the zenith and the nadir, and in very wide pictures?"""
        return self.mapped

    @property
    def sky_preset(self) -> str | None:
        """The model atmosphere of its clear sky; None where it has no sky, or one of its own."""
        return None

    def clear(self, context: SceneContext) -> ClearLayer | None:
        """Its sky without clouds; None where it has no sky."""
        return None

    @property
    def bare(self) -> Background:
        """The same without what stands or lies on its ground or sea; its `land` is the same."""
        return self

    def land(self, context: SceneContext) -> LandLight | None:
        """How its bare ground or sea looks, without what stands or lies on it; None where it has none, or does not
        say."""
        return None

    def ambient(self, context: SceneContext) -> float:
        """Radiance, W/m2/sr, that a grey body in front of it reflects where the scene's air does not say: half the
        mean of its clear sky (`hemisphere`), half ground as bright as that at the horizon; without a sky all is as warm
        as the standard air."""
        sky = self.clear(context)
        if sky is None:
            return float(radiance(context.band, STANDARD_K))
        return (hemisphere(sky.radiance) + self._below(sky, context)) / 2

    def _below(self, sky: ClearLayer, context: SceneContext) -> float:
        """Radiance, W/m2/sr, of what lies under its sky."""
        return float(sky.radiance(np.zeros(1))[0])

    def taken_by(self, camera: CameraFacts) -> CameraFacts:
        """What is known of the camera that its counts are of: the scenario's, or another where it is `Filmed`."""
        return camera

    def refuses(self, size: tuple[int, int], bits: int) -> str | None:
        """Why a camera of that size (columns, rows) and depth cannot look at it; None where it can."""
        return None


FARTHEST = float(np.inf)
"""Range of what lies behind every target, m."""
