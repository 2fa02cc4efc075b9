"""From counts to the 8-bit picture: automatic gain control (AGC)."""

from typing import Annotated

from irsim.camera.agc import MID_GREY, Adaptive, Agc, Look, Picture, Pixels, Ranking, histogram
from irsim.camera.agc_linear import Fixed, Linear, Plain
from irsim.camera.agc_local import CURVES, Around, Clahe, Unsharp
from irsim.camera.agc_plateau import Plateau
from irsim.camera.agc_sequence import Screen
from irsim.config.base import Family, Part

AGCS = Family("agc", Agc, {**CURVES.kinds, "clahe": Clahe, "unsharp": Unsharp})
"""Ways from counts to 8 bits."""


class Shown(Part):
    """How frames are displayed that no camera of a scenario stands behind."""

    agc: Annotated[Agc, AGCS]
    """How counts become the 8-bit picture."""


__all__ = [
    "AGCS",
    "CURVES",
    "MID_GREY",
    "Adaptive",
    "Agc",
    "Around",
    "Clahe",
    "Fixed",
    "Linear",
    "Look",
    "Picture",
    "Pixels",
    "Plain",
    "Plateau",
    "Ranking",
    "Screen",
    "Shown",
    "Unsharp",
    "histogram",
]
