"""Consistency of a scenario's parts: each check raises one error with all its faults and their places."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from pydantic_core import PydanticCustomError

from irsim.backgrounds import Background
from irsim.camera.camera import Camera
from irsim.config.base import KeyPath, no_such
from irsim.geometry.context import SceneContext
from irsim.physics.atmosphere import HIGHEST_M, Atmosphere
from irsim.physics.climate import fitted_band
from irsim.physics.radiometry import BAND_UM, limits
from irsim.targets.target import Target

Reference = tuple[str, str, KeyPath]
"""(referring target or '', target referred to, place)."""

UsedName = tuple[str, KeyPath, Sequence[str]]
"""(name, place where it is written, allowed names)."""

Fault = dict[str, Any]
"""Error in pydantic's form."""


def check_atmosphere(air: Atmosphere, background: Background, camera: Camera) -> None:
    """Check that the atmosphere, if any, is fitted to the camera's band and height."""
    if air.preset == "none" and air.fog_visibility_km is None and background.sky_preset is None:
        return
    if fitted_band(camera.band) is None:
        low, high = limits(camera.band)
        named = " or ".join(f"{name} ({first:g} to {last:g} um)" for name, (first, last) in BAND_UM.items())
        raise PydanticCustomError(
            "unfitted_band",
            "no atmosphere is fitted to a band of {band}; allowed with one: at least half of it within {named}",
            {"band": f"{low:g} to {high:g} um", "named": named, "at": ("camera", "band")},
        )
    altitude_m = background.altitude_m(air.altitude_m)
    if altitude_m > HIGHEST_M:
        above = f"{altitude_m:g} m above the {background.surface}"
        why = f"the camera is {above}; allowed with an atmosphere: up to {HIGHEST_M:g} m"
        raise PydanticCustomError("above_the_air", "{why}", {"why": why, "at": ("background",)})


def check_background(background: Background, camera: Camera) -> None:
    """Check that the background fits this camera."""
    why = background.camera_fault(camera.size, camera.bits)
    if why is not None:
        raise PydanticCustomError("background_refuses", "{why}", {"why": why, "at": ("background",)})


def check_frames(arrivals: Sequence[int], frames: int) -> None:
    """Check that frame loss leaves a frame."""
    if not arrivals:
        raise PydanticCustomError(
            "none_arrive",
            "no frame of {frames} arrives; allowed: faults that leave one",
            {"frames": frames, "at": ("camera", "faults")},
        )


def check_ids(parts: Iterable[tuple[str, KeyPath]], used: Iterable[UsedName]) -> None:
    """Check that no two parts share an id and that every name in use exists."""
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
    """Check that every target's trajectory exists."""
    at = np.arange(float(frames))
    found = ((target.path.obstacle(at, context, target.id), index) for index, target in enumerate(targets))
    _raise_all([_fault("obstacle", why, ("targets", index, "path")) for why, index in found if why is not None])


def check_references(references: Iterable[Reference]) -> None:
    """Check that references between the paths of targets form no circle."""
    refers = {source: (target, place) for source, target, place in references if source}
    for first in refers:
        chain = [first]
        while chain[-1] in refers:
            target, place = refers[chain[-1]]
            if target == first:
                several = "refer to each other in a circle; allowed: one of them with a path of its own"
                problem = several if len(chain) > 1 else "refers to itself; allowed: another target"
                message = f"{', '.join(chain)} {problem}"
                raise PydanticCustomError("circle", "{message}", {"message": message, "at": place})
            if target in chain:
                break  # a circle further on, found from one of its own targets
            chain.append(target)


def check_severities(severity: int, severities: Mapping[str, Sequence[object]]) -> None:
    """Check that all keys have the same number of values and that the severity is one of their indices."""
    lengths = {key: len(values) for key, values in severities.items()}
    most = min(lengths.values(), default=1) - 1
    for key, length in lengths.items():
        if length - 1 > most:
            raise PydanticCustomError(
                "severities",
                "{length} values where another key has {fewer}; allowed: the same number for each key",
                {"length": length, "fewer": most + 1, "at": ("severities", key)},
            )
    if severity > most:
        allowed = f"0 to {most}" if most else "0, as there are no severities"
        raise PydanticCustomError(
            "severity",
            "{given} is out of range; allowed: {allowed}",
            {"given": severity, "allowed": allowed, "at": ("severity",)},
        )


def _fault(kind: str, message: str, place: KeyPath, **more: Any) -> Fault:
    return {"type": kind, "loc": (), "msg": message, "ctx": {"at": place, **more}}


def _raise_all(faults: Sequence[Fault]) -> None:
    """Raise one error with all faults, if any."""
    if faults:
        message = "; ".join(str(each["msg"]) for each in faults)
        raise PydanticCustomError("inside", "{message}", {"message": message, "errors": faults})
