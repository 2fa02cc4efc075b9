"""From radiance to counts: the detector's noise terms and its quantisation."""

from irsim.detector.ar1 import Ar1
from irsim.detector.base import Noise
from irsim.detector.counts import Response, expose, response
from irsim.detector.fixed_pattern import FixedPattern
from irsim.detector.white import White
from irsim.kinds import Family

NOISES = Family("noise", Noise, {"white": White, "fixed_pattern": FixedPattern, "ar1": Ar1})
"""Noise terms of a detector."""

__all__ = ["NOISES", "Ar1", "FixedPattern", "Noise", "Response", "White", "expose", "response"]
