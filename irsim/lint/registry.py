"""Table of a scenario's checks: each yields warnings about values that are valid but doubtful."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from irsim.errors import Notice
from irsim.lint import (
    atmosphere,
    backgrounds,
    camera,
    contrast,
    ground,
    motion,
    occluders,
    recording,
    saturation,
    targets,
    values,
)
from irsim.scenario.model import Scenario

Check = Callable[[Scenario], Iterator[Notice]]

INEFFECTIVE: tuple[Check, ...] = (values.key_overruled, values.key_without_effect)
"""Checks for keys that have no effect because of other keys."""

CHECKS: tuple[Check, ...] = (
    atmosphere.atmosphere_beyond_fit,
    *INEFFECTIVE,
    camera.exposure_mismatch,
    atmosphere.target_beyond_fit,
    atmosphere.layer_beyond_fit,
    atmosphere.ground_beyond_fit,
    atmosphere.sky_unlike_atmosphere,
    saturation.background_saturated,
    backgrounds.sky_inverted,
    backgrounds.clouds_colder_than_sky,
    backgrounds.cloud_features_too_large,
    backgrounds.projection_distorted,
    backgrounds.clutter_too_dense,
    camera.aperture_mismatch,
    ground.ground_above_horizon,
    ground.ground_near_horizon,
    ground.ground_without_parallax,
    backgrounds.background_layer_passed,
    recording.recording_scale_unknown,
    recording.recording_camera_mismatch,
    recording.camera_key_without_effect,
    saturation.agc_range_unused,
    saturation.clahe_tiles_too_small,
    motion.target_through_camera,
    motion.acceleration_implausible,
    motion.speed_implausible,
    motion.crossing_without_contact,
    camera.netd_implausible,
    camera.noise_below_one_count,
    camera.shot_noise_missing,
    motion.camera_follows_disabled_target,
    camera.motion_blur_steps_too_few,
    motion.camera_below_ground,
    targets.shape_implausible,
    targets.rotation_aliased,
    contrast.contrast_unreachable,
    targets.event_after_last_frame,
    targets.target_in_no_frame,
    ground.target_off_ground_level,
    ground.target_below_ground,
    ground.target_above_ground,
    ground.target_beyond_horizon,
    targets.target_out_of_picture,
    targets.target_mostly_occluded,
    occluders.occluder_without_effect,
    occluders.placed_occluder_excessive,
)


def lint(scenario: Scenario, done: Callable[[], None] | None = None) -> Iterator[Notice]:
    """Yield the warnings of a scenario, except those of parts switched off; `done` is called after each of CHECKS."""
    for check in CHECKS:
        yield from _enabled(scenario, (check,))
        if done is not None:
            done()


def ineffective(scenario: Scenario) -> Iterator[Notice]:
    """Yield warnings about keys that have no effect because of other keys."""
    yield from _enabled(scenario, INEFFECTIVE)


def _enabled(scenario: Scenario, checks: Iterable[Check]) -> Iterator[Notice]:
    """Yield the warnings of `checks`, except those of parts that are switched off."""
    disabled = [place for name, place in scenario.settings() if not scenario.is_on(name)]
    for check in checks:
        for notice in check(scenario):
            if _is_enabled(scenario, notice.at) and not any(notice.at[: len(place)] == place for place in disabled):
                yield notice


def _is_enabled(scenario: Scenario, at: tuple[str | int, ...]) -> bool:
    """Return True if every part along a key path is switched on."""
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
