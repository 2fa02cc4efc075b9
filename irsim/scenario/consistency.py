"""What the parts of a scenario must be to each other: each check raises what is wrong with its place, or is silent."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from pydantic_core import PydanticCustomError

from irsim.backgrounds import Background
from irsim.camera.camera import Camera
from irsim.config.base import KeyPath
from irsim.config.names import no_such
from irsim.geometry.context import SceneContext
from irsim.physics.atmosphere import HIGHEST_M, Atmosphere
from irsim.physics.climate import fitted_band
from irsim.physics.radiometry import BAND_UM, limits
from irsim.targets.target import Target

Reference = tuple[str, str, KeyPath]
"""(who, whom, place): `who` is a target's id or ''."""

Wanted = tuple[str, KeyPath, Sequence[str]]
"""(name, where it is written, those of which it must be one)."""

Fault = dict[str, Any]
"""An error as pydantic has it."""


def air_is_fitted(air: Atmosphere, background: Background, camera: Camera) -> None:
    """The camera's band and height are ones for which the air is known, where there is any."""
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


def camera_fits(background: Background, camera: Camera) -> None:
    """The background can be seen by this camera."""
    why = background.camera_fault(camera.size, camera.bits)
    if why is not None:
        raise PydanticCustomError("background_refuses", "{why}", {"why": why, "at": ("background",)})


def frames_arrive(arrivals: Sequence[int], frames: int) -> None:
    """The camera's faults leave a frame."""
    if not arrivals:
        raise PydanticCustomError(
            "none_arrive",
            "no frame of {frames} arrives; allowed: faults that leave one",
            {"frames": frames, "at": ("camera", "faults")},
        )


def ids_are_sound(parts: Iterable[tuple[str, KeyPath]], wanted: Iterable[Wanted]) -> None:
    """No two parts have one id, and every name that is used is there; all that is wrong is told at once."""
    _tell_all([*_used_twice(parts), *_unknown(wanted)])


def _used_twice(parts: Iterable[tuple[str, KeyPath]]) -> Iterator[Fault]:
    seen: dict[str, KeyPath] = {}
    for name, place in parts:
        if name in seen:
            yield _fault("duplicate_id", f"the id '{name}' is used twice", place, name=name, first=seen[name])
        seen.setdefault(name, place)


def _unknown(wanted: Iterable[Wanted]) -> Iterator[Fault]:
    for name, place, allowed in wanted:
        if name not in allowed:
            yield _fault("unknown_id", no_such(name, allowed, "nothing, there are none"), place)


def paths_are_possible(targets: Sequence[Target], frames: int, context: SceneContext) -> None:
    """Every target has somewhere to go."""
    at = np.arange(float(frames))
    met = ((target.path.obstacle(at, context, target.id), index) for index, target in enumerate(targets))
    _tell_all([_fault("obstacle", why, ("targets", index, "path")) for why, index in met if why is not None])


def nobody_waits_for_himself(references: Iterable[Reference]) -> None:
    """Paths that refer to other targets lead to one of its own."""
    waits = {who: (whom, place) for who, whom, place in references if who}
    for first in waits:
        chain = [first]
        while chain[-1] in waits:
            whom, place = waits[chain[-1]]
            if whom == first:
                several = "refer to each other in a circle; allowed: one of them with a path of its own"
                what = several if len(chain) > 1 else "refers to itself; allowed: another target"
                raise PydanticCustomError("circle", "{what}", {"what": f"{', '.join(chain)} {what}", "at": place})
            if whom in chain:
                break  # the circle is further on, and found from one of its own
            chain.append(whom)


def severity_exists(severity: int, severities: Mapping[str, Sequence[object]]) -> None:
    """Each key has as many values as the others, and the severity is one of them."""
    lengths = {key: len(values) for key, values in severities.items()}
    most = min(lengths.values(), default=1) - 1
    for key, length in lengths.items():
        if length - 1 > most:
            raise PydanticCustomError(
                "severities",
                "{length} values where another key has {fewer}; allowed: as many under each key",
                {"length": length, "fewer": most + 1, "at": ("severities", key)},
            )
    if severity > most:
        allowed = f"0 to {most}" if most else "0, for there are no severities"
        raise PydanticCustomError(
            "severity",
            "{given} is out of range; allowed: {allowed}",
            {"given": severity, "allowed": allowed, "at": ("severity",)},
        )


def _fault(kind: str, what: str, place: KeyPath, **more: Any) -> Fault:
    return {"type": kind, "loc": (), "msg": what, "ctx": {"at": place, **more}}


def _tell_all(faults: Sequence[Fault]) -> None:
    """Raise one error that tells all of them; nothing where there are none."""
    if faults:
        what = "; ".join(str(each["msg"]) for each in faults)
        raise PydanticCustomError("inside", "{what}", {"what": what, "errors": faults})
