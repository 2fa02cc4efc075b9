"""The commands of irsim that measure recordings; the command line itself is `irsim.cli.app`."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from irsim.cli.source_options import OverridesArgument, SeedOption, WithoutOption, from_option, open_changed
from irsim.cli.terminal import given_path, in_options, progress_bar
from irsim.errors import InputError
from irsim.frame_range import parsed

if TYPE_CHECKING:
    from irsim.fitting import Fit
    from irsim.measure import Region, Timed
    from irsim.types import Source

Measured = Annotated[
    str, typer.Argument(metavar="SCENARIO|REC", help="A recording, or a scenario, which is rendered for it.")
]
Frames = Annotated[
    str | None, typer.Option(metavar="N|A:B", help="The first N frames, or frames A to B-1; default: the first 300.")
]
RegionOption = Annotated[
    str | None,
    typer.Option(metavar="X,Y,W,H", help="Where only noise is seen, px; default: the flattest window that is still."),
]
Json = Annotated[bool, typer.Option("--json", help="One JSON document instead of lines.")]


def noise(
    source: Measured,
    overrides: OverridesArgument = None,
    region: RegionOption = None,
    frames: Frames = None,
    as_json: Json = False,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Measure noise on a flat region: 3-D noise, memory in time, drift, bad pixels, with 95 % intervals."""
    from irsim.measure import EIGHT_BITS, measure_noise, noise_lines, perhaps_pictures, taken_by_targets

    opened = open_changed(source, overrides, seed, without)
    where = _region(region, opened.size)
    wanted = _wanted(frames, opened)
    stack, times = _read(opened, wanted)
    with _told_of(source):
        taken = taken_by_targets(opened, wanted.start, wanted.stop)
        report = measure_noise(stack, opened.rate_hz, where, 2.0**opened.bits - 1, taken, times, wanted.start)
    if as_json:
        print(json.dumps({"source": source, "start": wanted.start, **report.as_json()}))
        return
    for label, text in noise_lines(report, wanted.start):
        print(f"{label:8} {in_options(text)}")
    if perhaps_pictures(opened):
        print(f"{'note':8} {EIGHT_BITS}")


def fit(
    source: Measured,
    overrides: OverridesArgument = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="YAML", help="The scenario to write; default: standard output.", parser=given_path
        ),
    ] = None,
    region: RegionOption = None,
    frames: Frames = None,
    as_json: Json = False,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Fit a camera and a background to a recording: a scenario that has them, its figures with 95 %
    intervals."""
    from irsim.config.files import check_output
    from irsim.fitting import check_replaced
    from irsim.scenario.loader import find

    opened = open_changed(source, overrides, seed, without)
    check_output(output, find(source), endings=(".yaml", ".yml"))
    check_replaced(output)
    where, wanted = _region(region, opened.size), _wanted(frames, opened)
    _tell_fit(_fitted(source, opened, where, wanted), output, as_json)


def realism(
    source: Measured,
    overrides: OverridesArgument = None,
    like: Annotated[
        str | None,
        typer.Option(
            metavar="CLASS", help="Status 1 where it is outside the ranges; default: what its scenario claims."
        ),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            metavar="SORT",
            help="Judge noise by this sort: cooled, uncorrected, uncooled; texture only by a class that --like or the "
            "scenario says. Status 1 where outside.",
        ),
    ] = None,
    as_json: Json = False,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Compare a background's texture, and a camera's noise, with real recordings: cloud, trees, ground and so on."""
    from irsim.measure import check_class, check_sort, measure_realism

    if like is not None:
        with from_option("--like", "like"):
            check_class(like)
    if camera is not None:
        with from_option("--camera", "camera"):
            check_sort(camera)
    opened = open_changed(source, overrides, seed, without)
    with progress_bar(f"read {opened.name}") as progress, _told_of(source):
        found = measure_realism(opened, like or _claim(opened), camera, progress)
    if as_json:
        print(json.dumps({"source": source, **found.as_json()}))
    else:
        for line in found.lines():
            print(line)
        if found.noise_unknown is not None:
            print(found.noise_unknown)
    if not found.inside:
        sys.exit(1)


@contextmanager
def _told_of(source: str) -> Iterator[None]:
    """What is wrong with a source is told with its name: of a damaged file the room that reads it does so."""
    try:
        yield
    except InputError as error:
        if str(error).startswith((f"{source}: ", f"{Path(source)}: ")):
            raise
        raise InputError(f"{source}: {error}") from None


def _fitted(source: str, opened: Source, where: Region | None, wanted: range) -> Fit:
    """Fit the wanted frames, with a progress bar."""
    from irsim.fitting import fit_frames

    read = _read(opened, wanted)
    with _told_of(source):
        return fit_frames(read, opened, where, wanted.start)


def _tell_fit(found: Fit, output: Path | None, as_json: bool) -> None:
    """Write the scenario, and say what it holds; print it where it is not written."""
    from irsim.config.files import replacing_text
    from irsim.fitting import sealed

    scenario, notes = sealed(in_options(found.text)), list(map(in_options, found.notes))
    if output is not None:
        with replacing_text(output) as file:
            file.write(scenario)
    if as_json:
        print(json.dumps({**found.as_json(), "notes": notes}))
    elif output is None:
        print(scenario, end="")
    else:
        for note in notes:
            print(f"irsim: note: {note}", file=sys.stderr)
        for label, text in found.summary():
            print(f"{label:8} {text}")
        print(output)
        print(f"render it: irsim render {shlex.quote(str(output))}")


def _claim(source: Source) -> str | None:
    """The class that a source's scenario claims to be like."""
    from irsim.stated import stated

    like: str | None = stated(source).get("like")
    return like


def _read(source: Source, wanted: range) -> Timed:
    """The wanted frames, with a progress bar."""
    from irsim.measure import read_timed

    with progress_bar(f"read {source.name}", len(wanted)) as progress:
        return read_timed(source, wanted, progress)


def _region(text: str | None, size: tuple[int, int]) -> Region | None:
    """Where noise is to be read; None for the flattest window."""
    from irsim.measure import parse_region

    with from_option("--region", "region"):
        return None if text is None else parse_region(text, size)


def _wanted(frames: str | None, source: Source) -> range:
    """Numbers of the frames to look at: those that are asked for, or else the first ones."""
    from irsim.measure import FRAMES

    return range(min(FRAMES, len(source))) if frames is None else parsed(frames, len(source))
