"""Hypothesis strategies for scenes: parts, whole scenarios, and texts and files that are broken.

Everything hard is a whole severity from 0 to 5, and 0 is benign: so what Hypothesis shrinks to is the mildest
scene that still fails, with nothing in it that has no share in the failure. The scene's seed is drawn last, pixels
never. Parts are mappings as YAML has them; `scenarios` puts them together.

    from hypothesis import given
    from irsim import strategies

    @given(strategies.scenarios(occlusion=strategies.occlusions()))
    def test_mine(scenario): ...
"""

from __future__ import annotations

from irsim.strategies.damage import damaged_recordings
from irsim.strategies.parts import (
    TOP,
    camera_motions,
    cameras,
    clutters,
    countries,
    crossings,
    decoys,
    frame_faults,
    manoeuvres,
    noises,
    occlusions,
    paths,
    seeds,
    severities,
    shapes,
    skies,
    straights,
    weaves,
)
from irsim.strategies.texts import invalid_texts, mutated_texts
from irsim.strategies.whole import documents, scenarios

__all__ = [
    "TOP",
    "camera_motions",
    "cameras",
    "clutters",
    "countries",
    "crossings",
    "damaged_recordings",
    "decoys",
    "documents",
    "frame_faults",
    "invalid_texts",
    "manoeuvres",
    "mutated_texts",
    "noises",
    "occlusions",
    "paths",
    "scenarios",
    "seeds",
    "severities",
    "shapes",
    "skies",
    "straights",
    "weaves",
]
