"""The commands of irsim that measure recordings; the command line itself is `irsim.cli`."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.asked import OverridesArgument, SeedOption, WithoutOption, from_option, open_changed
from irsim.errors import InputError
from irsim.span import parsed
from irsim.terminal import given_path, in_options, progress_bar

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from irsim.measure import Figures, Judged, Region, Texture, Verdict
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
    from irsim.measure import PICTURES, measure_noise, noise_lines, taken_by_targets

    opened = open_changed(source, overrides, seed, without)
    where = _region(region, opened.size)
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
        print(f"{label:8} {in_options(text)}")
    if opened.bits <= 8:
        print(f"{'note':8} {PICTURES}")


def fit(
    source: Measured,
    overrides: OverridesArgument = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="YAML", help="The scenario to write; default: standard output.", parser=given_path
        ),
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
    from irsim.fitting import check_replaced, fit_frames, open_pictures
    from irsim.loader import find

    opened = open_changed(source, overrides, seed, without)
    try:
        shown = None if display is None else find(display)
    except InputError:
        raise InputError(
            f"--display {display}: there is no such file or folder; allowed: what the camera showed, a folder of PNG, "
            "a video or a recording"
        ) from None
    check_output(output, find(source), shown, endings=(".yaml", ".yml"))
    check_replaced(output)
    where = _region(region, opened.size)
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
            file.write(in_options(found.text))
    if as_json:
        print(in_options(json.dumps(found.as_json())))
    elif output is None:
        print(in_options(found.text), end="")
    else:
        for note in found.notes:
            print(f"irsim: note: {in_options(note)}", file=sys.stderr)
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
    from irsim.measure import check_class, check_sort

    if like is not None:
        with from_option("--like", "like"):
            check_class(like)
    if camera is not None:
        with from_option("--camera", "like"):
            check_sort(camera)
    opened = open_changed(source, overrides, seed, without)
    found = _compared(opened, source, like or _claim(opened), camera)
    unknown = found.noise_unknown
    if not as_json:
        for line in _realism_lines(found, camera is not None):
            print(line)
    if unknown is not None and camera is not None:
        raise InputError(f"{source}: {unknown}")
    if as_json:
        print(json.dumps({"source": source, **_realism_json(found)}))
    if not all(verdict.inside for verdict in found.verdicts):
        sys.exit(1)


@dataclass(frozen=True)
class _Compared:
    """Texture and noise beside real ones: texture None where it is not asked for, noise a line where it is unknown."""

    texture: Texture | None
    classes: Judged | None
    noise: dict[str, float]
    sorts: Judged | str

    @property
    def noise_unknown(self) -> str | None:
        return self.sorts if isinstance(self.sorts, str) else None

    @property
    def judged(self) -> tuple[Judged, ...]:
        return tuple(each for each in (self.classes, self.sorts) if each is not None and not isinstance(each, str))

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        return tuple(verdict for each in self.judged for verdict in each.verdicts)


def _compared(opened: Source, name: str, like: str | None, camera: str | None) -> _Compared:
    from irsim.measure import backdrops, judge_classes, judge_sorts, noise_figures, texture

    found, classes = None, None
    if camera is None or like is not None:
        try:
            found = texture(backdrops(opened, _PICTURES))
        except InputError as error:
            raise InputError(f"{name}: {error}") from None
        classes = judge_classes(found, like)
    noise = _noise_to_judge(opened, camera is not None)
    if isinstance(noise, str):
        return _Compared(found, classes, {}, noise)
    values = {figure: value.value for figure, value in noise_figures(noise).items()}
    return _Compared(found, classes, values, judge_sorts(noise, camera))


def _realism_lines(found: _Compared, asked: bool) -> Iterator[str]:
    """For people; why noise is unknown only where it was not `asked` for, for then it is an error."""
    if found.classes is not None:
        yield from found.classes.lines("looks like", "no class of real recordings")
    if not isinstance(found.sorts, str):
        yield from found.sorts.lines("its noise is like", "that of no real camera")
    elif not asked:
        yield found.sorts


def _realism_json(found: _Compared) -> dict[str, Any]:
    told: dict[str, Any] = {}
    if found.texture is not None and found.classes is not None:
        told = {**asdict(found.texture), "like": found.classes.asked, "classes": found.classes.fitting}
    if isinstance(found.sorts, str):
        told["noise_unknown"] = found.sorts
    else:
        told |= {"camera": found.sorts.asked, **found.noise, "cameras": found.sorts.fitting}
    kept = {name: verdicts for each in found.judged for name, verdicts in each.apart.items()}
    outside = {name: [verdict.figure for verdict in verdicts] for name, verdicts in kept.items()}
    ranges = {v.figure: {"low": v.low, "high": v.high, "inside": v.inside} for v in found.verdicts}
    return {**told, "outside": outside, "ranges": ranges}


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


def _region(text: str | None, size: tuple[int, int]) -> Region | None:
    """Where noise is to be read; None for the flattest window."""
    from irsim.measure import parse_region

    with from_option("--region", "region"):
        return None if text is None else parse_region(text, size)


def _wanted(frames: str | None, source: Source) -> range:
    """Numbers of the frames to look at: those that are asked for, or else the first ones."""
    from irsim.measure import FRAMES

    return range(min(FRAMES, len(source))) if frames is None else parsed(frames, len(source))
