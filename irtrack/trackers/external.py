"""Trackers of one target that run as programs, by the protocols of `irtrack.external`: `program`, `trax`, peers."""

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
class ExternalState:
    """State: the session with the program, which keeps its own memory, so that no step can be repeated."""

    footage: Footage
    session: Session | TraxSession


class ExternalTracker(TrackerPart):
    """Tracker that runs as a program. TrackerError where the program raises, dies or hangs."""

    resumable: ClassVar[bool] = False
    name: ClassVar[str]

    context: Annotated[float, Field(ge=0.2, le=20)] = 1.0
    """Side of the box passed to the program, in sides of the target; 3 is usual for correlation filters."""
    timeout_s: Annotated[float, Field(ge=0.01, le=3600)] = 60.0
    """Longest time of a step, s, after which the program counts as hanging."""

    @abstractmethod
    def runs(self) -> tuple[str, ...]:
        """Return the command that starts the program; InputError where it is missing or invalid."""

    def session(self) -> Session | TraxSession:
        """Return a session with the program, newly started or idle from an earlier session."""
        return Session(self.name, self.runs(), self.timeout_s)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> ExternalState:
        """Start the program and return the state, which holds its session.

        The program gets the start box with each side raised to LEAST_PX, then multiplied by `context`. InputError where
        the box does not meet the frame, or the program cannot be started.
        """
        start_window(frame, box)
        given = box.at_least(LEAST_PX)
        given = Box(given.cx, given.cy, given.w * self.context, given.h * self.context)
        session = self.session()
        session.init(frame, given, int(rng.integers(2**31)))
        return ExternalState(footage(frame), session)

    def step(self, state: ExternalState, frame: Frame, rng: np.random.Generator) -> tuple[ExternalState, Estimate]:
        """Return the box that the program answers, with its size divided by `context`."""
        state.footage.check(frame)
        answer = state.session.step(frame)
        box = answer.box
        size = box.w / self.context, box.h / self.context
        return state, Estimate((box.cx, box.cy), size, answer.status, answer.score)


def as_written(value: Any) -> Any:
    """Return true and false of YAML as texts, since `true` and `false` are also names of programs."""
    return str(value).lower() if isinstance(value, bool) else value


def words_of(name: str, command: str) -> tuple[str, ...]:
    """Return the words of a command in the syntax of a shell; InputError of the tracker `name` where there are none."""
    try:
        words = tuple(shlex.split(command))
    except ValueError as error:  # a quote that is not closed
        raise InputError(f"{name}: command: {error}; allowed: quotes that are closed") from None
    if not words:
        raise InputError(f"{name}: command: is empty; allowed: a command such as 'python3 mine.py'")
    return words


class Command(ExternalTracker):
    """Program started by a command of the user."""

    command: Annotated[str, BeforeValidator(as_written)]
    """Command that starts it, in the syntax of a shell."""

    def runs(self) -> tuple[str, ...]:
        return words_of(self.name, self.command)


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


class Peer(ExternalTracker):
    """A tracker of OpenCV or dlib in the environment of `make peers`."""

    def runs(self) -> tuple[str, ...]:
        return command(self.name, required(self.name))


class Mil(Peer):
    """Multiple instance learning, of OpenCV. Its random numbers are seeded by the clock: no two runs are the same."""

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
    """Correlation filter with minimum output sum of squared error (MOSSE), of OpenCV."""

    name: ClassVar[str] = "cv_mosse"
    source: ClassVar[str] = "Bolme, Beveridge, Draper, Lui 2010"


class Dlib(Peer):
    """Correlation filter with scale, of dlib; it never reports a loss."""

    name: ClassVar[str] = "dlib"
    source: ClassVar[str] = "Danelljan, Hager, Khan, Felsberg 2014"


EXTERNAL: dict[str, type[ExternalTracker]] = {cls.name: cls for cls in (Program, Trax, Mil, Kcf, Csrt, Mosse, Dlib)}
"""Trackers of one target that run as programs, by name. They are not in `TRACKERS`: a peer may not be installed."""
