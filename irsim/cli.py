"""The command line of irsim. What takes time to import is imported inside the commands: `--help` must not wait."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from irsim import commands_authoring, commands_info, commands_measure
from irsim.asked import (
    OverridesArgument,
    SeedOption,
    SourceArgument,
    WithoutOption,
    from_option,
    open_changed,
    parts,
    tell_unheeded,
)
from irsim.errors import InputError
from irsim.files import check_output, is_recording, is_there
from irsim.span import parsed
from irsim.terminal import StoppedError, commands, given_path, in_options, progress_bar, run
from irsim.wording import counted

if TYPE_CHECKING:
    from irsim.display import Agc

app = commands("Render infrared scenes from YAML, record frames with exact truth, import real ones.")

RecordingOption = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="REC", help="The recording to write.", parser=given_path)
]


def main() -> None:
    """The command `irsim`."""
    run(app, "irsim")


app.command()(commands_info.info)
app.command()(commands_measure.noise)
app.command()(commands_measure.fit)
app.command()(commands_measure.realism)
app.command()(commands_authoring.new)
app.command()(commands_authoring.schema)
app.command()(commands_authoring.sample)


@app.command()
def check(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO|KEY=VALUE", help="Scenario files or shipped names, and changes to all of them."
        ),
    ],
    without: WithoutOption = None,
) -> None:
    """Check scenarios: each is ok, or a line for each thing that is wrong, with its place; doubts are warnings."""
    from irsim.loader import warnings
    from irsim.sources import switched_off, unheeded

    changes = [word for word in words if "=" in word and not is_there(word)]
    scenarios = [word for word in words if word not in changes]
    if not scenarios:
        raise InputError(f"{changes[0]}: nothing to change; allowed: a scenario's file or name beside it")
    wrong = 0
    for scenario in scenarios:
        try:
            with progress_bar(f"check {scenario}") as progress:
                told = warnings(scenario, [*changes, *switched_off(scenario, changes, parts(without))], progress)
                told += [line for line in unheeded(scenario, changes, parts(without)) if line not in told]
        except InputError as error:
            wrong += 1
            # As `FILE:LINE:COLUMN: ...`, without a prefix, so that editors can jump there.
            own = len(scenarios) == 1 or Path(scenario).stem in str(error)
            print(in_options(str(error) if own else f"{scenario}: {error}"), file=sys.stderr)
        else:
            sys.stderr.writelines(f"{in_options(line)}\n" for line in told)
            print(f"{scenario}: ok")
    if wrong:
        sys.exit(2)


@app.command()
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
    from irsim.draw import contact_sheet
    from irsim.loader import find
    from irsim.moving import moving_picture

    opened = open_changed(source, overrides, seed, without)
    path = output or Path(f"{opened.name}.png")
    check_output(path, find(source), endings=(".png", ".webm", ".gif"))
    wanted = range(len(opened)) if frames is None else parsed(frames, len(opened))
    if path.suffix.lower() == ".png":
        print(contact_sheet(opened, path, wanted.start, wanted.stop))
    else:
        with progress_bar(f"show {opened.name}", len(wanted)) as progress:
            print(moving_picture(opened, path, wanted.start, wanted.stop, progress))


@app.command()
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
    from irsim.gallery import write_blind
    from irsim.kinds import suggestion
    from irsim.sheets import SHEETS

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


@app.command()
def render(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    output: RecordingOption = None,
    seed: SeedOption = None,
    frames: Annotated[
        str | None,
        typer.Option(
            metavar="N|A:B",
            help="N frames from the first on, or frames A to B-1; a scenario goes on beyond its own number.",
        ),
    ] = None,
    jobs: Annotated[int, typer.Option(metavar="N", min=1, help="Processes that render.")] = 1,
    without: WithoutOption = None,
) -> None:
    """Render a scenario, or a recording again by the scenario in it, into a recording (default: NAME.mcap here)."""
    from irsim.loader import find
    from irsim.recording import check_default, record
    from irsim.sources import open_rendering

    wanted = None if frames is None else parsed(frames)
    asked = None if wanted is None else (wanted.start, wanted.stop)
    rendering, start, stop = open_rendering(source, overrides or (), seed, asked, parts(without))
    tell_unheeded(source, overrides, without)
    path = output or Path(f"{Path(source).stem}.mcap")
    check_output(path, find(source), endings=(".mcap",))
    if output is None:
        check_default(path)
    with progress_bar(f"render {rendering.name}", stop - start) as progress:
        record(rendering, path, start, stop, jobs, progress)
    _say_written(path)


@app.command()
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
    from irsim.masking import write_masks
    from irsim.sources import open_rendering

    rendering, first, stop = open_rendering(source, overrides or (), seed, without=parts(without))
    tell_unheeded(source, overrides, without)
    wanted = parsed(frames, stop - first) if frames is not None else range(stop - first)
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


@app.command("import")
def import_(
    frames: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER|TIFF|VIDEO",
            help="A folder of PNG or TIFF files, a TIFF of several pages, or a video.",
            parser=given_path,
        ),
    ],
    truth: Annotated[
        Path | None,
        typer.Option(
            metavar="CSV",
            help="Truth as frame,x,y,w,h[,id,cls]: top-left pixel; blank where absent.",
            parser=given_path,
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="Frames a second; default: the video's, or 30.")
    ] = None,
    bits: Annotated[
        int | None, typer.Option(metavar="N", help="True depth of 16-bit pictures, such as 12 or 14; default: 16.")
    ] = None,
    accuracy: Annotated[
        float | None, typer.Option(metavar="PX", help="How far the truth's centres may be off; default: 1.")
    ] = None,
    follow: Annotated[
        str | None, typer.Option(metavar="ID", help="Whom trackers follow; default: the first in the truth.")
    ] = None,
    agc: Annotated[
        str | None,
        typer.Option(
            metavar="KIND|{...}",
            help="How counts become the 8-bit picture, as camera.agc says it in a scenario: plateau, or "
            "{kind: plateau, time_constant_frames: 10}; default: none for 8 bits, linear for more.",
        ),
    ] = None,
    output: RecordingOption = None,
) -> None:
    """Import real frames into a recording (default: NAME.mcap in this folder)."""
    from irsim.convert import import_frames, name_of
    from irsim.recording import open_recording

    shown = None if agc is None else _agc(agc)
    path = output or Path(f"{name_of(frames)}.mcap")
    if output is None and is_recording(frames) and path.resolve() == frames.resolve():
        raise InputError(
            f"{frames}: would replace {frames}, a recording; allowed: irsim import {shlex.quote(str(frames))} "
            "-o NEW.mcap, which keeps what is whole of it"
        )
    check_output(path, frames, truth, endings=(".mcap",))
    with progress_bar(f"import {frames.name}") as progress:
        import_frames(
            *(frames, path, truth, rate), agc=shown, bits=bits, accuracy_px=accuracy, follow=follow, progress=progress
        )
    for note in open_recording(path).contents.notes:
        print(f"irsim: note: {note}", file=sys.stderr)
    _say_written(path)


def _agc(text: str) -> Agc:
    """'plateau' or '{kind: plateau, gain_limit: 1}' as an AGC."""
    from irsim.display import Shown
    from irsim.loader import build
    from irsim.yamlfile import scalar

    try:
        value = scalar(text)
    except InputError as error:
        raise InputError(f"--agc: {error}") from None
    return build(Shown, {"agc": {"kind": value} if isinstance(value, str) else value}, "import").agc


def _say_written(path: Path) -> None:
    print(path)
    print(f"look at it: irsim show {shlex.quote(str(path))}, or open it in Foxglove or Lichtblick")
