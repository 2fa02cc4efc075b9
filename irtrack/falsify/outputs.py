"""What a hunt leaves behind: the smallest scene, its frames, a page for people."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path

import irsim
from irsim.config.files import check_output, replacing_text
from irtrack.bench import Entry, run_bench
from irtrack.falsify.falsification import Failure, Hunt, Luck
from irtrack.falsify.rules import OF_ITSELF, asked, reached
from irtrack.falsify.trial import Verdict
from irtrack.metrics import Trace
from irtrack.report.finding import Finding, write_finding
from irtrack.report.repeat import run_command
from irtrack.runner.pool import InProcess

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
    """Write minimal.yaml, minimal.mcap, replay.html and report.md, or none of them; `name` is the scenario's."""
    try:
        _write_failure(folder, hunt, failure, name, command)
    except BaseException:
        clear(folder)
        raise


def _write_failure(folder: Path, hunt: Hunt, failure: Failure, name: str, command: str | None) -> None:
    scene = smallest(hunt, failure)
    path = folder / f"{MINIMAL}.yaml"
    drawn = irsim.Rendering(scene, MINIMAL)
    irsim.record(drawn, folder / f"{MINIMAL}.mcap", compression="zstd")
    head = [f"{hunt.subject.label}: {hunt.broken(failure.rule)} here, as found in {name}"]
    head += [f"all of it again: {command}"] if command else []
    with replacing_text(path) as file:
        file.write("".join(f"# {line}\n" for line in head) + irsim.dumps(scene, short=True, folder=folder))
    with tempfile.TemporaryDirectory() as scratch:
        entry = Entry(hunt.subject.label, hunt.subject.tracker)
        results = Path(scratch) / "minimal.db"
        with run_bench(
            [path],
            [entry],
            results=results,
            seeds=[scene.seed],
            frame_limit_s=None if isinstance(hunt.trials.runner, InProcess) else hunt.trials.limit.seconds,
            input=hunt.subject.input,
        ) as kept:
            (cell,), (row,) = kept.cells(), kept.sources().values()
            commands = [("The run on the smallest scene", run_command(cell, row))]
            commands += [("All of the search", command)] if command else []
            finding = finding_of(hunt, failure, scene, name, tuple(commands))
            write_finding(kept, folder / REPLAY, finding, drawn)
    with replacing_text(folder / REPORT) as file:
        file.write(finding.as_markdown(REPORT))


def finding_of(
    hunt: Hunt, failure: Failure, scene: irsim.Scenario, name: str, commands: tuple[tuple[str, str], ...]
) -> Finding:
    """The failure in words; `scene` is the smallest."""
    verdict, traces = hunt.trials.examine(scene)
    least, whole = failure.least, hunt.space.scenario
    return Finding(
        title=f"{hunt.subject.label} on {name}: {hunt.broken(failure.rule)}",
        verdict=(*_verdict(hunt, failure.rule, verdict, traces), ("Fresh seeds", _luck(failure.least_luck))),
        way=(
            (
                "Found",
                (f"at run {failure.run} of the search" if failure.run else "at the benign point, before any search")
                + f", with scene seed {whole.seed}",
            ),
            (
                "Run again",
                "the same again, bit for bit"
                if failure.repeats
                else "NOT the same again: the tracker is not repeatable, so nothing was made smaller",
            ),
            ("As found", _luck(failure.luck)),
            ("Made small", _luck(failure.least_luck)),
            ("Frames", f"{scene.frames} of {whole.frames}"),
            ("Switched off", ", ".join(least.without) or "nothing"),
        ),
        knobs=tuple(
            (knob.key, short(knob.benign), short(failure.found.point[knob.key]), short(least.point[knob.key]))
            for knob in hunt.space.knobs
        ),
        commands=commands,
        files=(
            (f"{MINIMAL}.yaml", "the smallest scene, which expects this rule alone"),
            (f"{MINIMAL}.mcap", f"the frames that {MINIMAL}.yaml renders, with their truth"),
            (REPLAY, "the run on them frame by frame, and all that is said here"),
            (REPORT, "all that is said here as Markdown"),
            (JOURNAL, "every trial, by which the same search goes on where it was stopped"),
        ),
    )


def _verdict(hunt: Hunt, rule: int | str, verdict: Verdict, traces: tuple[Trace, ...]) -> Sequence[tuple[str, str]]:
    """What was asked beside what was reached, in the run at hand."""
    if isinstance(rule, str):
        return ("Asked", OF_ITSELF[rule][1]), ("Reached", verdict.raised or "nothing of the kind")
    broken = hunt.subject.rules[rule]
    if not traces:
        return ("Asked", asked(broken)), ("Reached", verdict.raised or "no target to start on")
    margin = f"{verdict.margins[rule]:.3g}, broken below 0"
    return ("Asked", asked(broken)), ("Reached", reached(broken, traces[rule])), ("Margin", margin)


def _luck(luck: Luck | None) -> str:
    return luck.in_words() if luck else "not told, for the hunt was stopped"


def _given(rule: irsim.Expectation) -> dict[str, object]:
    return {key: value for key, value in rule.model_dump().items() if value is not None}


def short(value: object) -> str:
    """A value as people read it: to six digits."""
    return f"{value:.6g}" if isinstance(value, float) else json.dumps(value)
