"""Commands of irtrack.

Slow modules are imported inside the commands, so that `irtrack --help` starts at once.
"""

from __future__ import annotations

import faulthandler
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from irsim.cli import terminal
from irsim.errors import counted
from irtrack.cli.bench import bench, export
from irtrack.cli.check import check
from irtrack.cli.compare import compare
from irtrack.cli.explain import explain
from irtrack.cli.falsify import falsify
from irtrack.cli.live import live
from irtrack.cli.many import check_options, detector_kind, show_found
from irtrack.cli.options import (
    AsJson,
    FilledResults,
    InputName,
    argument,
    auto_detector,
    command_line,
    input_name,
    option,
    path_option,
)
from irtrack.cli.output import keep_output, print_json, print_rules, print_run, warn_unused
from irtrack.cli.papers import papers
from irtrack.cli.regress import regress
from irtrack.cli.stress import stress
from irtrack.cli.train import train
from irtrack.errors import InputError, TrackerError
from irtrack.runner.crash_reporter import crash_reporter

if TYPE_CHECKING:
    from irsim.types import Source
    from irtrack.falsify.rules import Explanation

app = terminal.commands("Replay infrared recordings into trackers, measure where they break, and report it.")


def main() -> None:
    """Run the command `irtrack`."""
    keep_output()
    terminal.run(app, "irtrack")


@app.command("list")
def list_trackers(as_json: AsJson = False) -> None:
    """List the trackers: name, method, and publication."""
    from irtrack.detectors import DETECTOR_KINDS
    from irtrack.external import HINT, offered
    from irtrack.registry.table import describe

    try:
        peers, broken = offered(), False
    except InputError as error:
        peers, broken = [], True
        print(f"warning: {error}", file=sys.stderr)
    rows = describe(peers)
    if as_json:
        print_json([row._asdict() for row in rows])
        return
    width = max(len(row.name) for row in rows)
    for row in rows:
        print(f"{row.name:{width}}  {row.summary}\n{'':{width}}  {row.source}")
    print("detectors, for irtrack bench --detectors and for gnn:detector=NAME")
    for name, kind in DETECTOR_KINDS.items():
        print(f"{name:{width}}  {(kind.__doc__ or '').partition(chr(10))[0]}\n{'':{width}}  {kind.source}")
    if not peers and not broken:
        print(HINT)
    print("or module:Class, your own tracker")


@app.command()
def run(
    tracker: Annotated[
        str,
        argument(
            "NAME[:KEY=VALUE...]",
            "Tracker or detector of `irtrack list`, or module:Class; parameters here or after the source.",
        ),
    ],
    source: Annotated[str, argument("SCENARIO|REC", "File or name of a scenario, or file of a recording.")],
    settings: Annotated[
        list[str] | None,
        argument(
            "KEY=VALUE", "Tracker parameters (particles=500) and scenario overrides (camera.netd_mk=80, frames=50)."
        ),
    ] = None,
    target: Annotated[str | None, option("ID", "Target to follow, where the truth has several.")] = None,
    init: Annotated[
        str | None,
        option("X,Y,W,H[@FRAME]", "Start box: top-left pixel, width, height, as in label files; default frame: 0."),
    ] = None,
    start_by: Annotated[
        str | None,
        option("auto[:DETECTOR]", "Start at the first confirmed track of gnn on a detector (lcm).", "--start"),
    ] = None,
    input: InputName = "display",
    seed: Annotated[
        int | None, option("N", "Seed of scene and tracker; default: the scenario's own, or 0.", min=0)
    ] = None,
    tracker_seed: Annotated[int | None, option("N", "Seed of the tracker; default: that of the scene.", min=0)] = None,
    rate: Annotated[
        float | None,
        option("F", "Real time, F times the camera's rate: frames that come while the tracker works are dropped."),
    ] = None,
    output: Annotated[Path | None, path_option("REC", "Write the tracks as a recording.", "-o", "--output")] = None,
    csv: Annotated[
        Path | None, path_option("FILE", "Write tracks or detections: .csv, .txt (MOT), .parquet.", "--csv")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run one tracker or detector over one source; print its scores and the command that repeats it."""
    from irsim.recording.output import all_or_none, check_output

    check_output(output, Path(source), csv, endings=(".mcap",))
    check_output(csv, Path(source), output, endings=(".csv", ".txt", ".parquet"))
    looked_at, start = input_name(input), None
    with crash_reporter(tracker, f"repeat it: {command_line()}") as reporter:
        from irsim import Rendering, Scenario, is_recording, open_source
        from irtrack.bench.plan import task_of
        from irtrack.bench.spec import read_spec
        from irtrack.cli.options import split_settings, start_box
        from irtrack.detectors import make_detector
        from irtrack.metrics import Reference, Trace, score_trace
        from irtrack.registry.identity import source_file
        from irtrack.registry.table import find, make
        from irtrack.replay.many import DetectorPlayer, ManyPlayer, auto_start
        from irtrack.replay.real_time import RealTime
        from irtrack.replay.replay import Player, replay
        from irtrack.replay.start import find_start

        if init is not None:
            start = start_box(init)
        keys = () if is_recording(Path(source)) else Scenario.model_fields
        spec = read_spec(tracker)
        detector = detector_kind(spec.name)
        found = find(spec.name) if detector is None else detector
        for written in (csv, output):
            check_output(written, source_file(found))
        split = split_settings(settings or (), found, keys, spec.parameters)
        made: Any = make(spec.name, split.tracker) if detector is None else make_detector(spec.name, split.tracker)
        opened = open_source(source, split.scenario)
        for written in (csv, output):
            check_output(written, *opened.needs)
        warn_unused([source], split.scenario)
        if seed is not None:
            opened = opened.with_seed(seed)
        if tracker_seed is None:
            tracker_seed = seed if seed is not None else opened.seed or 0
        if sys.__stderr__ is not None and not faulthandler.is_enabled():
            faulthandler.enable(sys.__stderr__)  # a crash in native code prints the line of the tracker
        player: Any
        camera: RealTime | None = None
        if (task := task_of(made)) != "single":
            check_options(spec.name, task, init, start_by, target, output, rate)
            player, first = (ManyPlayer if task == "many" else DetectorPlayer)(made, tracker_seed, spec.label), 0
        else:
            if start_by is None:
                begin = find_start(opened, opened.truths(), target, start)
            else:
                begin = auto_start(opened, looked_at, auto_detector(start_by, init, target))
            player = Player(made, begin, tracker_seed, spec.label)
            first = player.start.frame
            if rate is not None:
                camera = RealTime(player, rate)
        repeat = _repeat(seed, opened, tracker_seed)
        where = f"on {opened.name}, seed {tracker_seed}; repeat it: {repeat}"
        reporter.note(where)
        see = reporter.watching((camera or player).see)
        try:
            with terminal.progress_bar(tracker, ticking=False) as progress:
                truths = replay(opened, [see], looked_at, first, progress=progress)
                if camera is not None:
                    camera.finish()
        except TrackerError as error:
            print("\n".join([f"irtrack: {error}", *error.calls().splitlines(), where]), file=sys.stderr)
            raise typer.Exit(1) from None
    if task != "single":
        show_found(player.result(opened, looked_at), opened, truths, (csv, output), as_json, lambda: repeat)
        return
    track = player.track(opened, looked_at)
    held = track if camera is None else camera.held(track)
    trace = Trace.of(held, Reference.of(truths, track.target))
    result = score_trace(trace)
    expected: list[Explanation] = []
    if isinstance(opened, Rendering) and track.target is not None:
        from irtrack.falsify.rules import explain_all

        expected = explain_all(opened.scenario, trace, track.target, "single")
    with all_or_none(csv, output):
        if csv is not None:
            from irtrack.bench.track_files import write_track_set
            from irtrack.cli.track_files import track_to_csv

            (track_to_csv if csv.suffix.lower() == ".csv" else write_track_set)(track, csv)
        if output is not None:
            from irtrack.cli.track_files import record_track

            record_track(track, opened.rate_hz, output)
    if as_json:
        from irtrack.cli.track_files import track_as_dict

        rules = [asdict(each) for each in expected]
        dropped = {} if camera is None else {"rate": camera.rate, "dropped": [index for index, _ in camera.dropped]}
        score = result.as_dict()
        print_json({**track_as_dict(track), **dropped, "score": score, "expected": rules, "repeat": repeat})
        return
    print_run(track, result, opened.has_truth)
    if camera is not None:
        came = len(held.indices)
        print(f"dropped      {len(camera.dropped)} of {counted(came, 'frame')} at {rate:g} times {opened.rate_hz:g} Hz")
    print_rules(expected)
    for path in (csv, output):
        if path is not None:
            print(f"wrote {path}")
    print(f"repeat it: {repeat}")


app.command()(live)
app.command()(bench)
app.command()(export)


@app.command()
def report(
    results: FilledResults,
    output: Annotated[
        Path | None, path_option("FILE", "Output file; default: report.FORMAT beside DB.", "-o", "--output")
    ] = None,
    format: Annotated[
        str | None, option("html|json|csv|md", "One HTML page, or its figures as data; default: by the ending of FILE.")
    ] = None,
) -> None:
    """Write the report of a results file and print its path."""
    from irsim.recording.output import check_output

    check_output(output, results)
    from irtrack.report import write_report

    print(write_report(results, output, format))


app.command()(compare)
app.command()(check)
app.command()(falsify)
app.command()(explain)
app.command()(stress)
app.command()(regress)
app.command()(papers)
app.command()(train)


def _repeat(seed: int | None, opened: Source, tracker_seed: int) -> str:
    """Return the command line with the seeds of the run."""
    if seed is not None:
        return command_line()
    used = tracker_seed if opened.seed is None else opened.seed
    return f"{command_line()} --seed {used}"
