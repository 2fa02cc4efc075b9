"""Base classes of occluders: keys of position and size, placement by a target to hide, drawing of flat facets."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Annotated, ClassVar, Self, TypeVar

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import Name, NamedKind
from irsim.config.quantities import Fraction, Kelvin, Positive, Range, Stretch
from irsim.geometry.context import SceneContext
from irsim.geometry.polygon import polygon_edges
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.silhouette import LayeredPolygons, clip_to_view, draw_sprite
from irsim.geometry.sprite import Sprite
from irsim.types import Box, Floats, arrays_frozen

T = TypeVar("T")
AnyOccluder = TypeVar("AnyOccluder", bound="Occluder")

Size = Annotated[tuple[Positive, Positive], Field(strict=False)]
"""[width, height]."""


class Occluder(NamedKind):
    """An object that hides the targets behind it; it is fixed in space, except smoke, which drifts.

    The keys give either position and size (`placement_keys`), or a target to hide (`hides`) and the frames in which to
    hide it (`frames`), from which `irsim.scenario.placement` computes position and size. The unmoved camera is the
    camera at its first position and pointing, with a zoom of 1.
    """

    placement_keys: ClassVar[tuple[str, ...]] = ()
    """Keys of position and size."""
    translucent: ClassVar[bool] = False
    """True if placement by `hides` lowers the opacity for a `fraction` below 1; False if it lowers the size."""
    slender: ClassVar[bool] = False
    """True for a kind that is narrow in nature, such as a pole."""

    range_m: Range
    """Distance from the first camera position, m; the occluder hides farther objects."""
    hides: Name | None = None
    """Id of the target to hide; position and size of the occluder then follow from the path of the target. Default:
    none."""
    frames: Stretch | None = None
    """[first, last] frame, inclusive, between which the target is hidden; required with `hides`."""
    fraction: Annotated[float, Field(gt=0, le=1)] = 1.0
    """Share of the target that the occluder hides, at least, in each of `frames`; parts of the target outside the
    picture do not count. The search is accurate to 0.001. A warning reports frames in which 0.2 more is hidden."""

    @model_validator(mode="after")
    def _place_or_intent(self) -> Self:
        given = [key for key in self.placement_keys if getattr(self, key) is not None]
        missing = [key for key in self.placement_keys if key not in given]
        needed = " and ".join(self.placement_keys)
        if self.hides is None and missing:
            raise misplaced(missing[0], f"it is missing; allowed: {needed}, or 'hides' and 'frames'")
        if self.hides is None and self.frames is not None:
            raise misplaced("frames", "'frames' needs a target to hide; allowed: with 'hides'")
        if self.hides is None:
            return self
        if given:
            raise misplaced(given[0], f"its place follows from 'hides'; allowed: {needed}, or 'hides'")
        if self.frames is None:
            raise misplaced("frames", "'hides' needs the frames to hide it in; allowed: [first, last] frame")
        if self.frames[1] < self.frames[0]:
            raise misplaced("frames", "its last frame is before its first; allowed: [first, last] frame")
        return self

    @abstractmethod
    def draw(self, pose: CameraPose) -> Sprite | None:
        """Return the sprite for a camera pose; None if the occluder is out of view.

        The `range_m` of the sprite is the distance from the camera to the middle of the occluder
        (`CameraPose.distance_m`).
        """

    def extent(self, context: SceneContext) -> Box | None:
        """Return the bounding box over all frames, px of the unmoved camera; None if unknown."""
        return None

    def covering(self, window: Box, density: float, context: SceneContext) -> Self:
        """Return a copy without `hides` whose position and size make it cover `window`, px of the unmoved camera.

        density  opacity 0..1 of a `translucent` kind; other kinds ignore it
        Raises ValueError if this kind cannot be placed by `hides`.
        """
        raise ValueError(f"a {self.kind} cannot be placed by 'hides'; allowed: its place")

    def standing_at(self, y: float) -> Self:
        """Return a copy whose foot lies no lower than row `y`, px of the unmoved camera, if its shape permits."""
        return self

    def shortfall(self, placed: Occluder) -> tuple[str, str] | None:
        """Return (key, reason) for a key whose value differs in `placed`, the copy at its place; None if no value
        differs."""
        return None

    def placed(self, **place: object) -> Self:
        """Return a copy with the given position and size, and without `hides` and `frames`."""
        return self.model_copy(update={"hides": None, "frames": None, **place})


def misplaced(key: str, reason: str) -> PydanticCustomError:
    """Return the validation error for a key, with its reason."""
    return PydanticCustomError("place", "{reason}", {"reason": reason, "at": (key,)})


def required(value: T | None) -> T:
    """Return the value of a placement key. Raises ValueError if it is None, as it is until `hides` is resolved."""
    if value is None:
        raise ValueError("the occluder has no place yet: irsim.scenario.placement finds it")
    return value


def bounding_box(points: Floats) -> Box:
    """Return the bounding box of points (n, 2) px."""
    return Box.from_edges(*points.min(axis=0).tolist(), *points.max(axis=0).tolist())


def cached_by_pose(
    draw: Callable[[AnyOccluder, CameraPose], Sprite | None],
) -> Callable[[AnyOccluder, CameraPose], Sprite | None]:
    """Return a drawing function that reuses its last sprites for a camera at rest. The sprites must not depend on
    time."""

    @lru_cache(maxsize=32)
    def drawn(
        occluder: AnyOccluder, context: SceneContext, lens: Geometry, rotation: bytes, place: bytes
    ) -> Sprite | None:
        return draw(occluder, CameraPose(context, lens, np.frombuffer(rotation).reshape(3, 3), np.frombuffer(place)))

    return lambda occluder, pose: drawn(
        occluder, pose.context, pose.lens, pose.rotation.tobytes(), pose.place.tobytes()
    )


Facet = tuple[Floats, float]
"""A convex polygon (n, 2), px of the unmoved camera, and its temperature, K."""


class Opaque(Occluder):
    """An opaque occluder made of flat convex facets."""

    temperature_k: Kelvin = 290.0
    """Temperature, kelvin."""
    emissivity: Fraction = 0.95
    """Emissivity."""

    @abstractmethod
    def facets(self, context: SceneContext) -> Sequence[Facet]:
        """Return the facets, the nearest first, in px of the unmoved camera."""

    def extent(self, context: SceneContext) -> Box | None:
        return bounding_box(np.concatenate([points for points, _ in self.facets(context)]))

    def draw(self, pose: CameraPose) -> Sprite | None:
        return _draw_facets(self, pose)


@cached_by_pose
def _draw_facets(occluder: Opaque, pose: CameraPose) -> Sprite | None:
    context = pose.context
    facets = occluder.facets(context)
    polygons = [pose.pixels(points, occluder.range_m) for points, _ in facets]
    corners = np.concatenate(polygons)
    if not np.isfinite(corners).all():
        return None
    box = bounding_box(corners)
    window = clip_to_view(box, pose.zoomed)
    if window is None:
        return None
    edges = [polygon_edges(points) for points in polygons]
    start, stop = (np.concatenate(ends) for ends in zip(*edges, strict=True))
    layer = np.repeat(np.arange(len(facets)), [len(points) for points in polygons])
    glow = context.grey_body_radiance(np.array([kelvin for _, kelvin in facets]), occluder.emissivity)
    distance_m = pose.distance_m(bounding_box(np.concatenate([points for points, _ in facets])), occluder.range_m)
    layers = LayeredPolygons((start, stop, layer), glow, box, window, pose.zoomed.psf, distance_m)
    return arrays_frozen(draw_sprite(layers))
