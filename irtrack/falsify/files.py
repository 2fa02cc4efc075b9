"""What a hunt leaves behind: the smallest scene, its frames, a page for people."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import irsim
from irsim.files import check_output, replacing_text
from irtrack.bench import Entry, run_bench
from irtrack.falsify.hunt import Failure, Hunt
from irtrack.falsify.rules import in_words
from irtrack.falsify.trial import examine
from irtrack.report import write_report
from irtrack.report.repeat import run_command

MINIMAL = "minimal"
"""Stem of the smallest scene and of its recording."""

JOURNAL = "trials.jsonl"

REPORT = "report.md"

REPLAY = "replay.html"

FOUND = (f"{MINIMAL}.yaml", f"{MINIMAL}.mcap", REPLAY, REPORT)
"""What a hunt writes of a failure."""


def clear(folder: Path) -> None:
    """Take away what an earlier hunt found, so that it does not look like this one's; the journal stays."""
    if (folder / JOURNAL).is_file():  # no hunt is without one: the others are a hunt's too
        for name in FOUND:
            (folder / name).unlink(missing_ok=True)


def check_outputs(folder: Path, scenario: Path | None) -> None:
    """InputError where a file that a hunt writes into the folder cannot be one, or would replace the scenario's."""
    for name in (JOURNAL, *FOUND):
        check_output(folder / name, scenario)


def file_stem(scenario: str, label: str) -> str:
    """What files of a tracker on a scenario are called."""
    return f"{scenario}-{label}".replace(":", "-").replace("/", "-")


def smallest(hunt: Hunt, failure: Failure) -> irsim.Scenario:
    """The smallest scene, which expects the broken rule and nothing else."""
    rules = hunt.subject.rules if isinstance(failure.rule, str) else (hunt.subject.rules[failure.rule],)
    return irsim.change(hunt.scene(failure.least), {"expect": [{"kind": rule.kind, **_given(rule)} for rule in rules]})


def write_failure(folder: Path, hunt: Hunt, failure: Failure, name: str, command: str | None) -> None:
    """Write minimal.yaml, minimal.mcap, replay.html and report.md; `name` is the scenario's."""
    scene = smallest(hunt, failure)
    path = folder / f"{MINIMAL}.yaml"
    head = [f"{hunt.subject.label}: {hunt.named(failure.rule)} is broken here, as found in {name}; see report.md"]
    head += [f"all of it again: {command}"] if command else []
    with replacing_text(path) as file:
        file.write("".join(f"# {line}\n" for line in head) + irsim.dumps(scene, short=True))
    irsim.record(irsim.Rendering(scene, MINIMAL), folder / f"{MINIMAL}.mcap", compression="zstd")
    with tempfile.TemporaryDirectory() as scratch:
        entry = Entry(hunt.subject.label, hunt.subject.tracker)
        results = Path(scratch) / "minimal.db"
        with run_bench([path], [entry], results=results, seeds=[scene.seed], input=hunt.subject.input) as kept:
            (cell,), (row,) = kept.cells(), kept.sources().values()
            again = run_command(cell, row)
            write_report(kept, folder / REPLAY, command=command or again)
    with replacing_text(folder / REPORT) as file:
        file.write(_report(hunt, failure, scene, name, command, again))


def _report(hunt: Hunt, failure: Failure, scene: irsim.Scenario, name: str, command: str | None, again: str) -> str:
    verdict, _ = examine(hunt.subject, irsim.Rendering(scene), scene.seed)
    least = failure.least
    met = f"at run {failure.run} of the search" if failure.run else "at the benign point, before any search"
    again_so = "the same again, bit for bit" if failure.repeats else "NOT the same again: the tracker is not repeatable"
    luck = failure.least_luck.in_words() if failure.least_luck else "not told, for the hunt was stopped"
    said = f"raised {verdict.raised}" if verdict.raised else f"margin {_margins(hunt, verdict.margins)}"
    lines = [
        f"# {hunt.subject.label} on {name}: {hunt.named(failure.rule)} is broken",
        "",
        f"- Found {met}, with scene seed {hunt.space.scenario.seed}; {again_so}.",
        f"- As found, {failure.luck.in_words()}.",
        f"- Made small, {luck}.",
        f"- Frames: {scene.frames} of {hunt.space.scenario.frames}. Off: {', '.join(least.without) or 'nothing'}.",
        f"- Made small, {said} (broken below 0).",
        "",
        "| key | benign | found | smallest |",
        "| --- | --- | --- | --- |",
        *(
            f"| `{knob.key}` | {_short(knob.benign)} | {_short(failure.found.point[knob.key])} "
            f"| {_short(least.point[knob.key])} |"
            for knob in hunt.space.knobs
        ),
        "",
        "```sh",
        again,
        *([command] if command else []),
        "```",
        "",
        f"`{MINIMAL}.yaml` renders the frames of `{MINIMAL}.mcap`; `replay.html` shows the run frame by frame.",
    ]
    return "\n".join(lines) + "\n"


def _margins(hunt: Hunt, margins: tuple[float, ...]) -> str:
    return ", ".join(f"{in_words(rule)} {value:.3g}" for rule, value in zip(hunt.subject.rules, margins, strict=True))


def _given(rule: irsim.Expectation) -> dict[str, object]:
    return {key: value for key, value in rule.model_dump().items() if value is not None}


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else json.dumps(value)
