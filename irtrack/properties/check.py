"""Check of a tracker or detector: each property is tested on random examples, and a failing example is shrunk."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Literal
from zlib import crc32

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.configuration import set_hypothesis_home_dir
from hypothesis.errors import Flaky

from irsim.config.base import suggestion
from irsim.types import Box, Frame
from irtrack.bench.plan import task_of
from irtrack.errors import InputError, error_line
from irtrack.properties.case import Broken, Case, NotAsked
from irtrack.properties.subjects import subject
from irtrack.properties.table import EXCEPTIONS, PROPERTIES_OF, Property
from irtrack.registry.identity import Runnable, tracker_name, tracker_needs
from irtrack.registry.table import runnable
from irtrack.runner.pool import Pool
from irtrack.runner.watchdog import Heartbeat, Limit, TrackerLostError
from irtrack.types import Detections, Estimate, GivenTracker, Tracker

Profile = Literal["ci", "nightly"]
Verdict = Literal["holds", "broken", "excused", "not asked", "not judged"]

NIGHTLY = 10
"""Factor by which a nightly check has more examples than a ci check."""
SEEDS: Mapping[Profile, int] = {"ci": 8, "nightly": 32}


@dataclass(frozen=True)
class Outcome:
    """Result of one property.

    verdict   'excused': broken, with a known reason; 'not asked': does not apply to this tracker; 'not judged': needs a
              property that is broken
    why       result and tolerance, or the reason
    drawn     drawn values of the smallest failing example, by name
    scenario  scene of this example as YAML; None where it has no scene
    """

    property: Property
    verdict: Verdict
    why: str = ""
    drawn: Mapping[str, Any] = field(default_factory=dict)
    scenario: str | None = None


@dataclass
class _Found:
    """Last failing example, which is the least one, since Hypothesis shrinks failing examples."""

    case: Case | None = None
    why: str = ""


def examined(prop: Property, tracker: Tracker, profile: Profile) -> Outcome:
    """Test a property and return its outcome, which is the same at each call."""
    found, silent = _Found(), set[str]()

    @seed(crc32(prop.name.encode()))  # Hypothesis' `derandomize` would seed by the source text of this function
    @settings(
        max_examples=max(prop.examples * (NIGHTLY if profile == "nightly" else 1), 1),
        database=None,
        deadline=None,
        phases=[Phase.generate, Phase.shrink],
        report_multiple_bugs=False,
        print_blob=False,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.data())
    def example(data: st.DataObject) -> None:
        case = Case(tracker, lambda strategy: data.draw(strategy), SEEDS[profile])
        try:
            with redirect_stdout(sys.stderr):
                prop.check(case)
        except NotAsked as reason:
            silent.add(str(reason))
        except Exception as error:  # any exception of the tracker breaks the property
            found.case, found.why = case, str(error) if isinstance(error, Broken) else f"raises {error_line(error)}"
            raise

    try:
        example()
    except Exception as error:
        if found.case is None:
            raise
        note = "; not at each try" if isinstance(error, Flaky) else ""
        clips = found.case.clips
        return Outcome(prop, "broken", found.why + note, found.case.drawn, clips[0].text if clips else None)
    return Outcome(prop, "not asked", next(iter(silent))) if silent else Outcome(prop, "holds")


def check(
    tracker: str | GivenTracker | Runnable | type | Callable[..., object],
    *,
    profile: Profile = "ci",
    only: Iterable[str] | None = None,
    frame_limit_s: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Outcome]:
    """Test each property, or the properties `only`, and return their outcomes in the order of the table of its task.

    Properties needed by those in `only` are tested too, and have an outcome where they are broken.

    tracker        as in `irtrack.run`, a tracker of many, or a detector: name, function, class or object
    profile        effort: ci takes seconds, nightly minutes
    frame_limit_s  longest time of the tracker for a frame, s, in a worker process; a tracker that takes longer, or
                   dies, breaks only the property under test
    progress       called with (properties done, properties to do)

    The examples are the same at each call. InputError for an unknown name of a tracker or property.
    """
    chosen = runnable(tracker)
    if tracker_needs(chosen):
        raise InputError(f"{tracker_name(chosen)}: needs the camera's pose, which the clips of a check do not have")
    task = task_of(chosen)
    table = PROPERTIES_OF[task]
    wanted = set(table) if only is None else {_known(name, table) for name in only}
    needed = with_needs(wanted, table)
    names = [name for name in table if name in needed]
    excuses = EXCEPTIONS.get(tracker_name(chosen), {})
    outcomes: dict[str, Outcome] = {}
    with _examiner(subject(chosen), profile, frame_limit_s) as examine:
        for done, name in enumerate(names, 1):
            prop = table[name]
            lacking = [need for need in prop.needs if outcomes[need].verdict == "broken"]
            if lacking:
                outcomes[name] = Outcome(prop, "not judged", f"needs {', '.join(lacking)}")
            else:
                outcomes[name] = _excused(examine(prop), excuses)
            if progress is not None:
                progress(done, len(names))
    return [each for name, each in outcomes.items() if name in wanted or each.verdict == "broken"]


def with_needs(names: Iterable[str], table: Mapping[str, Property]) -> set[str]:
    """Return these names of properties, with all properties that they need directly or indirectly."""
    found = set[str]()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += table[name].needs
    return found


@contextmanager
def _examiner(tracker: Tracker, profile: Profile, limit_s: float | None) -> Iterator[Callable[[Property], Outcome]]:
    """Yield a function that tests a property, in this process, or in a worker with a time limit for each frame."""
    if limit_s is None:
        yield lambda prop: examined(prop, tracker, profile)
        return
    limit = Limit(limit_s, "frame")
    with Pool(1) as pool:

        def examined_apart(prop: Property) -> Outcome:
            try:
                return pool.call(_examined_in_worker, prop.name, tracker, profile, limit=limit, name=prop.name)
            except TrackerLostError as lost:
                return Outcome(prop, "broken", str(lost))

        yield examined_apart


def _examined_in_worker(heartbeat: Heartbeat, name: str, tracker: Tracker, profile: Profile) -> Outcome:
    set_hypothesis_home_dir(_NOWHERE)
    return examined(PROPERTIES_OF[task_of(tracker)][name], Watched(tracker, heartbeat), profile)


_NOWHERE = Path(os.devnull) / "hypothesis"
"""Folder that cannot be created, so that Hypothesis does not store constants of the tracker's modules in it."""


@dataclass(frozen=True, eq=False)
class Watched:
    """Tracker wrapped to record each frame that it works on in a heartbeat; it is pickled without the wrapper."""

    tracker: Tracker
    heartbeat: Heartbeat

    def __getattr__(self, name: str) -> Any:
        return getattr(self.tracker, name)  # such as `resumable` and `task`

    def on(self, plots: Sequence[Detections]) -> Watched | None:
        """Return a tracker of many on given detections (`ManySubject.on`)."""
        fed = self.tracker.on(plots)  # type: ignore[attr-defined]  # a `ManySubject`
        return None if fed is None else Watched(fed, self.heartbeat)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Any:
        return self._call(self.tracker.init, frame, box, rng)

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, Estimate]:
        answer: tuple[Any, Estimate] = self._call(partial(self.tracker.step, state), frame, rng)
        return answer

    def _call(self, work: Callable[..., Any], frame: Frame, *given: object) -> Any:
        with self.heartbeat.frame(frame.index):
            try:
                return work(frame, *given)
            except KeyboardInterrupt as error:  # workers ignore Ctrl-C: the tracker raised it
                raise RuntimeError(error_line(error)) from error

    def __reduce__(self) -> tuple[Any, ...]:
        return _itself, (self.tracker,)


def _itself(tracker: Tracker) -> Tracker:
    return tracker


def check_tracker(
    tracker: str | GivenTracker | Runnable | type | Callable[..., object],
    *,
    profile: Profile = "ci",
    only: Iterable[str] | None = None,
    excused: Mapping[str, str] | None = None,
) -> None:
    """Raise AssertionError, with the smallest failing examples, where a tracker breaks a property; for your own tests.

    excused    reason by name of the property, for known failures;  the other arguments as for `check`
    """
    excuses = excused or {}
    table = PROPERTIES_OF[task_of(runnable(tracker))]
    for name in excuses:
        _known(name, table)
    outcomes = [_excused(outcome, excuses) for outcome in check(tracker, profile=profile, only=only)]
    lines = [
        f"{each.property.name}: {each.property.says}\n  {each.why}" for each in outcomes if each.verdict == "broken"
    ]
    if lines:
        broken = f"{len(lines)} of {len(outcomes)} properties {'is' if len(lines) == 1 else 'are'} broken"
        raise AssertionError("\n".join([broken, *lines]))


def _excused(outcome: Outcome, excuses: Mapping[str, str]) -> Outcome:
    reason = excuses.get(outcome.property.name)
    if outcome.verdict != "broken" or reason is None:
        return outcome
    return Outcome(outcome.property, "excused", reason)


def _known(name: str, table: Mapping[str, Property]) -> str:
    if name not in table:
        allowed = ", ".join(table)
        raise InputError(f"unknown property '{name}'; allowed: {allowed}{suggestion(name, table)}")
    return name
