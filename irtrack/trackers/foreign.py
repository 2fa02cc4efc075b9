"""`program`, `trax` and the peers: trackers that run as programs of their own (`irtrack.external`)."""

from __future__ import annotations

import shlex
from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field

from irsim.types import Box, Frame
from irtrack.errors import InputError
from irtrack.external import Session, TraxSession, command, required
from irtrack.trackers.base import Footage, TrackerPart, footage, start_window
from irtrack.types import LEAST_PX, Estimate


@dataclass(frozen=True, slots=True, eq=False)
class ForeignState:
    """The program that follows the target; what it last saw lies there, so that no step can be done again."""

    footage: Footage
    session: Session | TraxSession


class Foreign(TrackerPart):
    """A tracker that runs as a program. What the program raises, its death and its hanging are a TrackerError."""

    resumable: ClassVar[bool] = False
    name: ClassVar[str]

    context: Annotated[float, Field(ge=0.2, le=20)] = 1.0
    """The box that it is given, as a multiple of the target's on each side: correlation filters live on what is
    around the target (3 is usual)."""
    timeout_s: Annotated[float, Field(ge=0.01, le=3600)] = 60.0
    """How long a step may take before the program counts as hanging, s."""

    @abstractmethod
    def runs(self) -> tuple[str, ...]:
        """The command that starts the program; InputError where there is none."""

    def session(self) -> Session | TraxSession:
        """A program that can be asked."""
        return Session(self.name, self.runs(), self.timeout_s)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> ForeignState:
        """Whole pixels are all that some can be given, and no side under LEAST_PX.

        InputError where the box does not meet the frame, or the program cannot be started.
        """
        start_window(frame, box)
        given = box.at_least(LEAST_PX)
        given = Box(given.cx, given.cy, given.w * self.context, given.h * self.context)
        session = self.session()
        session.init(frame, given, int(rng.integers(2**31)))
        return ForeignState(footage(frame), session)

    def step(self, state: ForeignState, frame: Frame, rng: np.random.Generator) -> tuple[ForeignState, Estimate]:
        """The program's box, its size less the context."""
        state.footage.check(frame)
        answer = state.session.step(frame)
        box = answer.box
        size = box.w / self.context, box.h / self.context
        return state, Estimate((box.cx, box.cy), size, answer.status, answer.score)


def _as_written(value: Any) -> Any:
    """The word behind YAML's truth: `true` and `false` are programs."""
    return str(value).lower() if isinstance(value, bool) else value


class Command(Foreign):
    """A program that is started by a command of the user's."""

    command: Annotated[str, BeforeValidator(_as_written)]
    """The command that starts it, as a shell would take it."""

    def runs(self) -> tuple[str, ...]:
        try:
            words = tuple(shlex.split(self.command))
        except ValueError as error:  # a quote that is not closed
            raise InputError(f"{self.name}: command: {error}; allowed: quotes that are closed") from None
        if not words:
            raise InputError(f"{self.name}: command: is empty; allowed: a command such as 'python3 mine.py'")
        return words


class Program(Command):
    """Any program that speaks the protocol of docs/trackers.md over its standard input and output."""

    name: ClassVar[str] = "program"
    source: ClassVar[str] = "your own"


class Trax(Command):
    """Any program that speaks TraX, the protocol of the VOT challenges, over its standard input and output."""

    name: ClassVar[str] = "trax"
    source: ClassVar[str] = "your own, or any tracker of VOT"

    def session(self) -> TraxSession:
        return TraxSession(self.name, self.runs(), self.timeout_s)


class Peer(Foreign):
    """A tracker of OpenCV or dlib in the environment of `make peers`."""

    def runs(self) -> tuple[str, ...]:
        return command(self.name, required(self.name))


class Mil(Peer):
    """Multiple instance learning, of OpenCV, which draws by the clock: no two runs are the same."""

    name: ClassVar[str] = "cv_mil"
    source: ClassVar[str] = "Babenko, Yang, Belongie 2009"


class Kcf(Peer):
    """Kernelised correlation filter, of OpenCV."""

    name: ClassVar[str] = "cv_kcf"
    source: ClassVar[str] = "Henriques, Caseiro, Martins, Batista 2015"


class Csrt(Peer):
    """Discriminative correlation filter with channel and spatial reliability, of OpenCV."""

    name: ClassVar[str] = "cv_csrt"
    source: ClassVar[str] = "Lukezic, Vojir, Cehovin Zajc, Matas, Kristan 2017"


class Mosse(Peer):
    """Correlation filter of minimum output sum of squared error, of OpenCV."""

    name: ClassVar[str] = "cv_mosse"
    source: ClassVar[str] = "Bolme, Beveridge, Draper, Lui 2010"


class Dlib(Peer):
    """Correlation filter with scale, of dlib; it never says that it lost the target."""

    name: ClassVar[str] = "dlib"
    source: ClassVar[str] = "Danelljan, Hager, Khan, Felsberg 2014"


FOREIGN: dict[str, type[Foreign]] = {cls.name: cls for cls in (Program, Trax, Mil, Kcf, Csrt, Mosse, Dlib)}
"""Trackers that are programs, by name. They are no part of `TRACKERS`: a peer may not be installed."""
