"""`irtrack live`: a running tracker's tracks over the frames of its source, in a viewer."""

from __future__ import annotations

from typing import Annotated, Any

from irtrack.cli.options import InputName, argument, auto_detector, input_name, option
from irtrack.errors import InputError


def live(
    tracker: Annotated[str, argument("NAME[:KEY=VALUE...]", "Tracker of `irtrack list`, or module:Class.")],
    source: Annotated[str, argument("SCENARIO|REC", "File or name of a scenario, or file of a recording.")],
    settings: Annotated[
        list[str] | None, argument("KEY=VALUE", "Tracker parameters and scenario overrides, as for `irtrack run`.")
    ] = None,
    target: Annotated[str | None, option("ID", "Target to follow, where the truth has several.")] = None,
    init: Annotated[str | None, option("X,Y,W,H[@FRAME]", "Start box, as for `irtrack run`.")] = None,
    start_by: Annotated[
        str | None, option("auto[:DETECTOR]", "Start at the first confirmed track of gnn on a detector.", "--start")
    ] = None,
    input: InputName = "display",
    seed: Annotated[
        int | None, option("N", "Seed of scene and tracker; default: the scenario's own, or 0.", min=0)
    ] = None,
    port: Annotated[int, option("N", "Port; 0: any free one.", min=0, max=65_535)] = 8765,
    host: Annotated[str, option("ADDRESS", "Address to listen on; 0.0.0.0 lets other machines in.")] = "127.0.0.1",
) -> None:
    """Play a source in a viewer with the tracks of a running tracker, until Ctrl-C.

    Viewers play, pause, seek and set the speed; the tracker gets every frame in order.
    """
    from irsim import LiveServer, Scenario, is_recording, open_source
    from irtrack.bench.plan import task_of
    from irtrack.bench.spec import read_spec
    from irtrack.cli.options import split_settings, start_box
    from irtrack.registry.table import find, make
    from irtrack.replay.live import overlay
    from irtrack.replay.many import ManyPlayer, auto_start
    from irtrack.replay.replay import Player
    from irtrack.replay.start import find_start

    spec, looked_at = read_spec(tracker), input_name(input)
    keys = () if is_recording(source) else Scenario.model_fields
    split = split_settings(settings or (), find(spec.name), keys, spec.parameters)
    made: Any = make(spec.name, split.tracker)
    opened = open_source(source, split.scenario)
    opened = opened if seed is None else opened.with_seed(seed)
    tracker_seed = seed if seed is not None else opened.seed or 0
    if task_of(made) != "single":
        if (init, start_by, target) != (None, None, None):
            raise InputError(f"{spec.name}: follows all targets; allowed: no --init, no --start, no --target")
        player: Any = ManyPlayer(made, tracker_seed, spec.label)
    else:
        given = None if init is None else start_box(init)
        if start_by is None:
            start = find_start(opened, opened.truths(), target, given)
        else:
            start = auto_start(opened, looked_at, auto_detector(start_by, init, target))
        player = Player(made, start, tracker_seed, spec.label)
    LiveServer(opened, [overlay(player, opened, looked_at)], host, port).serve()
