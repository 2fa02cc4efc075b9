"""Calibration: noise, bad pixels, fixed pattern, PSF and texture of recordings, with 95 % intervals.

Recordings are real or rendered; every estimator is a pure function of an array (frames, rows, columns) of counts.
"""

from irsim.calibration.bad_pixels import BadPixels, find_bad_pixels
from irsim.calibration.figures import FRAMES, Figures, measure_figures
from irsim.calibration.fit import Fit
from irsim.calibration.noise import Noise3dTerms, NoiseReport, measure_noise, noise_3d
from irsim.calibration.realism import CAMERAS, CLASSES, Realism, compare_noise, compare_texture, measure_realism
from irsim.calibration.selection import Region, flattest
from irsim.calibration.statistics import Estimate
from irsim.calibration.temporal import Memory, Temporal, temporal_noise
from irsim.calibration.texture import PowerLaw, TextureFigures, texture_figures

__all__ = [
    "CAMERAS",
    "CLASSES",
    "FRAMES",
    "BadPixels",
    "Estimate",
    "Figures",
    "Fit",
    "Memory",
    "Noise3dTerms",
    "NoiseReport",
    "PowerLaw",
    "Realism",
    "Region",
    "Temporal",
    "TextureFigures",
    "compare_noise",
    "compare_texture",
    "find_bad_pixels",
    "flattest",
    "measure_figures",
    "measure_noise",
    "measure_realism",
    "noise_3d",
    "temporal_noise",
    "texture_figures",
]
