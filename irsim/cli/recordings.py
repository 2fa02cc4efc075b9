"""Commands on files of recordings: verify and recover."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from irsim.cli.terminal import given_path, progress_bar
from irsim.errors import InputError, counted


def verify(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC", help="Recordings.", parser=given_path)],
) -> None:
    """Check every byte of recordings: ok, or a line with the damaged frames.

    Status 2 where one is damaged.
    """
    from irsim.recording import damages, open_recording

    failed = False
    for path in recordings:
        try:
            recording = open_recording(path)
            if damaged := ", ".join(damages(recording)):
                raise recording.mcap.damage_error(damaged)
        except InputError as error:
            failed = True
            print(f"irsim: {error}", file=sys.stderr)
        else:
            print(f"{path}: ok, {counted(len(recording), 'frame')}")
    if failed:
        sys.exit(2)


def recover(
    recording: Annotated[Path, typer.Argument(metavar="REC", help="Damaged recording.", parser=given_path)],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="REC", help="Recording to write.", parser=given_path)
    ],
) -> None:
    """Write the intact frames of a damaged recording to a new one."""
    from irsim import recording as recordings
    from irsim.recording.output import check_output

    check_output(output, recording, endings=(".mcap",))
    with progress_bar(f"recover {recording.name}") as progress:
        recordings.recover(recording, output, progress)
    for note in recordings.open_recording(output).contents.notes:
        print(f"irsim: note: {note}", file=sys.stderr)
    print(f"{output}: irsim info {shlex.quote(str(output))} describes it")
