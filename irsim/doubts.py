"""What is legal in a scenario but may not be meant."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.backgrounds import Sky
from irsim.backgrounds.chart import STEEPEST_DEG, WIDEST_DEG
from irsim.backgrounds.recorded import Recorded
from irsim.backgrounds.sky import FIT_K
from irsim.backgrounds.texture import tile_side
from irsim.detector.response import Electrons, Stated
from irsim.errors import Notice
from irsim.motion import Mount
from irsim.presets import PRESETS
from irsim.radiometry import radiance, temperature
from irsim.reach import out_of_reach
from irsim.scenario import Scenario
from irsim.smear import MOST_STEPS
from irsim.types import Floats
from irsim.watch import LOOKED, Watch

WATCHED = 200
"""Frames, evenly spread, at which warnings look at where targets are."""
BEADS_PX = 1.2
"""Two blurs of the usual sigma, 0.6 px: points farther apart than these are told from each other."""


def doubts(scenario: Scenario) -> Iterator[Notice]:
    """Warnings, such as of a path longer than any that the atmosphere was fitted to."""
    for at, what in scenario.air.notices(scenario.camera.band):
        yield Notice(("atmosphere", *at), what)
    yield from _without_effect(scenario)
    yield from _long_paths(scenario)
    yield from _long_views(scenario)
    yield from _unlike_skies(scenario)
    yield from _off_scale(scenario)
    yield from _cold_clouds(scenario)
    yield from _large_features(scenario)
    yield from _folded(scenario)
    yield from _beads(scenario)
    yield from _odd_shapes(scenario)
    yield from out_of_reach(scenario)
    yield from _too_late(scenario)
    yield from _never_seen(scenario)
    yield from _idle(scenario)


def _without_effect(scenario: Scenario) -> Iterator[Notice]:
    """Keys that are written, but that nothing asks for beside the others."""
    camera, air = scenario.camera, scenario.atmosphere
    if isinstance(camera.detector, Electrons):
        for key in ("netd_mk", "range_k"):
            if key in camera.model_fields_set and key not in PRESETS.get(camera.preset or "ideal", {}):
                yield Notice(("camera", key), "does not count for a detector of kind electrons: its own keys decide")
        if camera.smeared_ms not in (0, camera.detector.integration_ms):
            yield Notice(
                ("camera", "smear", "time_ms"),
                f"{camera.smeared_ms:g} ms are smeared, but the detector integrates for "
                f"{camera.detector.integration_ms:g} ms",
            )
    if air.preset == "none" and scenario.sky_preset is None and "visibility_km" in air.model_fields_set:
        yield Notice(("atmosphere", "visibility_km"), "does not count without a preset, whose transmittance it changes")


def _long_paths(scenario: Scenario) -> Iterator[Notice]:
    """For each target that goes beyond the atmosphere's fit, the first reason why."""
    stage = scenario.stage
    if stage.air.preset == "none" or stage.cast is None:
        return
    frames = np.unique(np.linspace(0, scenario.frames - 1, min(scenario.frames, WATCHED)).round())
    places = stage.cast.standpoints(frames, stage)
    for index, target in enumerate(scenario.targets):
        sight = target.path.positions(frames, stage, target.id) - places
        ranges = np.linalg.norm(sight, axis=-1)
        rises = -sight @ stage.geometry.down
        for k in (ranges.argmin(), ranges.argmax(), rises.argmin(), rises.argmax()):
            why = stage.air.beyond(float(ranges[k]), float(np.arcsin(np.clip(rises[k] / ranges[k], -1, 1))))
            if why is not None:
                yield Notice(("targets", index, "path"), f"frame {frames[k]:.0f}: {why}")
                break


def _long_views(scenario: Scenario) -> Iterator[Notice]:
    """Occluders, and layers of the background at a range of their own, seen beyond the atmosphere's fit."""
    stage, background = scenario.stage, scenario.background
    for family in ("occluders", "clouds", "trees", "buildings"):
        holder, at = (scenario, ()) if family == "occluders" else (background, ("background",))
        for index, thing in enumerate(getattr(holder, family, ())):
            why = stage.air.beyond(thing.range_m, stage.geometry.elevation_rad)
            if why is not None:
                yield Notice((*at, family, index, "range_m"), why)


def _unlike_skies(scenario: Scenario) -> Iterator[Notice]:
    """A sky that is not that of the air before it, which shines wherever there is some."""
    air, sky = scenario.air, scenario.sky_preset
    if isinstance(scenario.background, Sky) and not air.is_clear and air.preset != sky:
        given = "of its own temperatures" if sky is None else f"of {sky}"
        wet = " and ".join(word for word, there in (("rain", air.rain_mm_h), ("fog", air.fog_visibility_km)) if there)
        before = f"{wet} of {float(air.air_k(0.0)):.0f} K" if air.preset == "none" else f"an atmosphere of {air.preset}"
        yield Notice(("background", "preset"), f"the sky is {given} behind {before}: far things will not fade into it")


def _off_scale(scenario: Scenario) -> Iterator[Notice]:
    """A clear sky of which no pixel lies within what the counts can tell."""
    background, stage, camera = scenario.background, scenario.stage, scenario.camera
    if not isinstance(background, Sky):
        return
    axis, half = stage.geometry.elevation_rad, math.atan(stage.geometry.ifov_rad * stage.geometry.size[1] / 2)
    light = background.clear(stage).radiance(np.array([[axis - half, axis + half]]))
    seen, response = temperature(stage.band, light), camera.response()
    signal = response.signal(light.astype(np.float32))
    full, dark = signal.min() >= response.top, signal.max() <= -response.offset * response.gain
    if full or dark:
        beyond = "above: its pixels are full" if full else "below: its pixels are at count 0"
        key = ("range_k",) if isinstance(camera.detector, Stated) else ("detector", "integration_ms")
        yield Notice(("camera", *key), f"all of the clear sky, {seen.min():.0f} to {seen.max():.0f} K, lies {beyond}")


def _cold_clouds(scenario: Scenario) -> Iterator[Notice]:
    """Clouds that are colder than the clear sky low in the picture, where it is warmest.

    In the thermal bands a thick cloud is nearly black and as warm as the air at its height. What a clear sky shows
    behind it comes from the air there and above, which is no warmer.
    """
    background, stage = scenario.background, scenario.stage
    if not isinstance(background, Sky):
        return
    axis, half = stage.geometry.elevation_rad, math.atan(stage.geometry.ifov_rad * stage.geometry.size[1] / 2)
    low = max(axis - half, 0.0)
    if axis + half <= 0:
        return
    sky_k = float(temperature(stage.band, background.clear(stage).radiance(np.array(low))))
    for index, cloud in enumerate(background.clouds):
        light = stage.through(radiance(stage.band, cloud.temperature_k), np.array(1.0), cloud.range_m, axis)
        seen_k = float(temperature(stage.band, light))
        if seen_k < sky_k - FIT_K:
            yield Notice(
                ("background", "clouds", index, "temperature_k"),
                f"{cloud.id} looks {seen_k:.0f} K, colder than the clear sky of {sky_k:.0f} K behind it low in the "
                f"picture, at {math.degrees(low):.1f} degrees; clouds are as warm as the air at their height",
            )


def _large_features(scenario: Scenario) -> Iterator[Notice]:
    """Clouds whose largest features are wider than the texture that they are made of."""
    background, geometry = scenario.background, scenario.stage.geometry
    if not isinstance(background, Sky):
        return
    side = tile_side(geometry.size)
    for index, cloud in enumerate(background.clouds):
        wanted = cloud.correlation_mrad * 1e-3 / geometry.ifov_rad
        if wanted > side:
            yield Notice(
                ("background", "clouds", index, "correlation_mrad"),
                f"{cloud.id}: its largest features would be {wanted:.0f} px wide, but it repeats after {side} px: "
                f"they are as those of {side * geometry.ifov_rad * 1e3:.3g} mrad",
            )


def _folded(scenario: Scenario) -> Iterator[Notice]:
    """Pictures of which backgrounds have no true map: near the zenith or the nadir, or too wide."""
    stage, camera = scenario.stage, scenario.camera
    if isinstance(scenario.background, Recorded):
        return
    frames = np.unique(np.linspace(0, scenario.frames - 1, min(scenario.frames, WATCHED)).round())
    mount = Mount.of(camera.motion, frames, stage)
    grid = np.stack(np.meshgrid(*(np.linspace(0, length - 1, 9) for length in camera.size)), axis=-1)
    rotations = [stage.geometry.world_rotation(turns) for turns in mount.turns]
    seen = np.stack([mount.lens(k).directions(grid) @ rotation for k, rotation in enumerate(rotations)])
    steepest = np.degrees(np.arcsin(np.abs(seen[..., 1]).max(axis=(1, 2)).clip(0, 1)))
    middle = seen[:, len(grid) // 2]
    widest = math.degrees(np.arccos(np.einsum("nk,nk->n", middle[:, 0], middle[:, -1]).clip(-1, 1)).max())
    if steepest.max() > STEEPEST_DEG:
        yield Notice(
            ("camera", "elevation_deg"),
            f"frame {frames[steepest.argmax()]:.0f}: the picture comes within {90 - steepest.max():.0f} degrees of the "
            f"zenith or the nadir, where the background's map ends: nearer than {90 - STEEPEST_DEG:.0f} it is drawn "
            "distorted",
        )
    if widest > WIDEST_DEG:
        yield Notice(
            ("camera", "ifov_mrad"),
            f"the picture is {widest:.0f} degrees wide: beyond {WIDEST_DEG:.0f} backgrounds are drawn distorted",
        )


def _beads(scenario: Scenario) -> Iterator[Notice]:
    """Of a smear with too few steps: who moves most while a frame is exposed, by what it does from frame to frame."""
    camera = scenario.camera
    smear = camera.smear if scenario.is_on("smear") else None
    if smear is None or camera.smeared_ms == 0 or smear.steps == 1 or scenario.frames == 1:
        return
    watch = Watch(scenario)
    share = camera.smeared_ms * 1e-3 * camera.rate_hz / smear.steps
    moves = [(_turning(watch.mount), "the background")]
    for name, course in watch.courses.items():
        pixels = watch.mount.seen(course.positions)
        in_view = np.array([camera.geometry.inside(x, y) for x, y in pixels.tolist()])
        steps = np.hypot(*np.diff(pixels, axis=0).T)
        moves.append((np.where(in_view[1:] & in_view[:-1], steps, 0.0), name))
    most, name, frame = max((float(steps.max()) * share, name, int(steps.argmax()) + 1) for steps, name in moves)
    if most > BEADS_PX:
        enough = math.ceil(most * smear.steps / BEADS_PX)
        yield Notice(
            ("camera", "smear", "steps"),
            f"at frame {frame} {name} moves by {most:.1f} px from step to step, which leaves beads; "
            f"a streak takes steps: {enough}" + (", more than there may be" if enough > MOST_STEPS else ""),
        )


def _turning(mount: Mount) -> Floats:
    """(n - 1,) px by which what is far and in the middle of the picture moves from frame to frame."""
    rotations = np.stack([mount.rotation(index) for index in range(len(mount.turns))])
    ahead = np.einsum("nij,nj->ni", rotations[1:], rotations[:-1, 2])
    shifts = mount.geometry.project(ahead) - mount.geometry.principal
    return np.asarray(np.hypot(*shifts.T) * mount.zooms[1:])


def _odd_shapes(scenario: Scenario) -> Iterator[Notice]:
    for index, target in enumerate(scenario.targets):
        if target.shape.doubt is not None:
            key, why = target.shape.doubt
            yield Notice(("targets", index, "shape", key), why)


def _too_late(scenario: Scenario) -> Iterator[Notice]:
    for index, target in enumerate(scenario.targets):
        if target.path.begins > scenario.frames - 1:
            begins = f"its way begins at frame {target.path.begins:g}, after the last, {scenario.frames - 1}"
            yield Notice(("targets", index, "path"), f"{target.id} is there in no frame: {begins}")


def _never_seen(scenario: Scenario) -> Iterator[Notice]:
    """The target to follow, where its middle is outside the picture in all frames in which it is (of long scenarios:
    in LOOKED evenly spread ones)."""
    index, target = next(
        ((index, target) for index, target in enumerate(scenario.targets) if scenario.follow in (None, target.id)),
        (0, None),
    )
    if target is None or not scenario.is_on(target.id):
        return
    frames = np.unique(np.linspace(0, scenario.frames - 1, min(scenario.frames, LOOKED)).round())
    frames = frames[[target.exists(int(frame)) for frame in frames]]
    stage = scenario.stage
    places = []
    if len(frames):
        mount = Mount.of(scenario.camera.motion, frames, stage)
        places = mount.seen(target.path.positions(frames, stage, target.id)).tolist()
    if not any(scenario.camera.geometry.inside(x, y) for x, y in places):
        yield Notice(("targets", index, "path"), f"{target.id}, whom trackers follow, is never in the picture")


def _idle(scenario: Scenario) -> Iterator[Notice]:
    """Occluders with a place that hide no target in any frame."""
    if not scenario.targets:
        return
    watch = Watch(scenario)
    for index, occluder in enumerate(scenario.occluders):
        if occluder.hides is None and not any(watch.meets(occluder, target.id) for target in scenario.targets):
            yield Notice(("occluders", index), "it hides no target in any frame")
