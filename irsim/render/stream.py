"""Frames and truths of a scenario: in order or by index, by one process or several."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TypeVar

from irsim.camera.agc import Agc, AgcSequence
from irsim.errors import frame_number, whole_number
from irsim.notebook import source_card, source_line
from irsim.render.footage import footage_id
from irsim.render.frame import Renderer, part_names
from irsim.render.masks import visible_pixels
from irsim.render.workers import rendered
from irsim.scenario.loader import dumps
from irsim.scenario.model import Scenario, expect_scenario
from irsim.types import Bools, CameraFacts, Frame, Input, Truth, expect_input, frame_range

Numbered = TypeVar("Numbered", Frame, Truth)


class Rendering:
    """Scenario as a Source whose frames are rendered on demand and not kept.

    Frame k is the k-th frame that arrives, where the camera drops or doubles some. Its time is that of its exposure.
    """

    has_truth = True
    file = None

    def __init__(self, scenario: Scenario, name: str = "scenario") -> None:
        self.scenario = expect_scenario("Rendering", scenario)
        self.name = name

    def __reduce__(self) -> tuple[type[Rendering], tuple[Scenario, str]]:
        return Rendering, (self.scenario, self.name)  # a worker paints its own textures

    def __repr__(self) -> str:
        targets = ", ".join(target.id for target in self.scenario.targets)
        return source_line(self, f"truth of {targets or 'no target'}")

    def _repr_html_(self) -> str:
        return source_card(self)

    @cached_property
    def _renderer(self) -> Renderer:
        return Renderer(self.scenario)

    @cached_property
    def hash(self) -> str:
        return self.scenario.hash

    @cached_property
    def scenario_text(self) -> str:
        """Scenario as YAML with every key written out, as recordings hold it."""
        return dumps(self.scenario)

    @property
    def needs(self) -> tuple[Path, ...]:
        return self.scenario.files

    @property
    def seed(self) -> int:
        return self.scenario.seed

    def with_seed(self, seed: int) -> Rendering:
        return Rendering(self.scenario.model_copy(update={"seed": whole_number("seed", seed)}), self.name)

    @property
    def camera(self) -> CameraFacts:
        camera = self.scenario.camera
        ranged = "range_k" in camera.detector.camera_keys
        own = CameraFacts(
            camera.geometry.ifov_rad,
            camera.band,
            camera.range_k if ranged else None,
            None if ranged else camera.response().curve,
        )
        return self.scenario.background.recorded_camera(own)

    @property
    def size(self) -> tuple[int, int]:
        return self.scenario.camera.size

    @property
    def bits(self) -> int:
        return self.scenario.camera.bits

    @property
    def rate_hz(self) -> float:
        return self.scenario.camera.rate_hz

    @property
    def agc(self) -> Agc:
        return self.scenario.shown.camera.agc

    @cached_property
    def arrivals(self) -> Sequence[int]:
        """Scenario's frame number for each frame of the source."""
        return self.scenario.arrivals

    @property
    def follow(self) -> str | None:
        return self.scenario.follow or next(iter(self.target_classes), None)

    @cached_property
    def target_classes(self) -> dict[str, str | None]:
        """Class of each target by id: those of the scenario, then those of its footage."""
        scenario = self.scenario
        own = {each.id: each.cls or each.shape.default_class for each in scenario.targets if scenario.is_on(each.id)}
        taken = part_names(scenario)
        return own | {footage_id(name, taken): cls for name, cls in scenario.background.recorded_targets.items()}

    def __len__(self) -> int:
        return len(self.arrivals)

    def frame(self, index: int, input: Input = "counts") -> Frame:
        expect_input(input)
        frame = self._counts(index)
        return frame if input == "counts" else self._agc_sequence.display(frame)

    def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        for frame, _ in self.pairs(start, stop, input=input):
            yield frame

    def truths(self, start: int = 0, stop: int | None = None) -> Iterator[Truth]:
        for index in frame_range(start, stop, len(self)):
            yield _numbered(self._renderer.scene(self.arrivals[index])[1], index)

    def truth(self, index: int) -> Truth:
        index = frame_number(index, len(self), self.name)
        return next(self.truths(index, index + 1))

    def pairs(
        self, start: int = 0, stop: int | None = None, jobs: int = 1, input: Input = "counts"
    ) -> Iterator[tuple[Frame, Truth]]:
        """Yield (frame, truth) of frames start .. stop-1 in order, rendered by `jobs` worker processes if `jobs` > 1.

        With `jobs` > 1 the calling script needs the guard ``if __name__ == "__main__"``. InputError as in `frames`.
        """
        expect_input(input)
        wanted = frame_range(start, stop, len(self))
        taken = self.arrivals[wanted.start : wanted.stop]
        agc_sequence = self._new_agc_sequence()
        jobs = min(whole_number("jobs", jobs, 1), len(taken))
        pairs = rendered(self.scenario, taken, jobs) if jobs > 1 else map(self._renderer.frame, taken)
        for index, (frame, truth) in zip(wanted, pairs, strict=True):
            arrived = _numbered(frame, index)
            yield (arrived if input == "counts" else agc_sequence.display(arrived)), _numbered(truth, index)

    def masked_pairs(
        self, start: int = 0, stop: int | None = None, input: Input = "counts"
    ) -> Iterator[tuple[Frame, Truth, dict[str, Bools]]]:
        """Yield (frame, truth, visible pixels of each target by id) of frames start .. stop-1 (`visible_pixels`)."""
        expect_input(input)
        agc_sequence = self._new_agc_sequence()
        for index in frame_range(start, stop, len(self)):
            frame, truth, drawn = self._renderer.drawn_frame(self.arrivals[index])
            arrived = _numbered(frame, index)
            shown = arrived if input == "counts" else agc_sequence.display(arrived)
            yield shown, _numbered(truth, index), visible_pixels(drawn, frame.image.shape)

    @cached_property
    def _agc_sequence(self) -> AgcSequence:
        return self._new_agc_sequence()

    def _new_agc_sequence(self) -> AgcSequence:
        return AgcSequence(self.agc, self.bits, lambda index: self._counts(index).image)

    def _counts(self, index: int) -> Frame:
        index = frame_number(index, len(self), self.name)
        return _numbered(self._renderer.frame(self.arrivals[index])[0], index)


def _numbered(of: Numbered, index: int) -> Numbered:
    """Return a frame or truth with its index in the source, which differs from the scenario's where frames are lost."""
    return of if of.index == index else replace(of, index=index)


def frames(scenario: Scenario, start: int = 0, stop: int | None = None, jobs: int = 1) -> Iterator[tuple[Frame, Truth]]:
    """Yield (Frame, Truth) of a scenario's frames start .. stop-1 in order: counts and ground truth.

    With `jobs` > 1, that many worker processes render the frames, with identical results; the calling script then needs
    the guard ``if __name__ == "__main__"``. Workers take about a second to start, which pays from about a thousand
    small or a hundred large frames on. Callers may keep and change the frames.

    InputError for an argument that is not a scenario (a recording has its own `frames()` and `truths()`), for a start
    or a stop below 0, and for a number of frames or jobs that is not whole.
    """
    return Rendering(expect_scenario("frames", scenario, "; a Source has frames() and truths()")).pairs(
        start, stop, jobs
    )
