"""Hypothesis strategies for scenes: parts, whole scenarios, and texts and files that are broken.

Every difficulty has an integer severity from 0 (benign) to 5, so Hypothesis shrinks to the mildest scene that still
fails, without parts that do not contribute. The scene's seed is drawn last; pixels are rendered, never drawn. Parts are
mappings as in YAML; `scenarios` combines them.

    from hypothesis import given
    from irsim import strategies

    @given(strategies.scenarios(occlusion=strategies.occlusions()))
    def test_mine(scenario): ...
"""

from __future__ import annotations

from irsim.strategies.damage import damaged_recordings, invalid_texts, mutated_texts
from irsim.strategies.documents import documents, scenarios
from irsim.strategies.scenes import (
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
