"""Commands that measure frames: noise, fit, realism."""

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
from irsim.errors import InputError, parse_frame_range

if TYPE_CHECKING:
    from irsim.calibration.fit import Fit
    from irsim.calibration.patches import PatchGroup
    from irsim.calibration.selection import Region, TimedFrames
    from irsim.types import Source

SourceArgument = Annotated[str, typer.Argument(metavar="SCENARIO|REC", help="Recording, or scenario to render.")]
FramesOption = Annotated[
    str | None, typer.Option(metavar="N|A:B", help="The first N frames, or frames A to B-1; default: the first 300.")
]
RegionOption = Annotated[
    str | None,
    typer.Option(metavar="X,Y,W,H", help="Region of flat, still background, px; default: the flattest window."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document instead of lines.")]


def noise(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    region: RegionOption = None,
    frames: FramesOption = None,
    as_json: JsonOption = False,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Measure noise on a flat region, with 95 % intervals.

    The report has 3-D noise, correlation over time, drift and bad pixels.
    """
    from irsim.calibration.noise import measure_noise
    from irsim.calibration.report import noise_lines
    from irsim.calibration.selection import EIGHT_BITS, may_be_pictures, target_mask

    opened = open_changed(source, overrides, seed, without)
    where = _region(region, opened.size)
    wanted = _wanted(frames, opened)
    counts, times = _read(opened, wanted)
    with _named(source):
        taken = target_mask(opened, wanted.start, wanted.stop)
        report = measure_noise(counts, opened.rate_hz, where, 2.0**opened.bits - 1, taken, times, wanted.start)
    if as_json:
        print(json.dumps({"source": source, "start": wanted.start, **report.as_json()}))
        return
    for label, text in noise_lines(report, wanted.start):
        print(f"{label:8} {in_options(text)}")
    if may_be_pictures(opened):
        print(f"{'note':8} {EIGHT_BITS}")


def fit(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="YAML", help="Scenario to write; default: standard output.", parser=given_path
        ),
    ] = None,
    region: RegionOption = None,
    frames: FramesOption = None,
    as_json: JsonOption = False,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Fit a camera and a background and write them as a scenario.

    Each fitted value has a 95 % interval.
    """
    from irsim.calibration.fit import check_replaced, fit_frames
    from irsim.recording.output import check_output
    from irsim.scenario.catalog import find

    opened = open_changed(source, overrides, seed, without)
    check_output(output, find(source), endings=(".yaml", ".yml"))
    check_replaced(output)
    where, wanted = _region(region, opened.size), _wanted(frames, opened)
    read = _read(opened, wanted)
    with _named(source):
        found = fit_frames(read, opened, where, wanted.start)
    _write_fit(found, output, as_json)


def realism(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    like: Annotated[
        str | None,
        typer.Option(
            metavar="CLASS",
            help="Class of background to compare texture with (status 1: outside); default: the scenario's `like`.",
        ),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            metavar="SORT",
            help="Sort of camera to compare noise with (status 1: outside): cooled, uncorrected, uncooled. "
            "Texture is then judged only where --like or the scenario gives a class.",
        ),
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Real clips with places.csv: tell REC... from them by a classifier, in place of the fixed ranges.",
            parser=given_path,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="HTML", help="Page of --against, with example patches.", parser=given_path
        ),
    ] = None,
    region: Annotated[
        str | None,
        typer.Option(metavar="X,Y,W,H", help="Region of REC... that shows the class, for --against; default: all."),
    ] = None,
    as_json: JsonOption = False,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Compare texture and camera noise with those of real recordings.

    With --against FOLDER, more recordings or scenarios may follow the first.
    """
    from irsim.calibration.background_classes import check_class
    from irsim.calibration.realism import check_sort, measure_realism
    from irsim.calibration.selection import scenario_keys

    if against is not None:
        if camera is not None:
            raise InputError("--camera: compares with fixed ranges; allowed without --against only")
        more = [each for each in overrides or () if "=" not in each]
        changes = [each for each in overrides or () if "=" in each]
        _realism_against([source, *more], changes, against, like, region, output, as_json, seed, without)
        return
    for option, given in (("-o", output), ("--region", region)):
        if given is not None:
            raise InputError(f"{option}: allowed with --against FOLDER only")
    if like is not None:
        with from_option("--like", "like"):
            check_class(like)
    if camera is not None:
        with from_option("--camera", "camera"):
            check_sort(camera)
    opened = open_changed(source, overrides, seed, without)
    with progress_bar(f"read {opened.name}") as progress, _named(source):
        found = measure_realism(opened, like or scenario_keys(opened).get("like"), camera, progress)
    if as_json:
        print(json.dumps({"source": source, **found.as_json()}))
    else:
        for line in found.lines():
            print(line)
        if found.noise_unknown is not None:
            print(found.noise_unknown)
    if not found.inside:
        sys.exit(1)


def _realism_against(
    names: list[str],
    overrides: list[str],
    folder: Path,
    like: str | None,
    region: str | None,
    output: Path | None,
    as_json: bool,
    seed: int | None,
    without: str | None,
) -> None:
    """Print how surely pictures are told from real clips, and write the page."""
    from irsim.calibration.discriminator import check_learning
    from irsim.calibration.real_clips import is_clip_folder, read_clips
    from irsim.calibration.realism_against import against_lines, realism_against
    from irsim.calibration.realism_page import realism_page
    from irsim.recording.output import atomic_text, check_output

    check_learning()
    check_output(output, endings=(".html",))
    with progress_bar(f"read {folder}") as progress:
        real = read_clips(folder, progress)
    rendered: dict[str, list[PatchGroup]] = {}
    for name in names:
        if is_clip_folder(name):
            with progress_bar(f"read {name}") as progress:
                groups = read_clips(Path(name), progress)
            if like is not None and like not in groups:
                raise InputError(f"--like {like!r}: {name} has no clip of it; allowed: {', '.join(sorted(groups))}")
            for background in groups if like is None else [like]:
                rendered.setdefault(background, []).extend(groups[background])
            continue
        background, scenes = _scenes(open_changed(name, overrides, seed, without), name, like, region)
        rendered.setdefault(background, []).extend(scenes)
    with progress_bar("tell apart") as progress:
        found = realism_against(rendered, real, progress)
    if output is not None:
        with atomic_text(output) as file:
            file.write(realism_page(found, f"{', '.join(Path(name).name for name in names)} beside {folder.name}"))
    if as_json:
        print(json.dumps({"against": str(folder), "classes": {each.background: each.as_json() for each in found}}))
        return
    for line in against_lines(found):
        print(line)
    if output is not None:
        print(output)


def _scenes(source: Source, name: str, like: str | None, region: str | None) -> tuple[str, list[PatchGroup]]:
    """Return the class of background of a source and its patches: of a scenario those of four seeds."""
    from irsim.calibration.patches import SCENES, source_patches
    from irsim.calibration.selection import scenario_keys
    from irsim.render.stream import Rendering

    background = like or scenario_keys(source).get("like")
    if not isinstance(background, str):
        raise InputError(f"{name}: states no class of background; allowed: --like CLASS, or like: in the scenario")
    where = _region(region, source.size)
    sources = [source]
    if isinstance(source, Rendering):
        sources = [source.with_seed(source.seed + k) for k in range(SCENES)]
    with progress_bar(f"read {source.name}", len(sources)) as progress:
        groups = []
        for done, each in enumerate(sources, start=1):
            groups.append(source_patches(each, name if len(sources) == 1 else f"{name} seed {each.seed}", where))
            progress(done, len(sources))
    return background, groups


@contextmanager
def _named(source: str) -> Iterator[None]:
    """Put the name of the source before the message of an InputError, unless the message begins with it."""
    try:
        yield
    except InputError as error:
        if str(error).startswith((f"{source}: ", f"{Path(source)}: ")):
            raise
        raise InputError(f"{source}: {error}") from None


def _write_fit(found: Fit, output: Path | None, as_json: bool) -> None:
    """Write the fitted scenario to a file and its figures to the screen, or else the scenario to the screen."""
    from irsim.calibration.fit import sealed
    from irsim.recording.output import atomic_text

    scenario, notes = sealed(in_options(found.text)), list(map(in_options, found.notes))
    if output is not None:
        with atomic_text(output) as file:
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


def _read(source: Source, wanted: range) -> TimedFrames:
    from irsim.calibration.selection import read_frames

    with progress_bar(f"read {source.name}", len(wanted)) as progress:
        return read_frames(source, wanted, progress)


def _region(text: str | None, size: tuple[int, int]) -> Region | None:
    from irsim.calibration.selection import parse_region

    with from_option("--region", "region"):
        return None if text is None else parse_region(text, size)


def _wanted(frames: str | None, source: Source) -> range:
    from irsim.calibration.figures import FRAMES

    return range(min(FRAMES, len(source))) if frames is None else parse_frame_range(frames, len(source))
