"""Command `irsim live`: frames and ground truth, played to a viewer."""

from __future__ import annotations

from typing import Annotated

import typer

from irsim.cli.source_options import OverridesArgument, SeedOption, SourceArgument, WithoutOption, open_changed

PortOption = Annotated[int, typer.Option(metavar="N", min=0, max=65_535, help="Port; 0: any free one.")]
HostOption = Annotated[
    str, typer.Option(metavar="ADDRESS", help="Address to listen on; 0.0.0.0 lets other machines in.")
]


def live(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    seed: SeedOption = None,
    without: WithoutOption = None,
    port: PortOption = 8765,
    host: HostOption = "127.0.0.1",
) -> None:
    """Play a scenario or a recording in a viewer (Foxglove, Lichtblick), until Ctrl-C.

    Viewers play, pause, seek and set the speed.
    """
    from irsim.live import LiveServer

    LiveServer(open_changed(source, overrides, seed, without), host=host, port=port).serve()
