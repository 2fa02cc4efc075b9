"""Command `info`: contents of a scenario or a recording, and a summary of the targets' ground truth."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from irsim.cli.source_options import OverridesArgument, SeedOption, SourceArgument, WithoutOption, open_changed
from irsim.cli.terminal import progress_bar
from irsim.errors import counted, decimal_text, one_line

if TYPE_CHECKING:
    from irsim.cli.truth_summary import FrameSpan, TargetSummary
    from irsim.recording import Recording
    from irsim.types import Source, Truth

SPANS = 8
"""Largest number of spans of frames on one line."""


def info(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Print contents of a scenario or recording, and target statistics.

    The statistics are size, speed, SCR and hidden frames of each target. Every byte of a recording is checked; status 2
    where some are damaged.
    """
    from irsim.recording import Recording, damages

    opened = open_changed(source, overrides, seed, without)
    recording = opened if isinstance(opened, Recording) else None
    if recording is not None and (damaged := ", ".join(damages(recording))):
        raise recording.mcap.damage_error(damaged)
    for label, text in (
        ("scenario" if recording is None else "recording", source),
        *_facts(opened, len(opened) / opened.rate_hz if recording is None else recording.info()["duration_s"]),
        *(_names(opened) if recording is None else _file_facts(recording)),
    ):
        print(f"{label:10} {one_line(text)}")


def _names(source: Source) -> Iterator[tuple[str, str]]:
    """Yield the names of a scenario's parts that `--without` accepts."""
    from irsim.render.stream import Rendering

    assert isinstance(source, Rendering)
    scenario = source.scenario
    names = [
        name if scenario.is_on(name) and scenario.is_on(name.partition(".")[0]) else f"{name} (off)"
        for name, _ in scenario.names()
    ]
    yield "names", ", ".join(names) or "none"


def _facts(source: Source, duration_s: float) -> Iterator[tuple[str, str]]:
    """Yield the label and the text of each fact that any source has."""
    from irsim.cli.truth_summary import summarize
    from irsim.recording import Recording

    columns, rows = source.size
    yield "frames", f"{len(source)} at {decimal_text(source.rate_hz, 6)} Hz, {decimal_text(duration_s, 3)} s"
    yield "picture", f"{columns}x{rows} px, {source.bits} bits"
    if not source.has_truth:
        yield "truth", "none: trackers need --init"
    else:
        truths = _truths(source)
        accuracy = max((target.accuracy_px for truth in truths for target in truth.targets), default=0.0)
        yield "truth", "exact" if accuracy == 0 else f"within {decimal_text(accuracy, 6)} px"
        for target in summarize(truths, source.size):
            yield from _target(target)
    if source.follow:
        yield "follow", source.follow
    if not isinstance(source, Recording):
        yield "scene hash", source.hash
    elif source.header.source_hash is not None:
        yield "scene hash", f"{source.header.source_hash} (of the rendered scenario, as irsim info SCENARIO prints it)"


def _truths(source: Source) -> list[Truth]:
    """Return the truths of all frames. Those of a scenario are rendered, with a progress bar."""
    truths = []
    with progress_bar(f"info {source.name}", len(source)) as progress:
        for truth in source.truths():
            truths.append(truth)
            if progress is not None:
                progress(len(truths))
    return truths


def _target(target: TargetSummary) -> Iterator[tuple[str, str]]:
    target_class = f" ({target.cls})" if target.cls else ""
    yield "target", f"{target.id}{target_class}: {counted(target.frames, 'frame')} from {target.first} on"
    figures = [f"{decimal_text(target.size[0], 3)} x {decimal_text(target.size[1], 3)} px"]
    if target.speed is not None:
        figures.append(f"{decimal_text(target.speed, 2)} px/frame")
    if target.scr is not None:
        low, median, high = (decimal_text(scr, 2) for scr in target.scr)
        figures.append(f"SCR {median} ({low} to {high})")
    else:
        figures.append(f"no SCR: {target.no_scr}")
    yield "", f"  {', '.join(figures)}"
    for label, spans in (
        ("more than half hidden", target.hidden),
        ("partly out of view", target.cut),
        ("out of view", target.outside),
        ("crossing", target.crossing),
        ("absent", target.absent),
    ):
        if spans:
            more = f" and {len(spans) - SPANS} more" if len(spans) > SPANS else ""
            yield "", f"  {label} in {', '.join(map(_span, spans[:SPANS]))}{more}"


def _span(span: FrameSpan) -> str:
    frames = f"{span.first}" if span.first == span.last else f"{span.first}-{span.last}"
    return f"{frames} by {' and '.join(span.occluders)}" if span.occluders else frames


def _file_facts(recording: Recording) -> Iterator[tuple[str, str]]:
    """Yield the label and the text of each fact about a recording's file."""
    info = recording.info()
    for topic, count in info["topics"].items():
        yield "topic", f"{topic}: {counted(count, 'message')}"
    yield "scenario", "attached" if recording.scenario_text is not None else "none"
    yield "source", f"{info['input']} from {info['name']} by irsim {info['version']}"
    yield "file", f"{info['bytes'] / 1e6:.2f} MB"
    yield "file hash", recording.hash
    for note in info.get("notes", ()):
        yield "note", note
