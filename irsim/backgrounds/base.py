"""Backgrounds as layers from far to near, each a transmittance and an emission: protocols, blending, base class."""

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
    from irsim.backgrounds.panorama import ParallaxSurface

Names = Iterator[tuple[str, tuple[str | int, ...]]]
"""Names of a background's parts, each with its place in the background."""

Surfaces = Iterator[tuple[str, tuple[str, int], "ParallaxSurface"]]
"""Names of parts, their places in the background, and the surfaces on which they are painted."""

Place = tuple[float, float, float]
"""Right, below and ahead of the camera's first place, m; axes are level, ahead is the azimuth of the first pointing."""

FARTHEST = float(np.inf)
"""Range of layers behind every target, m."""


@dataclass(frozen=True, eq=False)
class ViewDirection:
    """View of one frame: time in s, chart of the pixels' directions, place of the camera.

    key: the view of a nearby frame, with a margin around its chart. A picture sampled for the key is shifted for this
    frame (`irsim.backgrounds.texture`).
    """

    time: float
    chart: Chart
    key: ViewDirection | None = None
    place: Place = (0.0, 0.0, 0.0)


class Layer(Protocol):
    """Full-frame layer at a range: L <- L * transmittance + emission."""

    @property
    def name(self) -> str: ...

    @property
    def range_m(self) -> float: ...

    def light(self, view_direction: ViewDirection) -> tuple[Floats | None, Floats]:
        """Return (transmittance, None if opaque; emission in W/m2/sr), each (rows, cols) float32.

        Read only: a layer may cache them.
        """
        ...


class SemiTransparentLayer(Layer, Protocol):
    """Layer that blends itself over the image, faster than by its transmittance and emission."""

    def blend(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """Set light <- under * transmittance + emission and return the transmittance of patches.

        under: (rows, cols) of the same type; it may be the light itself. A patch is (rows, columns), or
        (n, rows, columns) at the instants of an exposure.
        """
        ...


class ClearLayer(Layer, Protocol):
    """Sky without clouds."""

    def radiance(self, elevation_rad: Floats) -> Floats:
        """Return the in-band radiance, W/m2/sr, at elevations, rad."""
        ...


class RecordedLayer(Layer, Protocol):
    """Frames of a recording: objects are inserted into their counts."""

    def insert_into(self, light: Floats, index: int, uncovered: Floats) -> Floats:
        """Return the counts of frame `index`, (rows, cols), with objects drawn on its light, before rounding and
        clipping; float64 if the light is.

        light: the light with the objects. uncovered: share 0..1 of each pixel's light that no object covers.
        """
        ...


GroundRadiance = Callable[[ViewDirection], Floats]
"""Radiance, W/m2/sr, (n,), of the pixels of a view that contain only ground or sea; read only."""


def blend_over(
    under: Floats, light: Floats, transmittance: Floats, emission: Floats, behind: Sequence[Slices]
) -> list[Floats]:
    """Set light <- under * transmittance + emission and return the transmittance of patches, (rows, columns) each."""
    np.multiply(under, transmittance, out=light)
    light += emission
    return [transmittance[patch] for patch in behind]


def opaque_error(name: str) -> ValueError:
    """Return the error for an opaque layer in front of others."""
    return ValueError(f"layer {name}: only the farthest layer may be opaque")


AirBefore = tuple[Floats, Floats]
"""Transmittance and path radiance, W/m2/sr, of the air before a layer: (rows, cols) float32 each."""


def apply_air(transmittance: Floats | None, emission: Floats, air: AirBefore) -> Floats:
    """Return the emission of a layer, (rows, cols), at the camera; the air adds path radiance where the layer covers
    its background."""
    tau, path = air
    return np.asarray(tau * emission + (path if transmittance is None else path * (1 - transmittance)))


def is_semi_transparent(layer: Layer) -> TypeGuard[SemiTransparentLayer]:
    """Return True if a layer blends itself; isinstance on a protocol would take 20 us."""
    return hasattr(layer, "blend")


@dataclass(frozen=True, eq=False)
class LayerWrapper:
    """Base of layers that modify the light of another one, with its name and range."""

    layer: Layer

    @property
    def name(self) -> str:
        return self.layer.name

    @property
    def range_m(self) -> float:
        return self.layer.range_m


class Background(Kind):
    """Scene behind the targets."""

    has_noise: ClassVar[bool] = False
    """True if its light contains camera noise; its first layer is then a `RecordedLayer`."""
    mapped: ClassVar[bool] = True
    """True if it is painted over directions, so that a rotation of the camera shifts it."""
    endless: ClassVar[bool] = False
    """True if ground fills the image in every direction. It passes below a moving camera if `surface_m` is given."""
    surface: ClassVar[str] = "ground"
    """Noun for the lower part in messages."""

    @property
    def files(self) -> tuple[Path, ...]:
        """Files from which the background is read."""
        return ()

    @abstractmethod
    def layers(self, context: SceneContext) -> Sequence[Layer]:
        """Return the layers, the farthest first; only the first is opaque."""

    def names(self) -> Names:
        """Yield name and place of each layer that can be switched off; the opaque one cannot."""
        yield from ()

    def parallax_surfaces(self) -> Surfaces:
        """Yield name, place and surface of each part painted around the camera's first place."""
        yield from ()

    @property
    def surface_m(self) -> float | None:
        """Depth of its level ground or sea, which extends to the horizon, below the first place of the camera, m; None
        without one."""
        return None

    @property
    def leaves_k(self) -> float | None:
        """Temperature of foliage at its `hour`, K; None without an hour."""
        return None

    def altitude_m(self, given: float) -> float:
        """Return the height of the first camera place above the sea, m: `given`, or the height above the ground if
        larger."""
        return max(given, self.surface_m or 0.0)

    @property
    def has_poles(self) -> bool:
        """True if its map is singular near the zenith and the nadir, and distorted in very wide images."""
        return self.mapped

    @property
    def sky_preset(self) -> str | None:
        """Model atmosphere of its clear sky; None without one."""
        return None

    def clear(self, context: SceneContext) -> ClearLayer | None:
        """Return its sky without clouds; None without a sky."""
        return None

    @property
    def bare(self) -> Background:
        """The background without objects and ground cover; its `ground_radiance` is the same."""
        return self

    def ground_radiance(self, context: SceneContext) -> GroundRadiance | None:
        """Return the radiance of its bare ground or sea; None without one."""
        return None

    def ambient(self, context: SceneContext) -> float:
        """Return the radiance, W/m2/sr, that a grey body reflects if the atmosphere does not set it.

        It is half the mean of the clear sky (`hemisphere`) and half the ground, as bright as the horizon. Without a
        sky it is a black body at the standard air temperature.
        """
        sky = self.clear(context)
        if sky is None:
            return float(radiance(context.band, STANDARD_K))
        return (hemisphere(sky.radiance) + self._ground_light(sky, context)) / 2

    def _ground_light(self, sky: ClearLayer, context: SceneContext) -> float:
        """Return the radiance, W/m2/sr, of the ground below its sky."""
        return float(sky.radiance(np.zeros(1))[0])

    def recorded_camera(self, camera: CameraFacts) -> CameraFacts:
        """Return the camera that made the counts: that of the scenario, or that of the recording."""
        return camera

    def camera_fault(self, size: tuple[int, int], bits: int) -> str | None:
        """Return the reason why a camera of that size (columns, rows) and bit depth does not fit; None if it fits."""
        return None
