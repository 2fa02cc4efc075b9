"""The commands that draw what a scene or a recording shows: sheets, motion, galleries, masks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from irsim.cli.source_options import (
    OverridesArgument,
    SeedOption,
    SourceArgument,
    WithoutOption,
    from_option,
    open_changed,
    parts,
    tell_unheeded,
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
            help="Its ending says what to draw. Default: NAME.png here.",
            parser=given_path,
        ),
    ] = None,
    frames: Annotated[
        str | None, typer.Option(metavar="N|A:B", help="The first N frames, or frames A to B-1; default: all.")
    ] = None,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Draw a sheet of frames over time with their truth boxes (PNG), or the frames in motion (WebM, GIF)."""
    from irsim.cli.figures import contact_sheet
    from irsim.cli.video import moving_picture
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
            print(moving_picture(opened, path, wanted.start, wanted.stop, progress))


def gallery(
    what: Annotated[
        str, typer.Argument(metavar="[targets|backgrounds|cameras|agcs]", help="Of what; targets unless said.")
    ] = "targets",
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="PNG", help="Default: WHAT.png in this folder.", parser=given_path),
    ] = None,
    blind: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="A blind test instead: unlabelled crops in DIR, their key beside it.", parser=given_path
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the blind test's order and views.")] = 0,
) -> None:
    """Draw a sheet of all targets, each in several views, or of all backgrounds, cameras or AGCs."""
    from irsim.cli.gallery import write_blind
    from irsim.cli.sheets import SHEETS
    from irsim.config.base import suggestion
    from irsim.recording.output import check_output

    if what not in SHEETS:
        raise InputError(f"no sheet of '{what}'; allowed: {', '.join(SHEETS)}{suggestion(what, SHEETS)}")
    if blind is not None:
        if what != "targets":
            raise InputError(f"--blind: its crops are of targets, not of {what}; allowed: irsim gallery --blind DIR")
        print(write_blind(blind, seed))
        return
    path = output or Path(f"{what}.png")
    check_output(path, endings=(".png",))
    print(SHEETS[what](path))


def masks(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Default: NAME-masks in this folder.", parser=given_path),
    ] = None,
    frames: Annotated[
        str | None, typer.Option(metavar="N|A:B", help="N frames from the first on, or frames A to B-1.")
    ] = None,
    target: Annotated[str | None, typer.Option(metavar="ID", help="Of this target only.")] = None,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Write which pixels each target covers, whole and as far as it is seen, as PNG files of 8 bits.

    Files bear the numbers of the frames that arrive, as a recording of SCENARIO counts them, or of REC's own frames.
    """
    from irsim.render.masks import write_masks
    from irsim.render.sources import open_rendering

    rendering, first, stop = open_rendering(source, overrides or (), seed, without=parts(without))
    tell_unheeded(source, overrides, without)
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
        made = f"masks of {done} of {counted(stop - start, 'frame')} are written to {folder}"
        raise StoppedError(f"stopped; {made}, and the same command replaces them") from None
    print(f"{folder}: {counted(count, 'mask')} of {counted(stop - start, 'frame')}")
