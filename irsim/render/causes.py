"""Causes that may lose a track: parts of a scenario, and the scenario without some of them.

Removal of a cause leaves the random streams of all others unchanged, as they are addressed by name.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from irsim.config.base import no_such
from irsim.errors import InputError
from irsim.motion import CameraTrajectory, Path
from irsim.motion.mean_path import straightened
from irsim.scenario.model import Scenario
from irsim.scenario.placement import placed_occluders
from irsim.types import Bools, Floats

Stage = Literal["path", "camera", "scene", "layer", "sprite", "sensor", "arrival", "display"]
"""Step of the rendering at which a cause acts: target path, camera pose, whole scene, background layer, sprite of a
target or occluder, detector, frame loss, display."""

MANOEUVRE, OTHERS, CLUTTER, AGC_MEMORY = "manoeuvre", "other_targets", "clutter", "agc_memory"

LEAST_TURN_PX = 0.5
"""Distance between path and mean path, px, above which a target manoeuvres."""

INSTRUMENT = {"optics", "falloff", "atmosphere"}
"""Parts of a camera and its surroundings that are causes only where they are named."""

ANCHORED: dict[Stage, str] = {
    "path": "first position and velocity, background, noise",
    "camera": "path in space, background, noise",
    "scene": "path, noise",
    "layer": "path, noise, other layers",
    "sprite": "path, background, noise, other objects",
    "sensor": "scene, path, numbers of the other noise terms",
    "arrival": "each frame that arrives",
    "display": "counts",
}
"""Properties that a twin keeps, by the stage of its cause."""

CHANGED: dict[Stage, str] = {
    "path": "attitude, and what the target passes on its way",
    "camera": "path in the picture",
    "arrival": "numbers of frames, and by them the tracker's draws",
}
"""Properties that a twin changes beside its cause."""


@dataclass(frozen=True)
class Cause:
    """Cause of a loss: its name, the stage at which it acts, and the names of `without` that remove it.

    anchored, changes   properties that its removal keeps, and properties that it changes too
    """

    name: str
    stage: Stage
    parts: tuple[str, ...] = ()
    anchored: str = ""
    changes: str = ""


def anchored(scenario: Scenario) -> Scenario:
    """Return the scenario with each occluder at its place, so that no removal moves it."""
    fixed = tuple(each.model_copy(update={"hides": None}) for each in placed_occluders(scenario))
    return scenario.model_copy(update={"occluders": fixed})


def causes_of(
    scenario: Scenario, target: str, first: int = 0, names: Collection[str] | None = None
) -> tuple[Cause, ...]:
    """Return the causes that may lose the track of a target that starts in the scenario's frame `first`.

    names   names of the causes; None: all but optics, vignetting and atmosphere. A name of `Scenario.names` that is no
            cause by default is one too.

    InputError for a name that the scenario has not.
    """
    found = {each.name: each for each in _all(scenario, target, first)}
    if names is None:
        return tuple(each for each in found.values() if each.name not in INSTRUMENT)
    settings = [name for name, _ in scenario.settings() if scenario.is_on(name)]
    chosen = []
    for name in dict.fromkeys(names):
        if name not in found and name not in settings:
            raise InputError(f"cause: {no_such(name, [*found, *settings], 'none')}")
        chosen.append(found.get(name) or _cause(name, "scene", name))
    return tuple(chosen)


def _cause(name: str, stage: Stage, *parts: str) -> Cause:
    return Cause(name, stage, parts, ANCHORED[stage], CHANGED.get(stage, ""))


def _all(scenario: Scenario, target: str, first: int) -> list[Cause]:
    camera = scenario.camera
    stages: dict[str, Stage] = {occluder.name: "sprite" for occluder in scenario.occluders}
    stages |= {name: "layer" for name, _ in scenario.background.names()}
    stages |= {motion.name: "camera" for motion in camera.motion}
    stages |= {noise.name: "sensor" for noise in camera.noise}
    stages |= {fault.name: "arrival" for fault in camera.faults}
    targets, settings = [each.id for each in scenario.targets], {name for name, _ in scenario.settings()}
    parts = [name for name, _ in scenario.names() if name not in settings and name not in targets]
    found = [_cause(name, stages.get(name, "scene"), name) for name in parts if scenario.is_on(name)]
    others = tuple(name for name in targets if name != target and scenario.is_on(name))
    if others:
        found.append(_cause(OTHERS, "sprite", *others))
    if getattr(scenario.background, CLUTTER, None) is not None:
        found.append(_cause(CLUTTER, "scene"))
    if mean_path(scenario, target, first) is not None:
        found.append(_cause(MANOEUVRE, "path"))
    if getattr(camera.agc, "time_constant_frames", 0) > 0 and scenario.is_on("agc"):
        found.append(_cause(AGC_MEMORY, "display"))
    return found


def without_causes(scenario: Scenario, target: str, removed: Sequence[Cause], first: int = 0) -> Scenario:
    """Return the twin: the scenario, its occluders placed, without causes."""
    changes: dict[str, Any] = {}
    names = {each.name for each in removed}
    parts = [part for each in removed for part in each.parts]
    if parts:
        changes["without"] = tuple(dict.fromkeys((*scenario.without, *parts)))
    if CLUTTER in names:
        changes["background"] = scenario.background.model_copy(update={"clutter": None})
    if AGC_MEMORY in names:
        agc = scenario.camera.agc.model_copy(update={"time_constant_frames": 0.0})
        changes["camera"] = scenario.camera.model_copy(update={"agc": agc})
    if MANOEUVRE in names:
        path = mean_path(scenario, target, first)
        changes["targets"] = tuple(
            each.model_copy(update={"path": path}) if each.id == target and path is not None else each
            for each in scenario.targets
        )
    return scenario.model_copy(update=changes) if changes else scenario


def mean_path(scenario: Scenario, target: str, first: int) -> Path | None:
    """Return the mean path of a target from frame `first` on; None where it does not manoeuvre.

    It keeps the first velocity. Where this would take the target out of a view in which its path stays, it keeps the
    last position in view instead, and so the mean velocity of the path.
    """
    own = next(each for each in scenario.targets if each.id == target).path
    context, frames = scenario.shown.context, np.arange(first, scenario.frames * 1.0)
    if len(frames) < 3:
        return None
    camera = CameraTrajectory.of(scenario.motions, frames, context)
    pixels = camera.project(own.positions(frames, context, target))
    seen = in_picture(pixels, context.geometry.size)
    last = first + int(np.flatnonzero(seen)[-1]) if seen.any() else first
    for ends in (False, True):
        path = straightened(own, first, last, context, target, ends)
        mean = camera.project(path.positions(frames, context, target))
        if in_picture(mean, context.geometry.size)[seen].all():
            break
    turns = np.linalg.norm((mean - pixels)[seen], axis=1)
    return path if (turns > LEAST_TURN_PX).any() else None


def in_picture(pixels: Floats, size: tuple[int, int]) -> Bools:
    """Return whether each point (n, 2) px lies within the picture, (n,) bool."""
    return np.asarray(((pixels > -0.5) & (pixels < np.array(size) - 0.5)).all(axis=1))
