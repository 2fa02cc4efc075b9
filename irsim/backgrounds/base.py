"""Backgrounds as layers from far to near, each a transmittance and an emission: protocols, blending, base class."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Protocol, TypeGuard

import numpy as np

from irsim.backgrounds.chart import Chart
from irsim.config.base import Kind
from irsim.geometry.context import SceneContext
from irsim.physics.climate import STANDARD_K
from irsim.physics.radiometry import hemisphere, radiance
from irsim.types import CameraFacts, Floats, Slices, TargetTruth

if TYPE_CHECKING:
    from irsim.backgrounds.panorama import ParallaxSurface

Names = Iterator[tuple[str, tuple[str | int, ...]]]
"""Names of a background's parts, each with its path of keys in the YAML."""

Surfaces = Iterator[tuple[str, tuple[str, int], "ParallaxSurface"]]
"""Names of parts, their paths of keys in the YAML, and the surfaces on which they are painted."""

Place = tuple[float, float, float]
"""Camera position right, below and ahead of the first one, m; ahead is level, along the azimuth of the first
pointing."""

FARTHEST = float(np.inf)
"""Range of layers behind every target, m."""


@dataclass(frozen=True, eq=False)
class ViewDirection:
    """View of one frame: time, s, chart of the pixels' directions, and position of the camera.

    `key` is the view of the key frame: a nearby frame, with a margin around its chart, whose sampled picture is shifted
    for this frame (`irsim.backgrounds.texture`).
    """

    time: float
    chart: Chart
    key: ViewDirection | None = None
    place: Place = (0.0, 0.0, 0.0)


class Layer(Protocol):
    """Layer over the whole frame, at a range, that turns a radiance L behind it into L * transmittance + emission."""

    @property
    def name(self) -> str: ...

    @property
    def range_m(self) -> float: ...

    def light(self, view_direction: ViewDirection) -> tuple[Floats | None, Floats]:
        """Return transmittance (None if opaque) and emission, W/m2/sr, (rows, cols) float32 each.

        The arrays are read only, as a layer may cache them.
        """
        ...


class SemiTransparentLayer(Layer, Protocol):
    """Layer with its own `blend`, which is faster than blending by its transmittance and emission."""

    def blend(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """Set `light` to under * transmittance + emission and return the transmittance in the slices `behind`.

        under: radiance behind the layer, (rows, cols) as `light`; both may be one array. The transmittance in a slice
        is (rows, columns), or (n, rows, columns) at n instants of an exposure.
        """
        ...


class ClearLayer(Layer, Protocol):
    """Sky without clouds."""

    def radiance(self, elevation_rad: Floats) -> Floats:
        """Return the in-band radiance, W/m2/sr, at elevations, rad."""
        ...


class RecordedLayer(Layer, Protocol):
    """Layer of recorded frames, into whose counts objects are inserted."""

    def insert_into(self, light: Floats, index: int, uncovered: Floats) -> Floats:
        """Return the counts of frame `index` with objects, (rows, cols), before rounding and clipping; float64 if
        `light` is.

        light: radiance of the frame with the objects drawn on it, W/m2/sr. uncovered: share 0..1 of each pixel that no
        object covers.
        """
        ...


GroundRadiance = Callable[[ViewDirection], Floats]
"""Function that returns the radiance, W/m2/sr, (n,), of the pixels of a view that contain only ground or sea; read
only."""


def blend_over(
    under: Floats, light: Floats, transmittance: Floats, emission: Floats, behind: Sequence[Slices]
) -> list[Floats]:
    """Set `light` to under * transmittance + emission and return the transmittance in the slices `behind`."""
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
    """Return True if a layer has a `blend` of its own. A test by isinstance would take 20 us."""
    return hasattr(layer, "blend")


@dataclass(frozen=True, eq=False)
class LayerWrapper:
    """Base of layers that modify the light of another layer, whose name and range they keep."""

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
    """True if it is painted on a map of directions, so that a rotation of the camera shifts it."""
    endless: ClassVar[bool] = False
    """True if ground fills the image in every direction. It passes below a moving camera if `surface_m` is given."""
    surface: ClassVar[str] = "ground"
    """Word for the lower part of the background in messages."""

    @property
    def files(self) -> tuple[Path, ...]:
        """Files from which the background is read."""
        return ()

    @abstractmethod
    def layers(self, context: SceneContext) -> Sequence[Layer]:
        """Return the layers, the farthest first; only the first is opaque."""

    def names(self) -> Names:
        """Yield name and path of keys of each layer that --without can switch off: of all but the opaque one."""
        yield from ()

    def parallax_surfaces(self) -> Surfaces:
        """Yield name, path of keys and surface of each part painted around the first camera position."""
        yield from ()

    @property
    def surface_m(self) -> float | None:
        """Depth of level ground or sea below the first camera position, m; None without level ground or sea up to the
        horizon."""
        return None

    @property
    def leaves_k(self) -> float | None:
        """Temperature of foliage at its `hour`, K; None without an hour."""
        return None

    def altitude_m(self, given: float) -> float:
        """Return the height of the first camera position above the sea, m: `given`, or the height above the ground if
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
        """The background without objects and ground cover, which has an equal `ground_radiance`."""
        return self

    def ground_radiance(self, context: SceneContext) -> GroundRadiance | None:
        """Return the radiance of its bare ground or sea; None without one."""
        return None

    def ambient(self, context: SceneContext) -> float:
        """Return the radiance of the surroundings, W/m2/sr, that bodies reflect unless the atmosphere sets it.

        It is the mean of the radiances of the clear sky (`hemisphere`) and the ground, which by default is as bright as
        the sky at the horizon. Without a sky it is the radiance of a black body at the standard air temperature.
        """
        sky = self.clear(context)
        if sky is None:
            return float(radiance(context.band, STANDARD_K))
        return (hemisphere(sky.radiance) + self._ground_light(sky, context)) / 2

    def _ground_light(self, sky: ClearLayer, context: SceneContext) -> float:
        """Return the radiance, W/m2/sr, of the ground below its sky."""
        return float(sky.radiance(np.zeros(1))[0])

    @property
    def recorded_targets(self) -> Mapping[str, str | None]:
        """Class of each target of recorded frames, by its id in the recording."""
        return {}

    def recorded_truth(self, index: int) -> tuple[TargetTruth, ...]:
        """Return the ground truth of the recorded frame behind frame `index`; () where the recording has none."""
        return ()

    def recorded_camera(self, camera: CameraFacts) -> CameraFacts:
        """Return the camera whose counts the frames contain: the scenario's camera, or that of a recording."""
        return camera

    def camera_fault(self, size: tuple[int, int], bits: int) -> str | None:
        """Return the reason why a camera of a size (columns, rows) and bit depth does not fit; None if it fits."""
        return None
