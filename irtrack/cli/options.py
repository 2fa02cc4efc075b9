"""Options of several commands; parsing of start boxes and of KEY=VALUE settings."""

from __future__ import annotations

import inspect
import shlex
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli.terminal import given_path
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irsim.types import Box, Input


def option(metavar: str, help: str, *names: str, **more: Any) -> Any:
    """Return an option of a command."""
    return typer.Option(*names, metavar=metavar, help=help, **more)


def argument(metavar: str, help: str, **more: Any) -> Any:
    """Return an argument of a command."""
    return typer.Argument(metavar=metavar, help=help, **more)


def path_option(metavar: str, help: str, *names: str) -> Any:
    """Return an option whose value is a path."""
    return option(metavar, help, *names, parser=given_path)


TRACKERS = "[LABEL=]NAME[:KEY=VALUE...],..."
TRACKERS_HELP = "Trackers by name, parameters after colons: grey_pf,big=grey_pf:particles=500"

FRAME_LIMIT_S = 10.0
"""Default time limit for a frame, s: hundreds of times the time of the slowest shipped tracker."""

AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]
Trust = Annotated[bool, typer.Option("--trust", help="Let trackers that a suite or a kept failure names run commands.")]
Jobs = Annotated[int, option("N", "Worker processes.", min=1)]
FrameLimit = Annotated[
    float, option("S", "Time limit for a frame; a tracker that exceeds it counts as hung.", min=0.01)
]
FilledResults = Annotated[Path, argument("DB", "Results file of `irtrack bench`.", parser=given_path)]
GrowingResults = Annotated[Path, path_option("DB", "Results file; finished runs in it are not repeated.")]
InputName = Annotated[
    str, option("display|counts", "Input of the trackers: the 8-bit picture or the counts.", "--input")
]


def command_line() -> str:
    """Return the command line."""
    return shlex.join(["irtrack", *sys.argv[1:]])


def input_name(word: str) -> Input:
    """Return the value of --input; InputError for an unknown one."""
    if word == "display":
        return "display"
    if word == "counts":
        return "counts"
    raise InputError(f"--input {word}: allowed: display or counts")


def names(option: str, text: str | None) -> list[str] | None:
    """Split the comma-separated names of an option; None without the option, InputError for an empty name."""
    found = None if text is None else [name.strip() for name in text.split(",")]
    if found is not None and not all(found):
        raise InputError(f"{option} '{text}': a name is empty; allowed: names separated by commas, or no {option}")
    return found


def auto_detector(text: str, init: object, target: object) -> str:
    """Return the detector of --start auto[:DETECTOR]; InputError for another text, or beside --init or --target."""
    word, _, detector = text.partition(":")
    if word != "auto":
        raise InputError(f"--start {text}: allowed: auto, or auto:DETECTOR such as auto:dog")
    if init is not None or target is not None:
        raise InputError(f"--start {text}: finds its own target; allowed: no --init and no --target beside it")
    return detector or "lcm"


def start_box(text: str) -> tuple[Box, int]:
    """Parse 'X,Y,W,H[@FRAME]', a box as in label files; return (box, frame), frame 0 by default."""
    from irsim.types import Box

    numbers, at, frame = text.partition("@")
    try:
        x, y, w, h = (float(number) for number in numbers.split(","))
        index = int(frame) if at else 0
    except ValueError:
        raise InputError(
            f"--init {text}: not a start box; allowed: X,Y,W,H or X,Y,W,H@FRAME, "
            "the box's top-left pixel, its width and height in px, such as 80,55,14,10@3"
        ) from None
    if not all(map(isfinite, (x, y, w, h))) or w <= 0 or h <= 0 or index < 0:
        raise InputError(f"--init {text}: allowed: finite numbers, width and height above 0, frame 0 or later")
    return Box.from_pixels(x, y, w, h), index


@dataclass(frozen=True)
class Settings:
    """KEY=VALUE settings: those of the tracker, parsed as YAML, and the scenario's overrides as text."""

    tracker: dict[str, Any]
    scenario: tuple[str, ...]


def split_settings(
    words: Iterable[str], tracker: type[Any], scenario_keys: Iterable[str], given: Mapping[str, Any] | None = None
) -> Settings:
    """Divide KEY=VALUE settings between tracker and scenario; `given`: parameters already set after the tracker's name.

    A key that is a parameter of the tracker goes to the tracker. Else a top-level key of the scenario (a recording has
    none), or a key with a dot, goes to the scenario. InputError for any other key, unless the tracker takes any key,
    and for a parameter given twice.
    """
    from irsim import scalar
    from irsim.config.base import suggestion

    names, takes_any = parameters(tracker)
    top = list(scenario_keys)
    for_tracker: dict[str, Any] = dict(given or {})
    for_scenario: list[str] = []
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or not key:
            raise InputError(f"{word}: not a setting; allowed: KEY=VALUE, such as camera.netd_mk=80")
        if key in for_tracker:
            raise InputError(f"{word}: the parameter '{key}' is given twice; allowed: once")
        if key in names:
            for_tracker[key] = scalar(value)
        elif key in top or "." in key:
            for_scenario.append(word)
        elif takes_any:
            for_tracker[key] = scalar(value)
        else:
            scenarios = f"; the scenario's {', '.join(top)}, and paths such as camera.netd_mk" if top else ""
            raise InputError(
                f"{key}: no such setting; allowed: the tracker's {', '.join(names) or '(it has none)'}{scenarios}"
                + suggestion(key, [*names, *top])
            )
    return Settings(for_tracker, tuple(for_scenario))


def parameters(tracker: type[Any]) -> tuple[list[str], bool]:
    """Return (names of a tracker class's parameters, True where it accepts others)."""
    try:
        given = inspect.signature(tracker).parameters.values()
    except (TypeError, ValueError):  # a class of an extension module may hide its parameters
        return [], True
    from irtrack.registry.table import takes_detector
    from irtrack.trackers.many_adapters import is_plain_many, takes_detections

    named = [each.name for each in given if each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY)]
    if is_plain_many(tracker) and takes_detections(tracker) and "detector" not in named:
        named.append("detector")  # a parameter of the tracker's adapter
    if isinstance(tracker, type) and takes_detector(tracker):
        named.append("detections")
    return named, any(each.kind is each.VAR_KEYWORD for each in given)
