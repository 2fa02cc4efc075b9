"""Properties tried in a process of its own, which a tracker may hang or kill."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from hypothesis.configuration import set_hypothesis_home_dir

from irsim.types import Box, Frame
from irtrack.errors import told
from irtrack.properties.check import Outcome, Profile, examined
from irtrack.properties.table import PROPERTIES, Property
from irtrack.runner import Blame, Board, Limit, Watched, answer_or_blame
from irtrack.types import Estimate, Tracker, resumable

_NOWHERE = Path(os.devnull) / "hypothesis"
"""Where Hypothesis may put nothing: it would leave a folder of the constants of the tracker's modules behind."""


class Examiner:
    """A process that tries one property after the other; it is replaced where the tracker hangs or kills it."""

    def __init__(self, tracker: Tracker, profile: Profile, limit_s: float) -> None:
        self._limit_s = limit_s
        self._process = Watched(_begin, tracker, profile, limit_s)

    def examined(self, prop: Property) -> Outcome:
        """As `irtrack.properties.examining.examined`; InputError for a tracker that cannot be sent there. WorkerError
        where processes die again and again before it is at work."""
        exceeded = Limit(self._limit_s, "frame").exceeded()
        answer = answer_or_blame(self._process, prop.name, exceeded, prop.name)
        if isinstance(answer, Blame):
            return Outcome(prop, "broken", f"frame {answer.frame}: {answer.what}")
        outcome: Outcome = answer
        return outcome

    def close(self) -> None:
        """End the process, whatever it is at."""
        self._process.close()


def _begin(board: Board, tracker: Tracker, profile: Profile, limit_s: float) -> Callable[[str], Outcome]:
    """What the process does with each name of a property."""
    set_hypothesis_home_dir(_NOWHERE)
    timed = Timed(tracker, board, limit_s)
    return lambda name: examined(PROPERTIES[name], timed, profile)


@dataclass(frozen=True, eq=False)
class Timed:
    """A tracker that writes down whether it is at work, at which frame it is or was last, and until when it may be."""

    tracker: Tracker
    board: Board
    limit_s: float

    @property
    def resumable(self) -> bool:
        return resumable(self.tracker)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Any:
        return self._timed(frame, lambda: self.tracker.init(frame, box, rng))

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, Estimate]:
        answer: tuple[Any, Estimate] = self._timed(frame, lambda: self.tracker.step(state, frame, rng))
        return answer

    def _timed(self, frame: Frame, work: Callable[[], Any]) -> Any:
        self.board.begin(0, frame.index, monotonic() + self.limit_s)
        try:
            return work()
        except KeyboardInterrupt as error:  # Ctrl-C is ignored here: the tracker raised it
            raise RuntimeError(told(error)) from error
        finally:
            self.board.end()

    def __reduce__(self) -> tuple[Any, ...]:
        return _itself, (self.tracker,)


def _itself(tracker: Tracker) -> Tracker:
    """Of what is pickled for yet another process the tracker alone."""
    return tracker
