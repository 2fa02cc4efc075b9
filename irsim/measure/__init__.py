"""Figures of recordings, real and rendered ones alike: pure functions of arrays."""

from irsim.measure.backdrop import backdrops
from irsim.measure.boxes import taken_by_targets
from irsim.measure.compared import Realism, measure_realism
from irsim.measure.counts import Timed, read_counts, read_timed
from irsim.measure.defects import Defects, defects
from irsim.measure.depth import EIGHT_BITS, perhaps_pictures
from irsim.measure.figures import FRAMES, Figures, measure_figures
from irsim.measure.flat_windows import flattest
from irsim.measure.interval import Measured
from irsim.measure.memory import Memory, Temporal, temporal
from irsim.measure.noise import NoiseReport, measure_noise
from irsim.measure.noise_3d import Noise3dTerms, noise_3d
from irsim.measure.realism import CLASSES, Judged, Verdict, check_class, judge, judge_classes
from irsim.measure.realism_noise import (
    CAMERAS,
    check_sort,
    judge_sorts,
    noise_figures,
)
from irsim.measure.region import Region, parse_region
from irsim.measure.rounding import ROUNDING
from irsim.measure.spectrum import Texture, texture
from irsim.measure.words import noise_lines

__all__ = [
    "CAMERAS",
    "CLASSES",
    "EIGHT_BITS",
    "FRAMES",
    "ROUNDING",
    "Defects",
    "Figures",
    "Judged",
    "Measured",
    "Memory",
    "Noise3dTerms",
    "NoiseReport",
    "Realism",
    "Region",
    "Temporal",
    "Texture",
    "Timed",
    "Verdict",
    "backdrops",
    "check_class",
    "check_sort",
    "defects",
    "flattest",
    "judge",
    "judge_classes",
    "judge_sorts",
    "measure_figures",
    "measure_noise",
    "measure_realism",
    "noise_3d",
    "noise_figures",
    "noise_lines",
    "parse_region",
    "perhaps_pictures",
    "read_counts",
    "read_timed",
    "taken_by_targets",
    "temporal",
    "texture",
]
