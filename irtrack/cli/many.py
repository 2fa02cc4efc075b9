"""`irtrack run` of a tracker of many targets, or of a detector, without a start box."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irsim.errors import counted
from irtrack.cli.output import NOTHING, print_json, print_rules
from irtrack.errors import InputError

if TYPE_CHECKING:
    from irsim.types import Source, Truth
    from irtrack.tracks import DetectionSet, TrackSet


def detector_kind(name: str) -> Any | None:
    """Return the class or function of a detector's name; None for any other name."""
    from irtrack.detectors import DETECTOR_KINDS, find_detector
    from irtrack.detectors.plain import is_plain

    module, colon, _ = name.partition(":")
    if name in DETECTOR_KINDS:
        return DETECTOR_KINDS[name]
    if not colon or not all(part.isidentifier() for part in module.split(".")):
        return None
    try:
        found = find_detector(name)
    except InputError:
        return None  # the registry of trackers raises the error
    return found if is_plain(found) or getattr(found, "task", None) == "detect" else None


def check_options(
    name: str, task: str, init: object, start: object, target: object, output: Path | None, rate: object = None
) -> None:
    """Raise InputError for an option of trackers of one target, and for `-o` with a detector."""
    allowed = "--csv FILE.csv, .txt or .parquet" + (", -o REC.mcap" if task == "many" else "")
    for option, value in (("--init", init), ("--start", start), ("--target", target)):
        if value is not None:
            raise InputError(f"{option}: {name} follows all targets without a box; allowed: {allowed}")
    if rate is not None:
        raise InputError(f"--rate: {name} does not follow one target; allowed: a tracker of one target")
    if output is not None and task == "detect":
        raise InputError(f"-o: {name} is a detector, which has no tracks; allowed: {allowed}")


def show_found(
    found: TrackSet | DetectionSet,
    source: Source,
    truths: list[Truth],
    files: Iterable[Path | None],
    as_json: bool,
    repeat: Callable[[], str],
) -> None:
    """Print the figures of tracks of many targets, or of detections, and write them to the files that are given."""
    import numpy as np

    from irsim import Rendering
    from irtrack.bench.track_files import detection_rows, rows, write_detections, write_track_set
    from irtrack.falsify.rules import explain_all
    from irtrack.falsify.scene_rules import SceneTrace
    from irtrack.metrics.tasks import FIGURES_OF, Task, task_scores
    from irtrack.tracks import TrackSet

    figures = task_scores(found, truths, source.rate_hz)[0] if source.has_truth else {}
    written = [path for path in files if path is not None]
    for path in written:
        if isinstance(found, TrackSet):
            write_track_set(found, path, source.rate_hz)
        else:
            write_detections(found, path)
    is_many = isinstance(found, TrackSet)
    task: Task = "many" if is_many else "detect"
    scenario = source.scenario if isinstance(source, Rendering) else None
    trace = SceneTrace(found, tuple(truths), source.rate_hz)
    expected = [] if scenario is None else explain_all(scenario, trace, None, task)
    label = found.tracker if isinstance(found, TrackSet) else found.detector
    if as_json:
        facts: dict[str, Any] = {
            "source": found.source,
            "source_hash": found.source_hash,
            "tracker" if is_many else "detector": label,
            "config": found.config,
            "input": found.input,
            "scene_seed": found.scene_seed,
        }
        if isinstance(found, TrackSet):
            facts |= {"tracker_seed": found.tracker_seed, "tracks": rows(found)}
        else:
            facts["detections"] = detection_rows(found)
        rules = {"expected": [asdict(each) for each in expected]} if expected else {}
        print_json({**facts, "score": figures, **rules, "repeat": repeat()})
        return
    last = found.frames[-1] if len(found.frames) else 0
    if isinstance(found, TrackSet):
        amount = counted(len(np.unique(found.id[found.confirmed])), "confirmed track")
        seed = f", seed {found.tracker_seed}"
    else:
        amount, seed = counted(len(found), "detection"), ""
    print(f"{label} on {found.source}: {amount}, frames 0 to {last}{seed}")
    if not figures:
        print("no scores: the source has no truth")
    for name, figure in FIGURES_OF[task].items():
        if name in figures:
            value = figures[name]
            print(f"{name:16} {NOTHING if value is None else format(value, '.4g')} {figure.unit}".rstrip())
    print_rules(expected)
    for path in written:
        print(f"wrote {path}")
    print(f"repeat it: {repeat()}")
