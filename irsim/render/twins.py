"""Twins of a scenario: the same scene with causes of a loss removed, frame by frame, with the same random streams.

Several twins are rendered side by side. At each step of the rendering (light, counts, picture) a twin takes the result
of another one where no removed cause acts, so that a frame that no cause touches is rendered once.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from irsim.backgrounds.texture import BLOCK
from irsim.camera.agc import AgcSequence
from irsim.config.base import no_such
from irsim.errors import InputError
from irsim.render.causes import Cause, anchored, causes_of, in_picture, without_causes
from irsim.render.exposure import Instant
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario, expect_scenario
from irsim.types import Bools, Counts, Floats, Frame, Image, Input, Truth, read_only

Removed = frozenset[str]
"""Names of the causes that a twin lacks."""

LATER = {"sensor", "display", "arrival"}
"""Stages after the light of the scene."""

MOST_OUT = 0.1
"""Largest share of the frames in view that the removal of a cause may take out of view."""


@dataclass(frozen=True, eq=False)
class TwinFrame:
    """Frame of one twin.

    twin, noise   numbers of the twin and of the noise seed in the call
    history       equal for frames that end equal sequences, bit for bit
    """

    twin: int
    noise: int
    frame: Frame
    truth: Truth
    history: int


class Twins:
    """Twins of a scenario for the track of one target that starts in the scenario's frame `first`.

    causes    causes to remove, see `irsim.render.causes.causes_of`
    dropped   causes that are none, by name, with the reason: without them the target is out of view

    InputError for a target or a cause that the scenario has not, and for a target out of view from the first frame on.
    """

    def __init__(self, scenario: Scenario, target: str, first: int = 0, causes: Collection[str] | None = None) -> None:
        names = [each.id for each in expect_scenario("twins", scenario).targets if scenario.is_on(each.id)]
        if target not in names:
            raise InputError(f"target: {no_such(target, names, 'none')}")
        self.scenario, self.target, self.first = anchored(scenario), target, first
        own = self._in_view(self.scenario)
        if not own.any():
            raise InputError(f"target {target}: is out of view in all frames from {first} on; allowed: one in view")
        self.dropped: dict[str, str] = {}
        kept = []
        for cause in causes_of(self.scenario, target, first, causes):
            out = 0
            if cause.stage in ("path", "camera", "scene"):
                out = int((own & ~self._in_view(without_causes(self.scenario, target, [cause], first))).sum())
            if out > MOST_OUT * own.sum():
                self.dropped[cause.name] = f"without it the target is out of view in {out} of {own.sum()} frames"
            else:
                kept.append(cause)
        self.causes = {cause.name: cause for cause in kept}
        self._wholes: dict[Removed, Renderer] = {}
        self._renderers: dict[Removed, Renderer] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Twins, (self.scenario, self.target, self.first, [*self.causes, *self.dropped])

    def scenario_of(self, removed: Collection[str]) -> Scenario:
        """Return the twin without causes as a scenario; with none removed the scenario, its occluders placed."""
        return without_causes(self.scenario, self.target, [self.causes[name] for name in sorted(removed)], self.first)

    def frames(
        self,
        removals: Sequence[Removed],
        input: Input = "display",
        noise_seeds: Sequence[int | None] = (None,),
        stop: int | None = None,
    ) -> TwinFrames:
        """Return the frames of the twins, from the start frame to before `stop`; see `TwinFrames`."""
        return TwinFrames(self, removals, input, noise_seeds, stop)

    def renderer(self, removed: Removed) -> Renderer:
        """Return a renderer of a twin, which shares painted layers with the others."""
        if removed not in self._renderers:
            scenario = self.scenario_of(removed)
            whole = self._whole(frozenset(name for name in removed if not self.causes[name].parts))
            self._renderers[removed] = Renderer(scenario, whole) if scenario.without else whole
        return self._renderers[removed]

    def _whole(self, changed: Removed) -> Renderer:
        """Return the renderer with nothing switched off, and causes removed that are no parts."""
        if changed not in self._wholes:
            base = self._whole(frozenset()) if changed else None
            self._wholes[changed] = Renderer(self.scenario_of(changed).whole, base)
        return self._wholes[changed]

    def _in_view(self, scenario: Scenario) -> Bools:
        """Return whether the target's centre is in view in each frame from the first on, (n,) bool."""
        shown = scenario.shown
        now = Instant.of(shown, shown.context)
        number = [each.id for each in shown.targets if shown.is_on(each.id)].index(self.target)
        trajectory = now.trajectories[number]
        pixels = now.camera.project(trajectory.positions)[self.first : scenario.frames]
        exists = [trajectory.target.exists(k) for k in range(self.first, scenario.frames)]
        return np.asarray(in_picture(pixels, scenario.camera.size) & np.array(exists, dtype=bool))


class TwinFrames:
    """Frames of twins side by side: an iteration yields a list for each frame of the scenario.

    noise_seeds   seeds of the camera's noise, each with all twins; None is the scene's own
    rendered      number of lights composed so far;  asked  number that separate renderings would have composed
    """

    def __init__(
        self,
        twins: Twins,
        removals: Sequence[Removed],
        input: Input,
        noise_seeds: Sequence[int | None],
        stop: int | None,
    ) -> None:
        self.rendered = self.asked = 0
        self._twins = [_Twin(twins, removed, noise_seeds) for removed in removals]
        self._noises, self._input = len(noise_seeds), input
        self._begin = twins.first
        self._stop = twins.scenario.frames if stop is None else min(stop, twins.scenario.frames)
        self._finished: set[tuple[int, int]] = set()

    def finish(self, twin: int, noise: int) -> None:
        """Render no more frames of a twin with a noise seed."""
        self._finished.add((twin, noise))

    def __iter__(self) -> Iterator[list[TwinFrame]]:
        pairs = [(t, n) for t in range(len(self._twins)) for n in range(self._noises)]
        histories: dict[tuple[int, int], int] = dict.fromkeys(pairs, 0)
        displays: dict[int, AgcSequence | None] = {0: None}
        for index in range(self._first_index(), self._stop):
            lights: dict[Any, tuple[Floats, Truth]] = {}
            counts: dict[Any, Counts] = {}
            pictures: dict[int, Image] = {}
            later: dict[int, AgcSequence | None] = {}
            shown = []
            for t, n in pairs:
                if (t, n) in self._finished:
                    continue
                twin = self._twins[t]
                light_key, key = twin.keys(index)
                if light_key not in lights:
                    lights[light_key] = twin.renderer.scene(index)
                    self.rendered += 1
                self.asked += n == 0
                light, truth = lights[light_key]
                if (key, n) not in counts:
                    counts[key, n] = read_only(twin.counts(index, n, light))
                before = displays[histories[t, n]]
                for number in twin.numbers(index):
                    history = histories[t, n] = hash((histories[t, n], index, key, n, number, twin.agc))
                    if history not in pictures:
                        before = later[history] = copy(before) or AgcSequence(twin.agc, twin.bits, _unknown)
                        taken = counts[key, n]
                        is_counts = self._input == "counts"
                        pictures[history] = taken if is_counts else read_only(before.picture(taken, number))
                    before = later[history]
                    bits = twin.bits if self._input == "counts" else 8
                    frame = Frame(pictures[history], number, truth.time, bits, truth.pose)
                    shown.append(TwinFrame(t, n, frame, replace(truth, index=number), history))
                later.setdefault(histories[t, n], before)
            displays = later
            if index >= self._begin:
                yield shown

    def _first_index(self) -> int:
        """Return the first frame to render: frame 0 where the display depends on frames before the start."""
        memory = self._input == "display" and any(twin.agc.memory for twin in self._twins)
        return 0 if memory else self._begin


def _unknown(number: int) -> Counts:
    raise LookupError(f"frame {number} was not rendered: the frames of twins come in order")


class _Twin:
    """Renderer, detectors and display of one twin."""

    def __init__(self, twins: Twins, removed: Removed, noise_seeds: Sequence[int | None]) -> None:
        causes = [twins.causes[name] for name in sorted(removed)]
        self.renderer, self._base = twins.renderer(removed), twins.renderer(frozenset())
        self._causes = [each for each in causes if each.stage not in LATER]
        self._sensor_causes = frozenset(each.name for each in causes if each.stage == "sensor")
        moving = frozenset(each.name for each in causes if each.stage in ("path", "camera", "scene"))
        self._picture = twins.renderer(moving)
        self._detectors = [_with_noise(self.renderer, seed) for seed in noise_seeds]
        self._acted: Removed = frozenset()
        scenario = self.renderer.scenario
        self.agc, self.bits = scenario.shown.camera.agc, scenario.camera.bits
        self._arrivals = np.asarray(scenario.arrivals)

    def keys(self, index: int) -> tuple[Any, Any]:
        """Return keys that are equal for twins with the same light, and with the same counts, in a frame."""
        acting = frozenset(each.name for each in self._causes if self._acts(each, index))
        self._acted |= acting
        return acting, (acting if self._is_momentary(index) else self._acted, self._sensor_causes)

    def counts(self, index: int, noise: int, light: Floats) -> Counts:
        """Return the counts of a frame, (rows, cols), from its light, which stays unchanged."""
        if self._is_momentary(index):
            return self._detectors[noise].sensor.expose(light, index)
        return self._detectors[noise].frame(index)[0].image.astype(np.uint16, copy=False)

    def numbers(self, index: int) -> range:
        """Return the numbers under which a frame of the scenario arrives: none where it is lost, two where doubled."""
        return range(*np.searchsorted(self._arrivals, (index, index + 1)).tolist())

    def _is_momentary(self, index: int) -> bool:
        """Return whether the counts of a frame depend on its light alone, not on earlier frames or on footage."""
        renderer = self.renderer
        has_memory = renderer.response_time.has_memory or renderer.sensor.shown(index) != index
        return renderer.recorded is None and not has_memory

    def _acts(self, cause: Cause, index: int) -> bool:
        """Return whether a cause that is removed would change the light of a frame."""
        if cause.stage in ("layer", "scene"):
            return True
        if cause.stage in ("path", "camera"):
            return bool(self._moved[index] or self._moved[index // BLOCK * BLOCK])
        return not self._pieces(index).isdisjoint(cause.parts)

    @cached_property
    def _moved(self) -> Bools:
        """True in each frame in which camera or targets differ from the scenario's, (frames,) bool."""
        last, moved = self.renderer.scenario.frames - 1, np.zeros(self.renderer.scenario.frames, dtype=bool)
        own, base = self._picture.trajectories(last), self._base.trajectories(last)
        if len(own.exposure) != len(base.exposure):
            return ~moved
        for one, other in zip((own.now, *own.exposure), (base.now, *base.exposure), strict=True):
            pairs = [(getattr(one.camera, name), getattr(other.camera, name)) for name in ("turns", "places", "zooms")]
            known = {each.target.id: each for each in other.trajectories}
            for each in one.trajectories:
                pairs += [(each.positions, known[each.target.id].positions)]
                pairs += [(each.attitudes, known[each.target.id].attitudes)]
            for a, b in pairs:
                moved |= (a != b).reshape(len(a), -1)[: len(moved)].any(axis=1)
        return moved

    def _pieces(self, index: int) -> set[str]:
        """Return the names of targets and occluders in the picture of a frame, with none of them removed."""
        columns, rows = self._picture.context.geometry.size
        pieces = self._picture._prefetch.pieces(index)
        return {each.name for each in pieces if each.sprite.within((rows, columns)) is not None}


def _with_noise(renderer: Renderer, seed: int | None) -> Renderer:
    """Return a copy of a renderer with the detector's noise drawn by a seed; None: by that of the scene."""
    found = copy(renderer)
    found._frozen = None
    if seed is not None:
        found.sensor = replace(renderer.sensor, seed=seed)
    return found
