"""Commands that draw: show (sheets and videos), gallery, masks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from irsim.cli.source_options import (
    FramesOption,
    OverridesArgument,
    SeedOption,
    SourceArgument,
    WithoutOption,
    from_option,
    open_changed,
    part_names,
    warn_unheeded,
)
from irsim.cli.terminal import StoppedError, given_path, progress_bar
from irsim.errors import InputError, counted, parse_frame_range


def show(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="PNG|WEBM|GIF",
            help="Sheet (.png) or video (.webm, .gif) to write; default: NAME.png in this folder.",
            parser=given_path,
        ),
    ] = None,
    frames: FramesOption = None,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Draw frames with truth boxes: a sheet (PNG) or a video (WebM, GIF)."""
    from irsim.cli.figures import contact_sheet
    from irsim.cli.video import write_video
    from irsim.recording.output import check_output
    from irsim.scenario.catalog import find

    opened = open_changed(source, overrides, seed, without)
    path = output or Path(f"{opened.name}.png")
    check_output(path, find(source), endings=(".png", ".webm", ".gif"))
    wanted = range(len(opened)) if frames is None else parse_frame_range(frames, len(opened))
    if path.suffix.lower() == ".png":
        print(contact_sheet(opened, path, wanted.start, wanted.stop))
    else:
        with progress_bar(f"show {opened.name}", len(wanted)) as progress:
            print(write_video(opened, path, wanted.start, wanted.stop, progress))


def gallery(
    sheet: Annotated[
        str, typer.Argument(metavar="[targets|backgrounds|cameras|agcs]", help="Which sheet; default: targets.")
    ] = "targets",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="PNG",
            help="Picture to write; default: named after the sheet, in this folder.",
            parser=given_path,
        ),
    ] = None,
) -> None:
    """Draw all target kinds, backgrounds, cameras or AGCs on a sheet."""
    from irsim.cli.gallery import SHEETS
    from irsim.config.base import suggestion
    from irsim.recording.output import check_output

    if sheet not in SHEETS:
        raise InputError(f"no sheet of '{sheet}'; allowed: {', '.join(SHEETS)}{suggestion(sheet, SHEETS)}")
    path = output or Path(f"{sheet}.png")
    check_output(path, endings=(".png",))
    print(SHEETS[sheet](path))


def masks(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Folder to write; default: NAME-masks in this folder.",
            parser=given_path,
        ),
    ] = None,
    frames: FramesOption = None,
    target: Annotated[
        str | None, typer.Option(metavar="ID", help="Masks of this target only; default: of all.")
    ] = None,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Write 8-bit PNG masks of each target: whole and its visible part.

    File names have the frame numbers of a recording; those of SCENARIO count only frames that arrive.
    """
    from irsim.render.masks import write_masks
    from irsim.render.sources import open_rendering

    rendering, first, stop = open_rendering(source, overrides or (), seed, without=part_names(without))
    warn_unheeded(source, overrides, without)
    wanted = parse_frame_range(frames, stop - first) if frames is not None else range(stop - first)
    start, stop = first + wanted.start, first + wanted.stop
    folder = output or Path(f"{Path(source).stem}-masks")
    count = done = 0
    try:
        with from_option("--target", "target"), progress_bar(f"masks {rendering.name}", stop - start) as progress:
            for done, paths in enumerate(write_masks(rendering.scenario, folder, start, stop, target, first), 1):
                count += len(paths)
                progress(done)
    except KeyboardInterrupt:
        if not done:
            raise
        written = f"masks of {done} of {counted(stop - start, 'frame')} are written to {folder}"
        raise StoppedError(f"stopped; {written}, and the same command replaces them") from None
    print(f"{folder}: {counted(count, 'mask')} of {counted(stop - start, 'frame')}")
