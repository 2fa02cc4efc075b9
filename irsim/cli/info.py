"""The command that says what is in a scene or a recording."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from irsim.cli.source_options import OverridesArgument, SeedOption, SourceArgument, WithoutOption, open_changed
from irsim.cli.terminal import progress_bar
from irsim.errors import counted, decimal_text

if TYPE_CHECKING:
    from irsim.cli.truth_summary import Spell, Survey
    from irsim.recording import Recording
    from irsim.types import Source, Truth


def info(
    source: SourceArgument,
    overrides: OverridesArgument = None,
    seed: SeedOption = None,
    without: WithoutOption = None,
) -> None:
    """Say what is in a recording or a scenario, and how large, fast, clear and hidden its targets are.

    Every byte of a recording is checked; status 2 where some are damaged.
    """
    from irsim.recording import Recording, damages

    opened = open_changed(source, overrides, seed, without)
    kept = opened if isinstance(opened, Recording) else None
    damaged = "" if kept is None else ", ".join(damages(kept))
    if kept is not None and damaged:
        raise kept.container.damage(damaged)
    for label, text in (
        ("scenario" if kept is None else "recording", source),
        *_facts(opened, len(opened) / opened.rate_hz if kept is None else kept.info()["duration_s"]),
        *(_names(opened) if kept is None else _of_the_file(kept)),
    ):
        print(f"{label:10} {text}")


def _names(source: Source) -> Iterator[tuple[str, str]]:
    """What --without may name in a scenario."""
    from irsim.render.stream import Rendering

    assert isinstance(source, Rendering)
    scenario = source.scenario
    names = [
        name if scenario.is_on(name) and scenario.is_on(name.partition(".")[0]) else f"{name} (off)"
        for name, _ in scenario.names()
    ]
    yield "names", ", ".join(names) or "none"


def _facts(source: Source, duration_s: float) -> Iterator[tuple[str, str]]:
    """Labels and texts of what any source has."""
    from irsim.cli.truth_summary import survey
    from irsim.recording import Recording

    columns, rows = source.size
    yield "frames", f"{len(source)} at {decimal_text(source.rate_hz, 6)} Hz, {decimal_text(duration_s, 3)} s"
    yield "picture", f"{columns}x{rows} px, {source.bits} bits"
    if not source.has_truth:
        yield "truth", "none: give trackers --init"
    else:
        truths = _truths(source)
        accuracy = max((target.accuracy_px for truth in truths for target in truth.targets), default=0.0)
        yield "truth", "exact" if accuracy == 0 else f"within {decimal_text(accuracy, 6)} px"
        for target in survey(truths, source.size):
            yield from _target(target)
    if source.follow:
        yield "follow", source.follow
    if not isinstance(source, Recording):
        yield "scene hash", source.hash
    elif source.header.source_hash is not None:
        yield "scene hash", f"{source.header.source_hash} (irsim info tells the same of the scene that was rendered)"


def _truths(source: Source) -> list[Truth]:
    """Of all frames: a scenario's are drawn for it."""
    truths = []
    with progress_bar(f"info {source.name}", len(source)) as progress:
        for truth in source.truths():
            truths.append(truth)
            if progress is not None:
                progress(len(truths))
    return truths


def _target(target: Survey) -> Iterator[tuple[str, str]]:
    what = f" ({target.cls})" if target.cls else ""
    yield "target", f"{target.id}{what}: {counted(target.frames, 'frame')} from {target.first} on"
    figures = [f"{decimal_text(target.size[0], 3)} x {decimal_text(target.size[1], 3)} px"]
    if target.speed is not None:
        figures.append(f"{decimal_text(target.speed, 2)} px/frame")
    if target.scr is not None:
        low, middle, high = (decimal_text(scr, 2) for scr in target.scr)
        figures.append(f"SCR {middle} ({low} to {high})")
    else:
        figures.append(f"no SCR: {target.why_none}")
    yield "", f"  {', '.join(figures)}"
    for label, spells in (
        ("more than half hidden", target.hidden),
        ("partly out of view", target.cut),
        ("out of view", target.outside),
        ("crossing", target.crossing),
        ("absent", target.absent),
    ):
        if spells:
            yield "", f"  {label} in {_shortened([_spell(spell) for spell in spells])}"


def _spell(spell: Spell) -> str:
    frames = f"{spell.first}" if spell.first == spell.last else f"{spell.first}-{spell.last}"
    return f"{frames} by {' and '.join(spell.by)}" if spell.by else frames


def _shortened(texts: list[str], most: int = 8) -> str:
    """The first of them, and how many more there are."""
    return ", ".join(texts[:most]) + (f" and {len(texts) - most} more" if len(texts) > most else "")


def _of_the_file(recording: Recording) -> Iterator[tuple[str, str]]:
    info = recording.info()
    for topic, count in info["topics"].items():
        yield "topic", f"{topic}: {counted(count, 'message')}"
    yield "scenario", "attached" if recording.scenario_text is not None else "none"
    yield "source", f"{info['input']} from {info['name']} by irsim {info['version']}"
    yield "file", f"{info['bytes'] / 1e6:.2f} MB"
    yield "file hash", recording.hash
    for note in info.get("notes", ()):
        yield "note", note
