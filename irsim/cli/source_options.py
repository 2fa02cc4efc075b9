"""What several commands ask of a source: its scenario's changes and seed, and parts that are off."""

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
    str, typer.Argument(metavar="SCENARIO|REC", help="A scenario's file or name, or a recording.")
]
OverridesArgument = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="KEY=VALUE",
        help="Changes to the scenario: camera.netd_mk=80, targets.jet.path.speed=3 (list items by id).",
    ),
]
SeedOption = Annotated[int | None, typer.Option(metavar="N", help="Seed of the scene.")]
WithoutOption = Annotated[
    str | None,
    typer.Option(metavar="NAME,...", help="Switch these parts off as well; nothing else changes."),
]


def open_changed(source: str, overrides: list[str] | None, seed: int | None, without: str | None) -> Source:
    """A scenario so changed, or a recording, which can only be opened as it is."""
    from irsim.render.sources import open_source

    opened = open_source(source, overrides or (), seed, parts(without))
    tell_unheeded(source, overrides, without)
    return opened


def tell_unheeded(source: str, overrides: list[str] | None, without: str | None = None) -> None:
    """Warn on standard error of each override that counts for nothing, with these parts switched off."""
    from irsim.lint.warnings import unheeded

    for warning in unheeded(source, overrides or (), parts(without)):
        print(warning, file=sys.stderr)


@contextmanager
def from_option(option: str, parameter: str) -> Iterator[None]:
    """What the library says is wrong with a parameter, "like 'x': ...", is so of the option that it came from."""
    try:
        yield
    except InputError as error:
        place, text = f"{parameter} ", str(error)
        if not text.startswith(place):
            raise
        raise InputError(f"{option} {text.removeprefix(place)}") from None


def parts(without: str | None) -> list[str]:
    """'near, far' is ['near', 'far']. InputError where a name is empty: some variable of a script may be."""
    names = [] if without is None else [name.strip() for name in without.split(",")]
    if not all(names):
        raise InputError(f"--without {without!r}: a name is empty; allowed: names with commas between them")
    return names
