"""From radiance to counts: the detector's response, its noise terms and its quantisation."""

from irsim.camera.ar1 import Ar1
from irsim.camera.bad_pixels import MOST_BAD, BadPixels
from irsim.camera.bloom import Bloom
from irsim.camera.correction import Correction
from irsim.camera.drift import Drift
from irsim.camera.fixed_pattern import FixedPattern
from irsim.camera.matched_detector import electrons_like
from irsim.camera.noise_3d import Noise3d
from irsim.camera.noise_base import Additive, FrameContext, Noise, Steady
from irsim.camera.odd_even import OddEven
from irsim.camera.response import DETECTORS, NETD_K, Detector, Electrons, Response, Setting, Stated
from irsim.camera.response_time import Lag
from irsim.camera.sensor import Sensor
from irsim.camera.shot import Shot
from irsim.camera.white import White
from irsim.config.base import Family

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
"""Noise terms of a detector."""

__all__ = [
    "DETECTORS",
    "MOST_BAD",
    "NETD_K",
    "NOISES",
    "Additive",
    "Ar1",
    "BadPixels",
    "Bloom",
    "Correction",
    "Detector",
    "Drift",
    "Electrons",
    "FixedPattern",
    "FrameContext",
    "Lag",
    "Noise",
    "Noise3d",
    "OddEven",
    "Response",
    "Sensor",
    "Setting",
    "Shot",
    "Stated",
    "Steady",
    "White",
    "electrons_like",
]
