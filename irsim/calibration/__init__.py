"""Calibration: noise, bad pixels, fixed pattern, PSF and texture of recordings, with 95 % intervals.

Estimators are pure functions of the counts (frames, rows, columns) of a real or rendered recording.
"""

from irsim.calibration.background_classes import CLASSES, TextureFigures, texture_figures
from irsim.calibration.bad_pixels import BadPixels, find_bad_pixels
from irsim.calibration.figures import FRAMES, Figures, measure_figures
from irsim.calibration.fit import Fit
from irsim.calibration.noise import NoiseReport, measure_noise
from irsim.calibration.noise_3d import Noise3dTerms, noise_3d
from irsim.calibration.realism import CAMERAS, Realism, compare_noise, compare_texture, measure_realism
from irsim.calibration.selection import Region, flattest
from irsim.calibration.statistics import Estimate
from irsim.calibration.temporal import Memory, Temporal, temporal_noise
from irsim.calibration.texture import PowerLaw

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
