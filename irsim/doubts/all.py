"""All warnings of a scenario."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.doubts.air import beyond_fit, long_paths, long_views, unlike_skies
from irsim.doubts.background import cold_clouds, folded, large_features, off_scale
from irsim.doubts.camera import beads, sunken
from irsim.doubts.effect import overruled, without_effect
from irsim.doubts.targets import buried, idle, never_seen, nowhere, odd_shapes, past_the_end, too_late
from irsim.errors import Notice
from irsim.intent import overlong
from irsim.reach import out_of_reach
from irsim.scenario import Scenario

DOUBTS = (
    *(beyond_fit, overruled, without_effect, long_paths, long_views, unlike_skies),
    *(off_scale, cold_clouds, large_features, folded),
    *(beads, sunken, odd_shapes, out_of_reach, too_late, past_the_end, nowhere, buried, never_seen, idle, overlong),
)


def doubts(scenario: Scenario) -> Iterator[Notice]:
    """Warnings, such as of a path longer than any that the atmosphere was fitted to."""
    for doubt in DOUBTS:
        yield from doubt(scenario)
