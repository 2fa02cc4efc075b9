"""Open a source of frames: a scenario file, a shipped scenario or a recording."""

from __future__ import annotations

import shlex
from bisect import bisect_left
from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path

from irsim.config.overrides import expect_overrides
from irsim.config.paths import is_recording
from irsim.errors import InputError
from irsim.recording import Recording, open_recording
from irsim.render.stream import Rendering
from irsim.scenario.fingerprint import has_own_kinds
from irsim.scenario.loader import load, loads
from irsim.scenario.model import Scenario, expect_names
from irsim.types import Source


def open_source(
    path: str | PathLike[str] | Scenario | Source,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    without: Sequence[str] = (),
) -> Source:
    """Return a Source from a scenario's file or name, a recording's file, a Scenario, or a Source (returned as is).

    `overrides` ("camera.netd_mk=80"), `seed` and `without` (more parts to switch off) are allowed for scenarios only.
    InputError where a recording has one of them, and for any other argument.
    """
    if isinstance(path, Scenario):
        _refuse(overrides, without, "a Scenario in Python: set its fields instead")
        return Rendering(path if seed is None else path.model_copy(update={"seed": seed}))
    if not isinstance(path, str | PathLike):
        if not all(callable(getattr(path, method, None)) for method in ("frame", "frames", "truths")):
            raise InputError(
                f"a {type(path).__name__} is no source; "
                "allowed: the path of a scenario or a recording, a shipped scenario's name, a Scenario, or a Source"
            )
        _refuse(overrides, without, path.name)
        if seed is not None:
            raise InputError(f"{path.name}: a seed is for scenarios, this is a source already opened")
        return path
    if fspath(path) and Path(path).is_dir():
        raise InputError(
            f"{path}: is a folder; allowed: a scenario or a recording (irsim import {shlex.quote(fspath(path))} makes "
            "a recording of its pictures)"
        )
    if is_recording(Path(path)):
        _refuse(overrides, without, str(path))
        if seed is not None:
            raise InputError(f"{path}: a recording has no seed; allowed for scenarios only")
        return open_recording(Path(path))
    changes = [*expect_overrides(overrides), *([] if seed is None else [f"seed={seed}"])]
    return Rendering(load(path, [*changes, *switched_off(path, changes, without)]), Path(path).stem)


def draw_own_kinds(path: str | PathLike[str], overrides: Sequence[str], without: Sequence[str]) -> None:
    """Render the first frame of a scenario with kinds of the user's own, so that their errors are raised."""
    source = open_source(path, overrides, without=without)
    if isinstance(source, Rendering) and has_own_kinds(source.scenario):
        source.frame(0)


def switched_off(path: str | PathLike[str], overrides: Sequence[str], without: Sequence[str]) -> list[str]:
    """Return the override that also switches off the parts in `without`; an empty list if `without` is empty."""
    return _off(load(path, overrides), without) if without else []


def _off(scenario: Scenario, without: Sequence[str]) -> list[str]:
    names = dict.fromkeys([*scenario.without, *expect_names(without)])
    return [f"without=[{', '.join(names)}]"]


def open_rendering(
    path: str | PathLike[str],
    overrides: Sequence[str] = (),
    seed: int | None = None,
    frames: tuple[int, int] | None = None,
    without: Sequence[str] = (),
) -> tuple[Rendering, int, int]:
    """Return (rendering, start, stop) of a scenario, or of the scenario in a recording.

    path      file or name of a scenario, or file of a recording
    frames    (start, stop) as frame numbers of the scenario or of the recording; default: all frames. Frame numbers
              of a recording count only frames that arrived, those of a scenario also lost ones
    without   more parts to switch off

    A recording's scenario runs no code that it names (see `loader.loads`). InputError as in `load`, and where a
    recording holds no scenario, or lacks some of its frames between its first and its last.
    """
    recording = open_recording(Path(path)) if is_recording(Path(path)) else None
    changes = [*overrides, *([] if seed is None else [f"seed={seed}"])]

    def scenario(count: int | None) -> Scenario:
        every = changes if count is None else [*changes, f"frames={count}"]
        found = _scenario(path, recording, every)
        return _scenario(path, recording, [*every, *_off(found, without)]) if without else found

    name, before = (Path(path).stem, 0) if recording is None else (recording.header.name, recording.header.first_frame)
    rendering = Rendering(scenario(None), name)
    own = rendering.scenario.frames  # not fewer, or occluders that are placed for later frames would move
    if recording is None:
        first, last = frames or (0, own)
        if last > own:
            rendering = Rendering(scenario(last), name)
        start, stop = (bisect_left(rendering.arrivals, each) for each in (first, last))
        if start == stop:
            raise InputError(f"{path}: frames {first}:{last}: none arrives; allowed: a range with frames that arrive")
        return rendering, start, stop
    _check_places(path, recording, rendering)
    if frames is None:
        longer = any(change.partition("=")[0].strip() == "frames" for change in changes)
        return rendering, before, len(rendering) if longer else min(before + len(recording), len(rendering))
    start, stop = before + frames[0], before + frames[1]
    while len(rendering) < stop:  # some of the added frames may be lost
        own += stop - len(rendering)
        rendering = Rendering(scenario(own), name)
    return rendering, start, stop


def _check_places(path: str | PathLike[str], recording: Recording, rendering: Rendering) -> None:
    """Raise InputError if a recording's frame times differ from its scenario's, as after a loss of frames."""
    if _misplaced(recording, rendering) is None:
        return
    found = _misplaced(recording, Rendering(_scenario(path, recording, ())))
    if found is not None:
        index, time, expected = found
        raise InputError(
            f"{path}: frame {index} was taken at {time:.6g} s, its scenario's at {expected:.6g} s: some before it were "
            "lost; allowed: a recording of all frames from its first to its last, or the scenario itself"
        )


def _misplaced(recording: Recording, rendering: Rendering) -> tuple[int, float, float] | None:
    """Return the first frame of a recording with an unexpected time: (frame, its time, expected time), s."""
    arrivals = rendering.arrivals[recording.header.first_frame :]
    for index, time in recording.indexed_times():
        expected = arrivals[index] / rendering.rate_hz if index < len(arrivals) else time
        if time != expected:
            return index, time, expected
    return None


def _scenario(path: str | PathLike[str], recording: Recording | None, changes: Sequence[str]) -> Scenario:
    if recording is None:
        return load(path, changes)
    if recording.scenario_text is None:
        raise InputError(f"{path}: holds no scenario, its frames were imported; allowed: a recording of a scenario")
    return loads(recording.scenario_text, f"{path}: scenario", changes, trusted=False)


def _refuse(overrides: Sequence[str], without: Sequence[str], what: str) -> None:
    if overrides:
        raise InputError(f"{overrides[0]}: overrides are for scenarios; {what} cannot be changed")
    if without:
        raise InputError(f"without={without[0]}: parts are switched off in scenarios; {what} cannot be changed")
