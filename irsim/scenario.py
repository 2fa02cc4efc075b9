"""The scenario: a scene, its camera and its seed, as one frozen value."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.atmosphere import HIGHEST_M, Atmosphere
from irsim.backgrounds import BACKGROUNDS, Background
from irsim.camera import Camera
from irsim.cards import card
from irsim.climate import fitted_band
from irsim.expectation import EXPECTATIONS, Expectation
from irsim.identity import scene_code
from irsim.kinds import KeyPath, Name, Part, Several, Switch, suggestion, together
from irsim.motion import Company, Pointing
from irsim.occluders import OCCLUDERS, Occluder
from irsim.radiometry import BAND_UM, limits
from irsim.stage import Stage
from irsim.switches import less, switches
from irsim.target import Target
from irsim.turbulence import Turbulence
from irsim.types import Look
from irsim.variation import VARIATIONS, Variation
from irsim.wording import counted

Levels = Annotated[tuple[Any, ...], Field(strict=False, min_length=2, max_length=100)]
"""The values of a key by severity, from 0 on."""


ABOUT = {"about", "like", "severity", "severities", "vary", "expect"}
"""Keys that change no pixel and no truth: severities do by the values that they put elsewhere."""


class Scenario(Part):
    """What irsim renders."""

    about: str = ""
    """What this scenario is for."""
    like: Look | None = None
    """Class of real backgrounds that its own claims to be like; `irsim realism` holds it to that."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """Seed of everything random in the scene."""
    frames: Annotated[int, Field(ge=1, le=10_000_000)] = 100
    """How many frames."""
    camera: Camera = Camera()
    atmosphere: Atmosphere = Atmosphere()
    background: Annotated[Background, BACKGROUNDS]
    targets: Several[Target] = ()
    occluders: Several[Annotated[Occluder, OCCLUDERS]] = ()
    follow: Name | None = None
    """Id of the target to track; the first where not given."""
    without: Several[Switch] = ()
    """Names of what is switched off; everything else stays as it is, bit for bit."""
    severity: Annotated[int, Field(ge=0, le=99)] = 0
    """Which values of `severities` hold; 0 is the benign case."""
    severities: Mapping[str, Levels] = {}
    """Override keys, such as `camera.netd_mk`, each with a list of its values from severity 0 on."""
    vary: Mapping[str, Annotated[Variation, VARIATIONS]] = {}
    """Override keys, each with what its value may be instead, for `irsim sample` and for searches."""
    expect: Several[Annotated[Expectation, EXPECTATIONS]] = ()
    """Rules that a track is held to; `never_lost` where none are given."""

    @property
    def stage(self) -> Stage:
        camera = self.camera
        cast = Company({target.id: target.path for target in self.targets}, self.motions)
        air = self.air
        psf_px = math.hypot(camera.psf_px, air.turbulence.blur_rms(camera.band) / camera.geometry.ifov_rad)
        lens = camera.optics if self.is_on("optics") else None
        bare = Stage(
            self.seed,
            camera.geometry,
            camera.rate_hz,
            camera.band,
            math.hypot(psf_px, lens.sigma_px(camera.band)) if lens else psf_px,
            cast,
            air,
            lens.spread(camera.band, psf_px) if lens else None,
        )
        told = air.surroundings(camera.band) is not None
        return bare if told else replace(bare, ambient=self.background.ambient(bare))

    @property
    def air(self) -> Atmosphere:
        """The atmosphere, less what is switched off, with the camera as high as its background has it."""
        turbulence = self.atmosphere.turbulence if self.is_on("turbulence") else Turbulence()
        still = less(self.atmosphere if self.is_on("atmosphere") else Atmosphere(), self._off)
        altitude_m = self.background.altitude_m(still.altitude_m)
        return still.model_copy(update={"turbulence": turbulence, "altitude_m": altitude_m})

    @property
    def hash(self) -> str:
        """Hex digest of all that decides the pixels and the truth: values, code and meshes; not what is about it."""
        from irsim import __version__

        value = json.loads(self.model_dump_json(exclude=ABOUT))
        meshes = [target.shape.contents for target in self.targets if target.shape.contents]
        text = json.dumps([__version__, scene_code(self), value, *meshes], sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    @property
    def arrivals(self) -> Sequence[int]:
        """Those of its frames that arrive, in order: all, but for the camera's faults."""
        return self.camera.arrivals(self.frames, self.seed, self.is_on)

    @property
    def motions(self) -> tuple[Pointing, ...]:
        """The camera's motions, less what is switched off."""
        return tuple(motion for motion in self.camera.motion if self.is_on(motion.name))

    @property
    def whole(self) -> Scenario:
        """The same scene with nothing switched off."""
        return self.model_copy(update={"without": ()})

    @property
    def shown(self) -> Scenario:
        """The same scene with what is switched off within its parts at the value that does nothing."""
        return less(self, self._off)

    @property
    def _off(self) -> set[str]:
        """What of `without` is no part but set within one."""
        return set(self.without) - {name for name, _ in self._parts()}

    def is_on(self, name: str) -> bool:
        """Is the part of that name not switched off?"""
        return name not in self.without

    def names(self) -> Iterator[tuple[str, KeyPath]]:
        """Every name that `without` may hold, with its place in the tree. What is set within a part gives way to a
        part that has its name for an id."""
        yield from self._parts()
        yield from self.settings()

    def settings(self) -> Iterator[tuple[str, KeyPath]]:
        """Those of the names that are of what is set within a part."""
        parts = {name for name, _ in self._parts()}
        airless = self.atmosphere.preset == "none" and self.sky_preset is None
        for name, place in switches(self):
            if name not in parts and not (name == "haze" and airless):
                yield name, place

    def _parts(self) -> Iterator[tuple[str, KeyPath]]:
        """Those that are of whole parts."""
        for index, target in enumerate(self.targets):
            yield target.id, ("targets", index, "id")
        for index, occluder in enumerate(self.occluders):
            yield occluder.name, ("occluders", index, "id")
        for name, place in self.camera.names():
            yield name, ("camera", *place)
        for name, place in self.background.names():
            yield name, ("background", *place)
        if not self.atmosphere.is_clear:
            yield "atmosphere", ("atmosphere",)
        if self.atmosphere.turbulence.cn2 > 0:
            yield "turbulence", ("atmosphere", "turbulence")

    @property
    def sky_preset(self) -> str | None:
        """The preset of the clear sky, if any."""
        return self.background.sky_preset

    @model_validator(mode="after")
    def _air_is_fitted(self) -> Scenario:
        air, band = self.atmosphere, self.camera.band
        needed = air.preset != "none" or air.fog_visibility_km is not None or self.sky_preset is not None
        if needed and fitted_band(band) is None:
            low, high = limits(band)
            named = " or ".join(f"{name} ({first:g} to {last:g} um)" for name, (first, last) in BAND_UM.items())
            raise PydanticCustomError(
                "unfitted_band",
                "no atmosphere is fitted to a band of {band}; allowed with one: at least half of it within {named}",
                {"band": f"{low:g} to {high:g} um", "named": named, "at": ("camera", "band")},
            )
        altitude_m = self.background.altitude_m(air.altitude_m)
        if needed and altitude_m > HIGHEST_M:
            above = f"{altitude_m:g} m above the {self.background.surface}"
            why = f"the camera is {above}; allowed with an atmosphere: up to {HIGHEST_M:g} m"
            raise PydanticCustomError("above_the_air", "{why}", {"why": why, "at": ("background",)})
        return self

    @model_validator(mode="after")
    def _camera_fits(self) -> Scenario:
        why = self.background.refuses(self.camera.size, self.camera.bits)
        if why is not None:
            raise PydanticCustomError("background_refuses", "{why}", {"why": why, "at": ("background",)})
        return self

    @model_validator(mode="after")
    def _frames_arrive(self) -> Scenario:
        if not self.arrivals:
            raise PydanticCustomError(
                "none_arrive",
                "no frame of {frames} arrives; allowed: faults that leave one",
                {"frames": self.frames, "at": ("camera", "faults")},
            )
        return self

    @model_validator(mode="after")
    def _names_are_unique(self) -> Scenario:
        seen: dict[str, KeyPath] = {}
        for name, place in self._parts():
            if name in seen:
                raise PydanticCustomError(
                    "duplicate_id", "the id '{name}' is used twice", {"name": name, "at": place, "first": seen[name]}
                )
            seen[name] = place
        return self

    def references(self) -> Iterator[tuple[str, str, KeyPath]]:
        """(who, whom, place) of everything that refers to a target by its id; `who` is a target's id or ''."""
        for index, target in enumerate(self.targets):
            for key, name in target.path.refers().items():
                yield target.id, name, ("targets", index, "path", key)
        for index, motion in enumerate(self.camera.motion):
            for key, name in motion.refers().items():
                yield "", name, ("camera", "motion", index, key)
        for index, occluder in enumerate(self.occluders):
            if occluder.hides is not None:
                yield "", occluder.hides, ("occluders", index, "hides")
        for index, rule in enumerate(self.expect):
            if rule.target is not None:
                yield "", rule.target, ("expect", index, "target")

    def __repr__(self) -> str:
        columns, rows = self.camera.size
        targets = ", ".join(target.id for target in self.targets) or "none"
        size = f"{counted(self.frames, 'frame')} at {self.camera.rate_hz:g} Hz, {columns} x {rows} px"
        return f"Scenario({size}, background {self.background.kind}, targets {targets}, seed {self.seed})"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        columns, rows = self.camera.size
        facts = {
            "frames": f"{self.frames} at {self.camera.rate_hz:g} Hz, {columns} × {rows} px",
            "background": self.background.kind,
            "targets": ", ".join(f"{target.id} ({target.shape.kind}, {target.path.kind})" for target in self.targets),
            "occluders": ", ".join(occluder.name for occluder in self.occluders),
            "seed": self.seed,
        }
        return card(self.about or "A scenario", {name: fact for name, fact in facts.items() if fact != ""})

    @model_validator(mode="after")
    def _paths_are_possible(self) -> Scenario:
        frames, stage = np.arange(float(self.frames)), self.stage
        met = [(target.path.obstacle(frames, stage, target.id), index) for index, target in enumerate(self.targets)]
        together("obstacle", ((why, ("targets", index, "path")) for why, index in met if why is not None))
        return self

    @model_validator(mode="after")
    def _nobody_waits_for_himself(self) -> Scenario:
        waits = {who: (whom, place) for who, whom, place in self.references() if who}
        for first in waits:
            chain = [first]
            while chain[-1] in waits:
                whom, place = waits[chain[-1]]
                if whom == first:
                    raise PydanticCustomError(
                        "circle",
                        "{chain} refer to each other in a circle; allowed: one of them with a path of its own",
                        {"chain": ", ".join(chain), "at": place},
                    )
                if whom in chain:
                    break  # the circle is further on, and found from one of its own
                chain.append(whom)
        return self

    @model_validator(mode="after")
    def _severity_exists(self) -> Scenario:
        lengths = {key: len(values) for key, values in self.severities.items()}
        most = min(lengths.values(), default=1) - 1
        for key, length in lengths.items():
            if length - 1 > most:
                raise PydanticCustomError(
                    "severities",
                    "{length} values where another key has {fewer}; allowed: as many under each key",
                    {"length": length, "fewer": most + 1, "at": ("severities", key)},
                )
        if self.severity > most:
            raise PydanticCustomError(
                "severity",
                "{given} is out of range; allowed: {allowed}",
                {
                    "given": self.severity,
                    "allowed": f"0 to {most}" if most else "0, for there are no severities",
                    "at": ("severity",),
                },
            )
        return self

    @model_validator(mode="after")
    def _names_exist(self) -> Scenario:
        names = [name for name, _ in self.names()]
        targets = [target.id for target in self.targets]
        wanted: list[tuple[str, KeyPath, list[str]]]
        wanted = [(name, ("without", index), names) for index, name in enumerate(self.without)]
        if self.follow is not None:
            wanted.append((self.follow, ("follow",), targets))
        wanted += [(whom, place, targets) for _, whom, place in self.references()]
        together("unknown_id", ((_no(name, allowed), at) for name, at, allowed in wanted if name not in allowed))
        return self


def _no(name: str, allowed: list[str]) -> str:
    known = ", ".join(allowed) or "nothing, there are none"
    within = next((f"; did you mean '{each}'?" for each in allowed if each.endswith(f".{name}")), None)
    return f"there is no '{name}'; allowed: {known}{within or suggestion(name, allowed)}"
