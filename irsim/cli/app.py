"""Command `irsim` with its sub-commands, of which check, render and import are defined here.

Modules that are slow to import are imported inside the commands, so that `--help` takes only 0.1 s.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from irsim.cli.authoring import new, sample, schema
from irsim.cli.bounds import bounds
from irsim.cli.export import export
from irsim.cli.info import info
from irsim.cli.live import live
from irsim.cli.measure import fit, noise, realism
from irsim.cli.pictures import gallery, masks, show
from irsim.cli.recordings import recover, verify
from irsim.cli.source_options import (
    OverridesArgument,
    SeedOption,
    SourceArgument,
    WithoutOption,
    from_option,
    part_names,
    warn_unheeded,
)
from irsim.cli.terminal import commands, given_path, in_options, progress_bar, run
from irsim.config.paths import is_recording, is_there
from irsim.errors import InputError, parse_frame_range

if TYPE_CHECKING:
    from irsim.camera.agc import Agc

app = commands("Render infrared scenes from YAML, record frames with exact truth, import real ones.")

RecordingOption = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="REC",
        help="Recording to write; default: NAME.mcap in this folder.",
        parser=given_path,
    ),
]
CompressionOption = Annotated[
    str,
    typer.Option(
        metavar="none|lz4|zstd|archive",
        help="Lossless compression of the recording; archive: the smallest, with images as JPEG XL.",
    ),
]


def main() -> None:
    """Run the command `irsim`."""
    run(app, "irsim")


def check(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO|KEY=VALUE",
            help="Scenario files or shipped scenarios' names; overrides of all of them.",
        ),
    ],
    without: WithoutOption = None,
) -> None:
    """Check scenarios: ok, or a line with its place for each error.

    Doubtful values are printed as warnings; status 2 where there is an error.
    """
    from irsim.lint.warnings import unheeded, warnings
    from irsim.render.sources import draw_own_kinds, switched_off

    overrides = [word for word in words if "=" in word and not is_there(word)]
    scenarios = [word for word in words if word not in overrides]
    if not scenarios:
        raise InputError(f"{overrides[0]}: no scenario to override; allowed: a scenario's file or name beside it")
    off, failed = part_names(without), False
    for scenario in scenarios:
        try:
            with progress_bar(f"check {scenario}") as progress:
                lines = warnings(scenario, [*overrides, *switched_off(scenario, overrides, off)], progress)
                lines += [line for line in unheeded(scenario, overrides, off) if line not in lines]
                draw_own_kinds(scenario, overrides, off)
        except InputError as error:
            failed = True
            # Without the prefix `irsim: `, so that editors find FILE:LINE:COLUMN.
            named = len(scenarios) == 1 or Path(scenario).stem in str(error)
            print(in_options(str(error) if named else f"{scenario}: {error}"), file=sys.stderr)
        else:
            sys.stderr.writelines(f"{in_options(line)}\n" for line in lines)
            print(f"{scenario}: ok")
    if failed:
        sys.exit(2)


def render(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    output: RecordingOption = None,
    seed: SeedOption = None,
    frames: Annotated[
        str | None,
        typer.Option(
            metavar="N|A:B",
            help="The first N frames, or frames A to B-1, also beyond the scenario's last; default: all.",
        ),
    ] = None,
    jobs: Annotated[int, typer.Option(metavar="N", min=1, help="Number of processes that render.")] = 1,
    with_bounds: Annotated[
        bool, typer.Option("--bounds", help="Add Cramer-Rao bounds of target positions, /truth/bounds.")
    ] = False,
    without: WithoutOption = None,
    compression: CompressionOption = "none",
) -> None:
    """Render a scenario, or that of a recording again, to a recording."""
    from irsim.recording import check_default_output, record
    from irsim.recording.output import check_output
    from irsim.render.sources import open_rendering
    from irsim.scenario.catalog import find

    wanted = None if frames is None else parse_frame_range(frames)
    given = None if wanted is None else (wanted.start, wanted.stop)
    rendering, start, stop = open_rendering(source, overrides or (), seed, given, part_names(without))
    warn_unheeded(source, overrides, without)
    path = output or Path(f"{Path(source).stem}.mcap")
    check_output(path, find(source), endings=(".mcap",))
    if output is None:
        check_default_output(path)
    of_frame = None
    if with_bounds:
        from irsim.render.bounds import FrameBounds

        of_frame = FrameBounds(rendering.scenario).of
    label = f"render {rendering.name}"
    with from_option("--compression", "compression"), progress_bar(label, stop - start) as progress:
        record(rendering, path, start, stop, jobs, progress, compression, of_frame)  # type: ignore[arg-type]  # checked there
    _print_written(path)


def import_(
    frames: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER|TIFF|NPY|VIDEO|BAG|MCAP|RAW",
            help="Folder of PNG, TIFF or JPEG files, TIFF of several pages, .npy or .npz array of frames, video, "
            "ROS 2 bag, MCAP file, or raw file with a layout.",
            parser=given_path,
        ),
    ],
    truth: Annotated[
        Path | None,
        typer.Option(
            metavar="LABELS",
            help="Ground truth: CSV frame,x,y,w,h[,id,cls], or labels in a format of --truth-format.",
            parser=given_path,
        ),
    ] = None,
    truth_format: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="csv, mot, vot, coco, yolo, voc, anti-uav, sirst or ros2; default: recognised from the labels.",
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="Frame rate, Hz; default: the video's, or 30.")
    ] = None,
    bits: Annotated[
        int | None,
        typer.Option(metavar="N", help="Bit depth of counts stored as 16 bits, such as 12 or 14; default: 16."),
    ] = None,
    accuracy: Annotated[
        float | None, typer.Option(metavar="PX", help="Error of the truth's centres, px; default: 1.")
    ] = None,
    follow: Annotated[
        str | None, typer.Option(metavar="ID", help="Id of the target to track; default: the first in the truth.")
    ] = None,
    agc: Annotated[
        str | None,
        typer.Option(
            metavar="KIND|{...}",
            help="AGC of the 8-bit display, as under camera.agc: plateau, or "
            "{kind: plateau, time_constant_frames: 10}; default: none for 8 bits, linear for more.",
        ),
    ] = None,
    topic: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Topic of the images in a bag or MCAP file; default: the only one."),
    ] = None,
    layout: Annotated[
        str | None,
        typer.Option(
            metavar="ROWS,COLUMNS,TYPE...",
            help="Layout of a raw file: TYPE is uint8, uint16 or uint16be; then ,header=BYTES before the first frame "
            "and ,gap=BYTES before each.",
        ),
    ] = None,
    compression: CompressionOption = "none",
    output: RecordingOption = None,
) -> None:
    """Import real frames, with their ground truth, to a recording.

    A damaged recording is accepted, too: its intact frames are written to a new one.
    """
    from irsim.recording import open_recording
    from irsim.recording.image_topics import has_topics
    from irsim.recording.importers import import_frames, name_of
    from irsim.recording.output import check_output

    chosen = None if agc is None else _agc(agc)
    path = output or Path(f"{name_of(frames)}.mcap")
    if output is None and is_recording(frames) and path.resolve() == frames.resolve():
        recovers = "" if has_topics(frames) else ", which recovers its intact frames"
        raise InputError(
            f"{frames}: would replace {frames}, a recording; allowed: irsim import {shlex.quote(str(frames))} "
            f"-o NEW.mcap{recovers}"
        )
    check_output(path, frames, truth, endings=(".mcap",))
    packed = None if compression == "none" else compression
    with (
        from_option("--layout", "layout"),
        from_option("--compression", "compression"),
        progress_bar(f"import {frames.name}") as progress,
    ):
        import_frames(
            *(frames, path, truth, rate),
            agc=chosen,
            bits=bits,
            accuracy_px=accuracy,
            follow=follow,
            truth_format=truth_format,
            compression=packed,  # type: ignore[arg-type]  # checked there
            topic=topic,
            layout=layout,
            progress=progress,
        )
    for note in open_recording(path).contents.notes:
        print(f"irsim: note: {note}", file=sys.stderr)
    _print_written(path)


def _agc(text: str) -> Agc:
    """Return the AGC described by a text such as 'plateau' or '{kind: plateau, gain_limit: 1}'."""
    from irsim.camera import DisplaySettings
    from irsim.config.yaml_text import scalar
    from irsim.scenario.loader import build

    try:
        value = scalar(text)
    except InputError as error:
        raise InputError(f"--agc: {error}") from None
    return build(DisplaySettings, {"agc": {"kind": value} if isinstance(value, str) else value}, "import").agc


def _print_written(path: Path) -> None:
    print(path)
    print(f"show it: irsim show {shlex.quote(str(path))}, or open it in Foxglove or Lichtblick")


# In the order of `--help`: commands that write scenarios, show, render and measure.
_COMMANDS: dict[str, Callable[..., None]] = {
    "new": new,
    "check": check,
    "show": show,
    "render": render,
    "live": live,
    "info": info,
    "masks": masks,
    "bounds": bounds,
    "sample": sample,
    "import": import_,
    "export": export,
    "verify": verify,
    "recover": recover,
    "noise": noise,
    "fit": fit,
    "realism": realism,
    "gallery": gallery,
    "schema": schema,
}
for name, command in _COMMANDS.items():
    app.command(name)(command)
