"""What gives frames: the Source protocol, and what is known of the camera behind one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from irsim.types.values import Band, Curve, Frame, Image, Input, Truth


class Display(Protocol):
    """How counts become the 8-bit picture."""

    def display(self, counts: Image, bits: int) -> npt.NDArray[np.uint8]:
        """The picture of counts (rows, cols) of that depth."""
        ...


@dataclass(frozen=True, slots=True)
class CameraFacts:
    """What is known of the camera behind a source; None: not known.

    ifov_rad   angle that a pixel sees, rad
    band       its name, or its limits, um
    range_k    temperatures of a black body that give count 0 and full scale, K; counts between are even in light
    curve      what counts stand for where range_k does not tell it, as of a camera that counts photons
    """

    ifov_rad: float | None = None
    band: Band | None = None
    range_k: tuple[float, float] | None = None
    curve: Curve | None = None


@runtime_checkable
class Source(Protocol):
    """Something that gives frames, truth (or none) and a hash: a rendered scenario or a recording.

    name           a short name for tables: a file's stem or the scenario's name
    hash           hex digest; two sources of one hash give the same counts and the same truth
    size           (columns, rows)
    follow         id of the target to follow where the user names none
    seed           of the rendered scene; None where no seed changes the frames
    scenario_text  the scenario that was rendered, as YAML; None where there was none
    file           the file that holds the frames; None where none does
    agc            how its counts become a picture; None where it does not say
    camera         what is known of the camera

    A class that derives from Source needs only what is without a value here.
    """

    @property
    def name(self) -> str: ...
    @property
    def hash(self) -> str: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def bits(self) -> int: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def follow(self) -> str | None: ...
    @property
    def has_truth(self) -> bool: ...

    @property
    def seed(self) -> int | None:
        return None

    @property
    def scenario_text(self) -> str | None:
        return None

    @property
    def file(self) -> Path | None:
        return None

    @property
    def needs(self) -> tuple[Path, ...]:
        """The files that its frames are read from: no output may replace them."""
        return () if self.file is None else (self.file,)

    @property
    def agc(self) -> Display | None:
        return None

    @property
    def camera(self) -> CameraFacts:
        return CameraFacts()

    def __len__(self) -> int: ...

    def frame(self, index: int, input: Input = "counts") -> Frame:
        """Frame `index`, the same bit for bit as in the sequence. IndexError past the end, InputError for
        another `input`."""
        ...

    def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Frames start .. stop-1 in order; an image given stays as it is when the next ones are made."""
        ...

    def truths(self, start: int = 0, stop: int | None = None) -> Iterator[Truth]:
        """Truths of the same frames; yields nothing where has_truth is False."""
        ...

    def truth(self, index: int) -> Truth | None:
        """The truth of frame `index` alone, without its counts; None where has_truth is False. IndexError where there
        is no such frame."""
        if not 0 <= index < len(self):
            raise IndexError(f"frame {index}: {self.name} has frames 0 to {len(self) - 1}")
        return next(iter(self.truths(index, index + 1)), None)

    def pairs(
        self, start: int = 0, stop: int | None = None, jobs: int = 1, input: Input = "counts"
    ) -> Iterator[tuple[Frame, Truth | None]]:
        """Frames start .. stop-1, each with its truth, in one go; by `jobs` processes where the source can."""
        frames = self.frames(input, start, stop)
        if self.has_truth:
            yield from zip(frames, self.truths(start, stop), strict=True)
        else:
            for frame in frames:
                yield frame, None

    def with_seed(self, seed: int) -> Source:
        """The same scene with another seed; itself where no seed changes the frames."""
        return self
