"""Backgrounds: sky with clouds, ground, landscapes, the sea, and recorded frames."""

from irsim.backgrounds.base import (
    Background,
    ClearLayer,
    GroundRadiance,
    Layer,
    RecordedLayer,
    SemiTransparentLayer,
    ViewDirection,
    blend_over,
    is_semi_transparent,
    opaque_error,
)
from irsim.backgrounds.ground import Ground
from irsim.backgrounds.landscape import Landscape
from irsim.backgrounds.layers import MotionBlurredLayer, crop
from irsim.backgrounds.recorded import Footage, Recorded
from irsim.backgrounds.sea import Sea
from irsim.backgrounds.sky import Sky
from irsim.config.base import Family
from irsim.types import Slices

BACKGROUNDS = Family(
    "background",
    Background,
    {"sky": Sky, "ground": Ground, "landscape": Landscape, "sea": Sea, "recording": Recorded},
    {
        "clouds": "sky",
        "terrain": "ground",
        "horizon": "landscape",
        "ocean": "sea",
        "water": "sea",
        "video": "recording",
    },
)

__all__ = [
    "BACKGROUNDS",
    "Background",
    "ClearLayer",
    "Footage",
    "Ground",
    "GroundRadiance",
    "Landscape",
    "Layer",
    "MotionBlurredLayer",
    "Recorded",
    "RecordedLayer",
    "Sea",
    "SemiTransparentLayer",
    "Sky",
    "Slices",
    "ViewDirection",
    "blend_over",
    "crop",
    "is_semi_transparent",
    "opaque_error",
]
