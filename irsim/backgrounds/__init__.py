"""What is behind everything: sky with clouds, ground, landscapes, the sea; or frames of a recording.

Layers in angle, ground and sea of a height on a plane: a turning camera moves them rightly. Recorded frames stay.
"""

from irsim.backgrounds.base import (
    Background,
    ClearLayer,
    Filmed,
    LandLight,
    Layer,
    SemiTransparentLayer,
    ViewDirection,
    is_veil,
    opaque,
    veiled,
)
from irsim.backgrounds.cut import cut
from irsim.backgrounds.ground import Ground
from irsim.backgrounds.landscape import Landscape
from irsim.backgrounds.recorded import Footage, Recorded
from irsim.backgrounds.sea import Sea
from irsim.backgrounds.sky import Sky
from irsim.backgrounds.swept import Swept
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
    "Filmed",
    "Footage",
    "Ground",
    "LandLight",
    "Landscape",
    "Layer",
    "Recorded",
    "Sea",
    "SemiTransparentLayer",
    "Sky",
    "Slices",
    "Swept",
    "ViewDirection",
    "cut",
    "is_veil",
    "opaque",
    "veiled",
]
