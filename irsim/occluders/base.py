"""What an occluder is, and how the camera sees it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Annotated, ClassVar, Self, TypeVar

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import Name, NamedKind
from irsim.config.quantities import Fraction, Kelvin, Range, Stretch
from irsim.geometry.context import SceneContext
from irsim.geometry.polygon import polygon_edges
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.silhouette import LayeredPolygons, clip_to_view, draw_sprite
from irsim.geometry.sprite import Sprite
from irsim.types import Box, Floats, arrays_frozen

T = TypeVar("T")
AnyOccluder = TypeVar("AnyOccluder", bound="Occluder")


class Occluder(NamedKind):
    """Something between the camera and the targets behind it; it stands still in space, but smoke drifts.

    It has a place, or an intent: whom it hides, and when. irsim.scenario.placement_all finds the place for that.
    """

    placing: ClassVar[tuple[str, ...]] = ()
    """The keys that give its place."""
    thins: ClassVar[bool] = False
    """Does it hide less by being thinner? Otherwise by being smaller."""
    slender: ClassVar[bool] = False
    """Is it odd for it to be wide? It is warned of where a carried camera makes it so."""

    range_m: Range
    """Metres from where the camera first stands; it hides what is farther."""
    hides: Name | None = None
    """Id of a target that it shall hide: given instead of its place."""
    frames: Stretch | None = None
    """[first, last] frame, both counted, in which it shall hide it."""
    fraction: Annotated[float, Field(gt=0, le=1)] = 1.0
    """How much of what is in the picture of the target it shall hide in those frames, at least (to 0.001; but for a
    trace of all of it). 0.2 more is warned of."""

    @model_validator(mode="after")
    def _place_or_intent(self) -> Self:
        given = [key for key in self.placing if getattr(self, key) is not None]
        needed = " and ".join(self.placing)
        if self.hides is None:
            missing = [key for key in self.placing if key not in given]
            if missing:
                raise PydanticCustomError(
                    "no_place", "it is missing; allowed: {needed}, or 'hides' and 'frames'",
                    {"needed": needed, "at": (missing[0],)},
                )  # fmt: skip
            if self.frames is not None:
                raise PydanticCustomError(
                    "intent", "'frames' says when it hides whom; allowed: with 'hides'", {"at": ("frames",)}
                )
            return self
        if given:
            raise PydanticCustomError(
                "two_places", "its place follows from whom it hides; allowed: {needed}, or 'hides'",
                {"needed": needed, "at": (given[0],)},
            )  # fmt: skip
        if self.frames is not None and self.frames[1] < self.frames[0]:
            raise PydanticCustomError(
                "intent", "its last frame is before its first; allowed: [first, last] frame", {"at": ("frames",)}
            )
        if self.frames is None:
            raise PydanticCustomError(
                "intent", "it says whom it hides, but not when; allowed: [first, last] frame", {"at": ("frames",)}
            )
        return self

    @abstractmethod
    def draw(self, pose: CameraPose) -> Sprite | None:
        """The occluder as the camera sees it, as far as its middle is from there (`sight.away_m`); None where it cannot
        be seen."""

    def extent(self, context: SceneContext) -> Box | None:
        """What holds all of it, px of the unmoved camera, in any frame; None where that is not known."""
        return None

    def over(self, window: Box, share: float, context: SceneContext) -> Self:
        """The same with a place that covers `window`, px of the unmoved camera, and no intent.

        share: how dense it is, 0..1, where `thins`. ValueError where it cannot be placed by intent.
        """
        raise ValueError(f"a {self.kind} cannot be placed by whom it hides; allowed: its place")

    def rooted(self, y: float) -> Self:
        """The same, placed, that stands no lower than at `y` px of the unmoved camera, where its shape permits."""
        return self

    def short(self, placed: Occluder) -> tuple[str, str] | None:
        """A key of which it has less where its intent placed it than it says, and why; None where it has all."""
        return None

    def at(self, **place: object) -> Self:
        """The same with a place and no intent."""
        return self.model_copy(update={"hides": None, "frames": None, **place})


def given(value: T | None) -> T:
    """A key of the place; ValueError where there is an intent instead, whose place has yet to be found."""
    if value is None:
        raise ValueError("the occluder has no place yet: irsim.scenario.placement_all finds it")
    return value


def bounds(points: Floats) -> Box:
    """The box that holds points (n, 2) px."""
    return Box.from_edges(*points.min(axis=0).tolist(), *points.max(axis=0).tolist())


Facet = tuple[Floats, float]
"""A convex outline (n, 2), px of the unmoved camera, and its temperature, K."""


def kept(
    draw: Callable[[AnyOccluder, CameraPose], Sprite | None],
) -> Callable[[AnyOccluder, CameraPose], Sprite | None]:
    """A drawing that heeds no time, kept for a camera that stands still."""

    @lru_cache(maxsize=32)
    def drawn(
        occluder: AnyOccluder, context: SceneContext, lens: Geometry, rotation: bytes, place: bytes
    ) -> Sprite | None:
        return draw(occluder, CameraPose(context, lens, np.frombuffer(rotation).reshape(3, 3), np.frombuffer(place)))

    return lambda occluder, pose: drawn(
        occluder, pose.context, pose.lens, pose.rotation.tobytes(), pose.place.tobytes()
    )


class Opaque(Occluder):
    """An occluder of flat, convex facets that hide what is behind them altogether."""

    temperature_k: Kelvin = 290.0
    """Kelvin."""
    emissivity: Fraction = 0.95

    @abstractmethod
    def facets(self, context: SceneContext) -> Sequence[Facet]:
        """Its facets, the nearest first, as the unmoved camera sees them."""

    def extent(self, context: SceneContext) -> Box | None:
        return bounds(np.concatenate([points for points, _ in self.facets(context)]))

    def draw(self, pose: CameraPose) -> Sprite | None:
        return _drawn(self, pose)


@kept
def _drawn(occluder: Opaque, pose: CameraPose) -> Sprite | None:
    """Facets drawn."""
    context = pose.context
    facets = occluder.facets(context)
    outlines = [pose.pixels(points, occluder.range_m) for points, _ in facets]
    corners = np.concatenate(outlines)
    if not np.isfinite(corners).all():
        return None
    box = bounds(corners)
    window = clip_to_view(box, pose.zoomed)
    if window is None:
        return None
    edges = [polygon_edges(points) for points in outlines]
    start, stop = (np.concatenate(ends) for ends in zip(*edges, strict=True))
    layer = np.repeat(np.arange(len(facets)), [len(points) for points in outlines])
    glow = context.glow(np.array([kelvin for _, kelvin in facets]), occluder.emissivity)
    away_m = pose.distance_m(bounds(np.concatenate([points for points, _ in facets])), occluder.range_m)
    return arrays_frozen(draw_sprite(LayeredPolygons((start, stop, layer), glow, box, window, pose.zoomed.psf, away_m)))
