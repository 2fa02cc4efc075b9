"""The camera: sensor, noise, signal chain, automatic gain control and frame loss, and the tables of their kinds.

`irsim.camera.camera.Camera` holds the camera keys of a scenario and builds the `SignalChain` from light to counts.
"""

from typing import Annotated

from irsim.camera.agc import Agc
from irsim.camera.agc_local import CURVES, Clahe, Unsharp
from irsim.camera.ar1 import Ar1
from irsim.camera.bad_pixels import BadPixels
from irsim.camera.drift import Drift
from irsim.camera.frame_loss import Drop, Duplicate, FrameFault
from irsim.camera.noise import FixedPattern, Noise3d, OddEven, Shot, White
from irsim.camera.noise_base import Noise
from irsim.camera.sensor import ElectronSensor, NetdSensor, Sensor
from irsim.camera.video import Video
from irsim.config.base import Family, Part

SENSORS = Family("detector", Sensor, {"stated": NetdSensor, "electrons": ElectronSensor})
"""Focal planes: the kinds of a camera's `detector`."""

NOISES = Family(
    "noise",
    Noise,
    {
        "white": White,
        "shot": Shot,
        "fixed_pattern": FixedPattern,
        "ar1": Ar1,
        "noise_3d": Noise3d,
        "drift": Drift,
        "odd_even": OddEven,
        "bad_pixels": BadPixels,
    },
)
"""Noise terms."""

FRAME_FAULTS = Family("fault", FrameFault, {"drop": Drop, "duplicate": Duplicate})
"""Transmission faults of frames."""

AGCS = Family("agc", Agc, {**CURVES.kinds, "clahe": Clahe, "unsharp": Unsharp, "video": Video})
"""Gain controls: mappings of counts to 8 bits."""


class DisplaySettings(Part):
    """Display of frames without a scenario, such as imported frames."""

    agc: Annotated[Agc, AGCS]
    """Mapping of counts to the 8-bit picture."""


__all__ = ["AGCS", "CURVES", "FRAME_FAULTS", "NOISES", "SENSORS", "DisplaySettings"]
