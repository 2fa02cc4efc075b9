"""From radiance to counts: the detector's response, its noise terms and its quantisation."""

from irsim.detector.alike import electrons_like
from irsim.detector.ar1 import Ar1
from irsim.detector.bad_pixels import MOST_BAD, BadPixels
from irsim.detector.base import Additive, Moment, Noise, Steady
from irsim.detector.bloom import Bloom
from irsim.detector.correction import Correction
from irsim.detector.drift import Drift
from irsim.detector.fixed_pattern import FixedPattern
from irsim.detector.lag import Lag
from irsim.detector.noise_3d import Noise3d
from irsim.detector.odd_even import OddEven
from irsim.detector.response import DETECTORS, NETD_K, Detector, Electrons, Response, Setting, Stated
from irsim.detector.sensor import Sensor
from irsim.detector.shot import Shot
from irsim.detector.white import White
from irsim.kinds import Family

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
    "Lag",
    "Moment",
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
