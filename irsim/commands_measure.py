"""The commands of irsim that measure recordings; the command line itself is `irsim.cli`."""

from __future__ import annotations

import json
import shlex
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.asked import OverridesArgument, SeedOption, WithoutOption, open_changed
from irsim.errors import InputError
from irsim.span import parsed
from irsim.terminal import progress_bar

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from irsim.measure import Figures, Verdict
    from irsim.types import Input, Source

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

_NOISY = 120
"""Frames whose noise is compared with real cameras'."""
_PICTURES = 9
"""Pictures over the whole length whose texture is measured."""


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
    from irsim.measure import measure_noise, noise_lines, parse_region, taken_by_targets

    opened = open_changed(source, overrides, seed, without)
    where = None if region is None else parse_region(region, opened.size)
    wanted = _wanted(frames, opened)
    stack = read_stack(opened, wanted, "counts")
    try:
        taken = taken_by_targets(opened, wanted.start, wanted.stop)
        report = measure_noise(stack, opened.rate_hz, where, 2.0**opened.bits - 1, taken)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
    if as_json:
        print(json.dumps({"source": source, "start": wanted.start, **report.as_json()}))
        return
    for label, text in noise_lines(report, wanted.start):
        print(f"{label:8} {text}")


def fit(
    source: Measured,
    overrides: OverridesArgument = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="YAML", help="The scenario to write; default: standard output."),
    ] = None,
    display: Annotated[
        str | None,
        typer.Option(
            metavar="PICTURES",
            help="What the camera showed of the same frames: a folder of PNG, a video or a recording of 8 bits. The "
            "AGC is fitted to it.",
        ),
    ] = None,
    region: RegionOption = None,
    frames: Frames = None,
    as_json: Json = False,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Fit a camera and a background to a recording: a scenario that has them, its figures with 95 %
    intervals; of the display, how far each number may be turned before the pictures tell."""
    from irsim.displayed import FITS
    from irsim.files import check_output, replacing_text
    from irsim.fitting import fit_frames, open_pictures
    from irsim.loader import find
    from irsim.measure import parse_region

    opened = open_changed(source, overrides, seed, without)
    try:
        shown = None if display is None else find(display)
    except InputError:
        raise InputError(
            f"--display {display}: there is no such file or folder; allowed: what the camera showed, a folder of PNG, "
            "a video or a recording"
        ) from None
    check_output(output, find(source), shown, endings=(".yaml", ".yml"))
    where = None if region is None else parse_region(region, opened.size)
    wanted = _wanted(frames, opened)
    with open_pictures(display, opened) as pictures:
        stack = read_stack(opened, wanted, "counts")
        try:
            if pictures is None:
                found = fit_frames(stack, opened, where, wanted.start)
            else:
                with progress_bar("fit display", len(FITS)) as progress:
                    found = fit_frames(stack, opened, where, wanted.start, pictures, progress)
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
    if output is not None:
        with replacing_text(output) as file:
            file.write(found.text)
    if as_json:
        print(json.dumps(found.as_json()))
    elif output is None:
        print(found.text, end="")
    else:
        for note in found.notes:
            print(f"irsim: note: {note}", file=sys.stderr)
        for label, text in found.summary():
            print(f"{label:8} {text}")
        print(output)
        print(f"render it: irsim render {shlex.quote(str(output))}")


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
            metavar="SORT", help="Compare the noise, too: cooled, uncorrected, uncooled. Status 1 where outside."
        ),
    ] = None,
    as_json: Json = False,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Compare a background's texture, and a camera's noise, with real recordings: cloud, trees, ground and so on."""
    from irsim.measure import (
        backdrops,
        camera_lines,
        cameras_apart,
        check_sort,
        classes_apart,
        judge,
        judge_noise,
        noise_figures,
        texture,
        verdict_lines,
    )

    if camera is not None:
        check_sort(camera)
    opened = open_changed(source, overrides, seed, without)
    like = like or _claim(opened)
    told: dict[str, Any] = {"source": source}
    outside: dict[str, list[str]] = {}
    verdicts: tuple[Verdict, ...] = ()
    if camera is None or like is not None:
        try:
            found = texture(backdrops(opened, _PICTURES))
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
        verdicts = () if like is None else judge(found, like)
        classes = classes_apart(found)
        told |= {**asdict(found), "like": like, "classes": [name for name, kept in classes.items() if not kept]}
        outside |= {name: [verdict.figure for verdict in kept] for name, kept in classes.items() if kept}
        if not as_json:
            print(*verdict_lines(found, like), sep="\n")
    noise = _noise_to_judge(opened, camera is not None)
    if isinstance(noise, str):
        told["noise_unknown"] = noise
    else:
        verdicts += () if camera is None else judge_noise(noise, camera)
        sorts = cameras_apart(noise)
        told |= {"camera": camera, **{figure: value.value for figure, value in noise_figures(noise).items()}}
        told["cameras"] = [sort for sort, kept in sorts.items() if not kept]
        outside |= {sort: [verdict.figure for verdict in kept] for sort, kept in sorts.items() if kept}
        if not as_json:
            print(*camera_lines(noise, camera), sep="\n")
    if as_json:
        ranges = {v.figure: {"low": v.low, "high": v.high, "inside": v.inside} for v in verdicts}
        print(json.dumps({**told, "outside": outside, "ranges": ranges}))
    if isinstance(noise, str):
        if camera is not None:
            raise InputError(f"{source}: {noise}")
        if not as_json:
            print(noise)
    if not all(verdict.inside for verdict in verdicts):
        sys.exit(1)


def _noise_to_judge(source: Source, asked: bool) -> Figures | str:
    """Figures whose noise can be compared with real cameras', or in a line why there are none."""
    from irsim.measure import measure_figures, noise_figures, taken_by_targets

    if source.bits <= 8 and not asked:
        return "its noise is not judged, for pictures of 8 bits hold no sensor's; allowed: a sensor's counts"
    looked = range(min(_NOISY, len(source)))
    stack = read_stack(source, looked, "counts")
    taken = taken_by_targets(source, looked.start, looked.stop)
    try:
        found = measure_figures(stack, source.rate_hz, None, 2.0**source.bits - 1, taken, passing=asked)
        noise_figures(found)
    except InputError as error:
        return str(error)
    return found


def _claim(source: Source) -> str | None:
    """The class that a source's scenario claims to be like."""
    from irsim import yamlfile

    if source.scenario_text is None:
        return None
    like: str | None = yamlfile.parse(source.scenario_text, source.name).value.get("like")
    return like


def read_stack(source: Source, wanted: range, input: Input) -> npt.NDArray[np.integer]:
    """The wanted frames as one array (T, rows, columns), with a progress bar."""
    import numpy as np

    images = []
    with progress_bar(f"read {source.name}", len(wanted)) as progress:
        for frame in source.frames(input, wanted.start, wanted.stop):
            images.append(frame.image)
            if progress is not None:
                progress(len(images))
    return np.stack(images)


def _wanted(frames: str | None, source: Source) -> range:
    """Numbers of the frames to look at: those that are asked for, or else the first ones."""
    from irsim.measure import FRAMES

    return range(min(FRAMES, len(source))) if frames is None else parsed(frames, len(source))
