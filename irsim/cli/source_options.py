"""Arguments and options of commands that take a scenario or a recording: overrides, seed, switched-off parts."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from irsim.errors import InputError

if TYPE_CHECKING:
    from irsim.types import Source

SourceArgument = Annotated[
    str, typer.Argument(metavar="SCENARIO|REC", help="Scenario file, shipped scenario's name, or recording.")
]
OverridesArgument = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="KEY=VALUE",
        help="Overrides of the scenario: camera.netd_mk=80, targets.jet.path.speed=3 (list items by id).",
    ),
]
SeedOption = Annotated[int | None, typer.Option(metavar="N", help="Seed of the scene; default: the scenario's.")]
FramesOption = Annotated[
    str | None, typer.Option(metavar="N|A:B", help="The first N frames, or frames A to B-1; default: all.")
]
WithoutOption = Annotated[
    str | None,
    typer.Option(metavar="NAME,...", help="Parts to switch off besides those of the scenario; all else is unchanged."),
]


def open_changed(source: str, overrides: list[str] | None, seed: int | None, without: str | None) -> Source:
    """Return a scenario with changes, or a recording, as a Source, and warn of overrides without effect."""
    from irsim.render.sources import open_source

    opened = open_source(source, overrides or (), seed, part_names(without))
    warn_unheeded(source, overrides, without)
    return opened


def warn_unheeded(source: str, overrides: list[str] | None, without: str | None = None) -> None:
    """Print a warning to standard error for each override that has no effect, given the parts switched off."""
    from irsim.lint.warnings import unheeded

    for warning in unheeded(source, overrides or (), part_names(without)):
        print(warning, file=sys.stderr)


@contextmanager
def from_option(option: str, parameter: str) -> Iterator[None]:
    """Replace the library's parameter by the command's option in an InputError that begins with the parameter."""
    try:
        yield
    except InputError as error:
        place, text = f"{parameter} ", str(error)
        if not text.startswith(place):
            raise
        raise InputError(f"{option} {text.removeprefix(place)}") from None


def part_names(without: str | None) -> list[str]:
    """Return the names in a text such as 'near, far'. InputError for an empty name, as of an unset shell variable."""
    names = [] if without is None else [name.strip() for name in without.split(",")]
    if not all(names):
        raise InputError(f"--without {without!r}: a name is empty; allowed: names separated by commas")
    return names
