"""`irtrack run` of a tracker of many targets, without a start box and with figures over all targets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irsim.errors import counted
from irtrack.cli.output import NOTHING, print_json, print_rules
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irsim.types import Source, Truth
    from irtrack.tracks import TrackSet


def check_options(name: str, init: object, target: object, output: Path | None) -> None:
    """Raise InputError for options that only trackers of one target take."""
    for option, value in (("--init", init), ("--target", target), ("-o", output)):
        if value is not None:
            raise InputError(f"{option}: {name} follows all targets without a box; allowed: --csv FILE.csv or FILE.txt")


def show_many(
    tracks: TrackSet, source: Source, truths: list[Truth], csv: Path | None, as_json: bool, repeat: Callable[[], str]
) -> None:
    """Print the figures of tracks of many targets, and write them to a file where one is given."""
    import numpy as np

    from irsim import Rendering
    from irtrack.bench.track_files import rows, write_track_set
    from irtrack.falsify.rules import explain_all
    from irtrack.falsify.scene_rules import SceneTrace
    from irtrack.metrics.tasks import FIGURES_OF, task_scores

    figures = task_scores(tracks, truths, source.rate_hz)[0] if source.has_truth else {}
    scenario = source.scenario if isinstance(source, Rendering) else None
    trace = SceneTrace(tracks, tuple(truths), source.rate_hz)
    expected = [] if scenario is None else explain_all(scenario, trace, None, "many")
    if csv is not None:
        write_track_set(tracks, csv)
    if as_json:
        facts: dict[str, Any] = {
            "source": tracks.source,
            "source_hash": tracks.source_hash,
            "tracker": tracks.tracker,
            "config": tracks.config,
            "input": tracks.input,
            "scene_seed": tracks.scene_seed,
            "tracker_seed": tracks.tracker_seed,
        }
        rules = {"expected": [asdict(each) for each in expected]} if expected else {}
        print_json({**facts, "tracks": rows(tracks), "score": figures, **rules, "repeat": repeat()})
        return
    ids = np.unique(tracks.id[tracks.confirmed])
    last = tracks.frames[-1] if len(tracks.frames) else 0
    print(
        f"{tracks.tracker} on {tracks.source}: {counted(len(ids), 'confirmed track')}, frames 0 to {last}, "
        f"seed {tracks.tracker_seed}"
    )
    if not figures:
        print("no scores: the source has no truth")
    for name, figure in FIGURES_OF["many"].items():
        if name in figures:
            value = figures[name]
            print(f"{name:16} {NOTHING if value is None else format(value, '.4g')} {figure.unit}".rstrip())
    print_rules(expected)
    if csv is not None:
        print(f"wrote {csv}")
    print(f"repeat it: {repeat()}")
