"""Scenario: a scene, its camera and its seed as one frozen value."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from irsim.backgrounds import BACKGROUNDS, Background
from irsim.camera.camera import Camera
from irsim.config.base import KeyPath, Name, Part, Several, Switch
from irsim.config.switches import switched_off, switches
from irsim.errors import InputError, counted
from irsim.geometry.context import SceneContext
from irsim.motion import CameraMotion, SceneMotion
from irsim.notebook import card
from irsim.occluders import OCCLUDERS, Occluder
from irsim.physics.atmosphere import Atmosphere
from irsim.physics.turbulence import Turbulence
from irsim.scenario.consistency import (
    Reference,
    UsedName,
    check_atmosphere,
    check_background,
    check_frames,
    check_ids,
    check_references,
    check_severities,
    check_trajectories,
)
from irsim.scenario.expectation import EXPECTATIONS, Expectation
from irsim.scenario.fingerprint import scene_code, without_names
from irsim.scenario.variation import VARIATIONS, Variation
from irsim.targets.target import Target
from irsim.types import BackgroundClass

Levels = Annotated[tuple[Any, ...], Field(strict=False, min_length=2, max_length=100)]
"""Values of a key at severities 0, 1, 2 and so on."""

METADATA = {"about", "like", "severity", "severities", "vary", "expect"}
"""Keys without effect on pixels and ground truth. Severities act only through the values of other keys."""


def _split(given: object) -> object:
    """Return the list of names in a text with commas between them."""
    return [name.strip() for name in given.split(",")] if isinstance(given, str) else given


def expect_names(without: Iterable[str]) -> tuple[str, ...]:
    """Return the names in `without`. Raises InputError for a single text, whose letters would be taken as names."""
    if isinstance(without, str) or not isinstance(without, Iterable):
        raise InputError(f"without {without!r}: allowed: a list of names, such as [{str(without)!r}]")
    return tuple(without)


def expect_scenario(action: str, given: object, hint: str = "") -> Scenario:
    """Return the scenario `given` as the argument of `action`. Raises InputError if it is not a scenario."""
    if isinstance(given, Scenario):
        return given
    how = f"irsim.load({given!r})" if isinstance(given, str) else "irsim.load"
    raise InputError(f"{action} of a {type(given).__name__}; allowed: a Scenario ({how}){hint}")


class Scenario(Part):
    """Scene, camera and seed to render."""

    about: str = ""
    """Purpose of this scenario."""
    like: BackgroundClass | None = None
    """Class of real backgrounds with which `irsim realism` compares the background. Default: none."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """Seed of all random numbers of the scene."""
    frames: Annotated[int, Field(ge=1, le=10_000_000)] = 100
    """Number of frames."""
    camera: Camera = Camera()
    atmosphere: Atmosphere = Atmosphere()
    background: Annotated[Background, BACKGROUNDS]
    targets: Several[Target] = ()
    occluders: Several[Annotated[Occluder, OCCLUDERS]] = ()
    follow: Name | None = None
    """Id of the target to track; default: the first."""
    without: Annotated[Several[Switch], BeforeValidator(_split, json_schema_input_type=Several[Switch] | str)] = ()
    """Names of parts and settings to switch off, a list or a text with commas. The rest of the scene is unchanged, bit
    for bit."""
    severity: Annotated[int, Field(ge=0, le=99)] = 0
    """Index of the current values in `severities`; 0 is the benign case."""
    severities: Mapping[str, Levels] = {}
    """Override keys, such as `camera.netd_mk`, each with its list of values from severity 0 on."""
    vary: Mapping[str, Annotated[Variation, VARIATIONS]] = {}
    """Override keys, each with a range of values for `irsim sample` and for searches."""
    expect: Several[Annotated[Expectation, EXPECTATIONS]] = ()
    """Rules for a track; default: `never_lost`."""

    @property
    def context(self) -> SceneContext:
        """Properties of the scene that all its parts share."""
        camera = self.camera
        cast = SceneMotion({target.id: target.path for target in self.targets}, self.motions)
        air = self.air
        psf_px = math.hypot(camera.psf_px, air.turbulence.blur_rms(camera.band) / camera.geometry.ifov_rad)
        lens = camera.optics if self.is_on("optics") else None
        bare = SceneContext(
            self.seed,
            camera.geometry,
            camera.rate_hz,
            camera.band,
            math.hypot(psf_px, lens.sigma_px(camera.band)) if lens else psf_px,
            cast,
            air,
            lens.psf(camera.band, psf_px) if lens else None,
            leaves_k=self.background.leaves_k,
        )
        given = air.surroundings(camera.band) is not None
        return bare if given else replace(bare, ambient=self.background.ambient(bare))

    @property
    def air(self) -> Atmosphere:
        """Atmosphere without settings that are switched off, at the camera height that the background sets."""
        turbulence = self.atmosphere.turbulence if self.is_on("turbulence") else Turbulence()
        still = switched_off(self.atmosphere if self.is_on("atmosphere") else Atmosphere(), self._off)
        altitude_m = self.background.altitude_m(still.altitude_m)
        return still.model_copy(update={"turbulence": turbulence, "altitude_m": altitude_m})

    @property
    def hash(self) -> str:
        """Hex digest of all that determines pixels and ground truth: values, code and contents of files, without
        `METADATA` and names of files."""
        from irsim import __version__

        value = without_names(self, json.loads(self.model_dump_json(exclude=METADATA)))
        text = json.dumps([__version__, scene_code(self), value], sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    @property
    def files(self) -> tuple[Path, ...]:
        """Files that the scenario reads besides its text, such as a recorded background and meshes."""
        return (*self.background.files, *(file for target in self.targets for file in target.shape.files))

    @property
    def arrivals(self) -> Sequence[int]:
        """Numbers of the frames that arrive, in order: all except those that the camera loses."""
        return self.camera.arriving_frames(self.frames, self.seed, self.is_on)

    @property
    def motions(self) -> tuple[CameraMotion, ...]:
        """Motions of the camera that are switched on."""
        return tuple(motion for motion in self.shown.camera.motion if self.is_on(motion.name))

    @property
    def whole(self) -> Scenario:
        """Same scenario with nothing switched off."""
        return self.model_copy(update={"without": ()})

    @property
    def shown(self) -> Scenario:
        """Same scenario, with each setting that is switched off at the value that has no effect."""
        return switched_off(self, self._off) if self.without else self

    @property
    def _off(self) -> set[str]:
        """Names in `without` that denote settings within parts, not whole parts."""
        return set(self.without) - {name for name, _ in self._parts()}

    def is_on(self, name: str) -> bool:
        """Return True if the part or setting of that name is switched on."""
        return name not in self.without

    def names(self) -> Iterator[tuple[str, KeyPath]]:
        """Yield every name that `without` may contain, with its key path. Where a part and a setting have the same
        name, the part is meant."""
        yield from self._parts()
        yield from self.settings()

    def settings(self) -> Iterator[tuple[str, KeyPath]]:
        """Yield the names of settings within parts, with their key paths."""
        parts = {name for name, _ in self._parts()}
        idle = set()
        if self.atmosphere.preset == "none" and self.sky_preset is None:
            idle.add("haze")
        if not (self.targets or self.occluders):
            idle.add("surroundings")
        for name, place in switches(self):
            if name not in parts and name not in idle:
                yield name, place

    def _parts(self) -> Iterator[tuple[str, KeyPath]]:
        """Yield the names of whole parts, with their key paths."""
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
        """Preset of the clear sky, or None."""
        return self.background.sky_preset

    @model_validator(mode="after")
    def _agrees(self) -> Scenario:
        check_atmosphere(self.atmosphere, self.background, self.camera)
        check_background(self.background, self.camera)
        check_frames(self.arrivals, self.frames)
        check_ids(self._parts(), self._used_names())
        check_trajectories(self.targets, self.frames, self.context)
        check_references(self.references())
        check_severities(self.severity, self.severities)
        return self

    def _used_names(self) -> Iterator[UsedName]:
        """Yield every use of a part's name, with its key path and the names allowed there."""
        names = [name for name, _ in self.names()]
        targets = [target.id for target in self.targets]
        for index, name in enumerate(self.without):
            yield name, ("without", index), names
        if self.follow is not None:
            yield self.follow, ("follow",), targets
        for _, target, place in self.references():
            yield target, place, targets

    def references(self) -> Iterator[Reference]:
        """Yield each reference to a target by its id, with its key path."""
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
