"""The command line of irsim. What takes time to import is imported inside the commands: `--help` must not wait."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from irsim.cli import authoring as commands_authoring
from irsim.cli import info as commands_info
from irsim.cli import measure as commands_measure
from irsim.cli import pictures as commands_pictures
from irsim.cli.source_options import (
    OverridesArgument,
    SeedOption,
    SourceArgument,
    WithoutOption,
    parts,
    tell_unheeded,
)
from irsim.cli.terminal import commands, given_path, in_options, progress_bar, run
from irsim.config.paths import is_recording, is_there
from irsim.errors import InputError, parse_frame_range

if TYPE_CHECKING:
    from irsim.camera.agc import Agc

app = commands("Render infrared scenes from YAML, record frames with exact truth, import real ones.")

RecordingOption = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="REC", help="The recording to write.", parser=given_path)
]


def main() -> None:
    """The command `irsim`."""
    run(app, "irsim")


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
    from irsim.lint.warnings import unheeded, warnings
    from irsim.render.sources import switched_off

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
    from irsim.recording import check_default, record
    from irsim.recording.output import check_output
    from irsim.render.sources import open_rendering
    from irsim.scenario.catalog import find

    wanted = None if frames is None else parse_frame_range(frames)
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


def import_(
    frames: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER|TIFF|NPY|VIDEO",
            help="A folder of PNG or TIFF files, a TIFF of several pages, a .npy or .npz of frames, or a video.",
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
    from irsim.recording import open_recording
    from irsim.recording.importers import import_frames, name_of
    from irsim.recording.output import check_output

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
    from irsim.camera import DisplaySettings
    from irsim.config.yaml_text import scalar
    from irsim.scenario.loader import build

    try:
        value = scalar(text)
    except InputError as error:
        raise InputError(f"--agc: {error}") from None
    return build(DisplaySettings, {"agc": {"kind": value} if isinstance(value, str) else value}, "import").agc


def _say_written(path: Path) -> None:
    print(path)
    print(f"look at it: irsim show {shlex.quote(str(path))}, or open it in Foxglove or Lichtblick")


# In the order of `--help`, as work goes: write, look, render, measure.
_COMMANDS: dict[str, Callable[..., None]] = {
    "new": commands_authoring.new,
    "check": check,
    "show": commands_pictures.show,
    "render": render,
    "info": commands_info.info,
    "masks": commands_pictures.masks,
    "sample": commands_authoring.sample,
    "import": import_,
    "noise": commands_measure.noise,
    "fit": commands_measure.fit,
    "realism": commands_measure.realism,
    "gallery": commands_pictures.gallery,
    "schema": commands_authoring.schema,
}
for name, command in _COMMANDS.items():
    app.command(name)(command)
