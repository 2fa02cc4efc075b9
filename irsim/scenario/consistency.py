"""Consistency of a scenario's parts: each check raises one error with all its faults and their key paths."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from pydantic_core import PydanticCustomError

from irsim.backgrounds import Background
from irsim.camera.camera import Camera
from irsim.config.base import KeyPath, invalid, no_such
from irsim.geometry.context import SceneContext
from irsim.physics.atmosphere import HIGHEST_M, Atmosphere
from irsim.physics.climate import fitted_band
from irsim.physics.radiometry import BAND_UM, limits
from irsim.targets.target import Target

Reference = tuple[str, str, KeyPath]
"""(id of the referring target, or '' where another part refers; id referred to; key path of the reference)."""

UsedName = tuple[str, KeyPath, Sequence[str]]
"""(name, key path where it is used, allowed names)."""

Fault = dict[str, Any]
"""Error in the form of pydantic's error dictionaries."""


def check_atmosphere(air: Atmosphere, background: Background, camera: Camera) -> None:
    """Check that a model of the atmosphere, if one is used, is fitted to the camera's band and height."""
    if air.preset == "none" and air.fog_visibility_km is None and background.sky_preset is None:
        return
    if fitted_band(camera.band) is None:
        low, high = limits(camera.band)
        named = " or ".join(f"{name} ({first:g} to {last:g} um)" for name, (first, last) in BAND_UM.items())
        raise invalid(
            f"no atmosphere is fitted to a band of {low:g} to {high:g} um; allowed with one: at least half of it "
            f"within {named}",
            at=("camera", "band"),
        )
    altitude_m = background.altitude_m(air.altitude_m)
    if altitude_m > HIGHEST_M:
        raise invalid(
            f"the camera is {altitude_m:g} m above the {background.surface}; allowed with an atmosphere: up to "
            f"{HIGHEST_M:g} m",
            at=("background",),
        )


def check_background(background: Background, camera: Camera) -> None:
    """Check that the background fits the camera's picture size and bit depth."""
    reason = background.camera_fault(camera.size, camera.bits)
    if reason is not None:
        raise invalid(reason, at=("background",))


def check_frames(arrivals: Sequence[int], frames: int) -> None:
    """Check that at least one frame arrives despite frame loss."""
    if not arrivals:
        raise invalid(f"no frame of {frames} arrives; allowed: faults that leave one", at=("camera", "faults"))


def check_ids(parts: Iterable[tuple[str, KeyPath]], used: Iterable[UsedName]) -> None:
    """Check that no two parts share an id and that every name used in the scenario exists."""
    _raise_all([*_used_twice(parts), *_unknown(used)])


def _used_twice(parts: Iterable[tuple[str, KeyPath]]) -> Iterator[Fault]:
    seen: dict[str, KeyPath] = {}
    for name, place in parts:
        if name in seen:
            yield _fault("duplicate_id", f"the id '{name}' is used twice", place, name=name, first=seen[name])
        seen.setdefault(name, place)


def _unknown(used: Iterable[UsedName]) -> Iterator[Fault]:
    for name, place, allowed in used:
        if name not in allowed:
            yield _fault("unknown_id", no_such(name, allowed, "nothing, there are none"), place)


def check_trajectories(targets: Sequence[Target], frames: int, context: SceneContext) -> None:
    """Check that every target's trajectory can be computed."""
    at = np.arange(float(frames))
    reasons = (target.path.obstacle(at, context, target.id) for target in targets)
    _raise_all([_fault("obstacle", why, ("targets", index, "path")) for index, why in enumerate(reasons) if why])


def check_references(references: Iterable[Reference]) -> None:
    """Check that references between the paths of targets form no circle."""
    refers = {source: (target, place) for source, target, place in references if source}
    checked = set[str]()
    for first in refers:
        chain: dict[str, KeyPath] = {}
        at = first
        while at in refers and at not in checked and at not in chain:
            chain[at] = refers[at][1]
            at = refers[at][0]
        if at in chain:
            circle = list(chain)[list(chain).index(at) :]
            several = "refer to each other in a circle; allowed: one of them with a path of its own"
            problem = several if len(circle) > 1 else "refers to itself; allowed: another target"
            raise invalid(f"{', '.join(circle)} {problem}", at=chain[circle[-1]])
        checked.update(chain)


def check_severities(severity: int, severities: Mapping[str, Sequence[object]]) -> None:
    """Check that all keys have the same number of values and that the severity is one of their indices."""
    lengths = {key: len(values) for key, values in severities.items()}
    most = min(lengths.values(), default=1) - 1
    for key, length in lengths.items():
        if length - 1 > most:
            raise invalid(
                f"{length} values where another key has {most + 1}; allowed: the same number for each key",
                at=("severities", key),
            )
    if severity > most:
        allowed = f"0 to {most}" if most else "0, as there are no severities"
        raise invalid(f"{severity} is out of range; allowed: {allowed}", at=("severity",))


def _fault(kind: str, message: str, place: KeyPath, **more: Any) -> Fault:
    return {"type": kind, "loc": (), "msg": message, "ctx": {"at": place, **more}}


def _raise_all(faults: Sequence[Fault]) -> None:
    """Raise one error with all faults, if any."""
    if faults:
        message = "; ".join(str(each["msg"]) for each in faults)
        raise PydanticCustomError("inside", "{message}", {"message": message, "errors": faults})
