"""All warnings of a scenario."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from irsim.errors import Notice
from irsim.lint.air import beyond_fit, far_ground, high_skies, long_paths, long_views, unlike_skies
from irsim.lint.background import cold_clouds, folded, large_features, off_scale, upside_down
from irsim.lint.camera import beads, follows_nobody, noisy, rounded_off, sunken, uncounted
from irsim.lint.cold import colder_than_space
from irsim.lint.crossing import misses, turned
from irsim.lint.display import odd_greys, tiny_tiles
from irsim.lint.effect import overruled, two_exposures, without_effect
from irsim.lint.endless import ground_in_the_sky, ground_to_the_horizon, left_behind, stays_behind
from irsim.lint.footage import unknown_scale, unlike_recording, untouched
from irsim.lint.horizon import beyond_horizon
from irsim.lint.lens import unlike_pupils
from irsim.lint.many import built_up, crowded
from irsim.lint.paths import pulls, through_camera
from irsim.lint.speeds import too_fast
from irsim.lint.standing import aloft, buried, unlike_level
from irsim.lint.targets import hardly_seen, idle, nowhere, odd_shapes, past_the_end, standing_still, too_late
from irsim.lint.unreachable_contrast import out_of_reach
from irsim.lint.unseen import mostly_hidden
from irsim.scenario.model import Scenario
from irsim.scenario.placement_all import overdone

INEFFECTIVE = (overruled, without_effect)
"""Checks for keys without effect beside others."""

DOUBTS = (
    *(beyond_fit, *INEFFECTIVE, two_exposures, long_paths, long_views, far_ground, high_skies, unlike_skies),
    *(off_scale, upside_down, cold_clouds, colder_than_space, large_features, folded),
    *(crowded, built_up),
    *(unlike_pupils, ground_in_the_sky, ground_to_the_horizon, stays_behind, left_behind),
    *(unknown_scale, unlike_recording, untouched),
    *(odd_greys, tiny_tiles, through_camera, pulls, too_fast, misses, turned),
    *(
        noisy,
        rounded_off,
        uncounted,
        follows_nobody,
        beads,
        sunken,
        odd_shapes,
        standing_still,
        out_of_reach,
        too_late,
        past_the_end,
        nowhere,
        unlike_level,
        buried,
        aloft,
        beyond_horizon,
        hardly_seen,
        mostly_hidden,
        idle,
        overdone,
    ),
)


def doubts(scenario: Scenario, looked: Callable[[], None] | None = None) -> Iterator[Notice]:
    """Warnings, such as of a path longer than any that the atmosphere was fitted to; none of what is switched off.

    looked   called after each of DOUBTS, for some of them take long
    """
    for doubt in DOUBTS:
        yield from _of_what_is_on(scenario, (doubt,))
        if looked is not None:
            looked()


def ineffective(scenario: Scenario) -> Iterator[Notice]:
    """Yield the warnings of keys without effect beside others."""
    yield from _of_what_is_on(scenario, INEFFECTIVE)


def _of_what_is_on(scenario: Scenario, kinds: Iterable[Callable[[Scenario], Iterator[Notice]]]) -> Iterator[Notice]:
    off = [place for name, place in scenario.settings() if not scenario.is_on(name)]
    for doubt in kinds:
        for notice in doubt(scenario):
            if _counts(scenario, notice.at) and not any(notice.at[: len(place)] == place for place in off):
                yield notice


def _counts(scenario: Scenario, at: tuple[str | int, ...]) -> bool:
    """Whether all parts on the way to a place are switched on."""
    part: object = scenario
    for step in at:
        if isinstance(step, int):
            part = part[step] if isinstance(part, Sequence) and step < len(part) else None
        else:
            part = getattr(part, step, None)
        name = getattr(part, "id", None) or getattr(part, "name", None)
        if isinstance(name, str) and not scenario.is_on(name):
            return False
    return True
