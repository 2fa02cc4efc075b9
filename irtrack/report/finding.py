"""Report of a failure found by falsification: an HTML page with a replay, and Markdown."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path

import irsim
from irsim.recording.output import atomic_text
from irsim.types import Source
from irtrack.bench import Entry, Results, RunRecord, run_bench
from irtrack.falsify.falsification import Failure, Falsification, SeedSensitivity
from irtrack.falsify.outputs import JOURNAL, MINIMAL, REPLAY, REPORT
from irtrack.falsify.rules import IMPLICIT, explain
from irtrack.metrics.ceiling import CEILING
from irtrack.report.figure_data import failures, measured, source_figures
from irtrack.report.line_styles import styles
from irtrack.report.page import render, versions
from irtrack.report.repeat import run_command
from irtrack.report.sections import Budget, section
from irtrack.report.task_sections import task_chapters
from irtrack.runner.pool import InProcess

Rows = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Finding:
    """Failure in words.

    verdict    (name, text): the requirement of the rule and the result
    way        (name, text): how the failure was found and shrunk
    knobs      (key, benign value, value found, smallest value) of each varied key
    commands   (purpose, command)
    files      (name, content) of the files beside the page
    """

    title: str
    verdict: Rows
    way: Rows
    knobs: tuple[tuple[str, str, str, str], ...]
    commands: Rows
    files: Rows

    def beside(self, name: str) -> list[tuple[str, str]]:
        """Return (name, content) of the files other than `name`."""
        return [file for file in self.files if file[0] != name]

    def as_markdown(self, name: str) -> str:
        """Return the finding as Markdown, for a file of that name."""
        lines = [f"# {self.title}", "", *_items(self.verdict), "", *_items(self.way), ""]
        lines += ["| key | benign | found | smallest |", "| --- | --- | --- | --- |"]
        lines += [f"| `{key}` | {' | '.join(values)} |" for key, *values in self.knobs]
        lines += ["", "```sh", *(line for what, command in self.commands for line in (f"# {what}", command)), "```", ""]
        lines += [f"- `{file}`: {what}" for file, what in self.beside(name)]
        return "\n".join(lines) + "\n"


def _items(rows: Rows) -> list[str]:
    return [f"- {name}: {text}" for name, text in rows]


def write_failure_report(falsification: Falsification, failure: Failure, folder: Path, cause: str = "") -> None:
    """Write replay.html and report.md beside minimal.yaml and minimal.mcap (`irtrack.falsify.find.Report`).

    cause   of the failure, in words (`irtrack.explain.explain_failure`)
    """
    subject, trials = falsification.subject, falsification.trials
    scene = falsification.smallest(failure)
    with (
        tempfile.TemporaryDirectory() as scratch,
        run_bench(
            [folder / f"{MINIMAL}.yaml"],
            [Entry(subject.label, subject.tracker)],
            results=Path(scratch) / "minimal.db",
            seeds=[scene.seed],
            frame_limit_s=None if isinstance(trials.runner, InProcess) else trials.limit.seconds,
            input=subject.input,
        ) as results,
    ):
        (cell,), (row,) = _of_the_subject(results), results.sources().values()
        finding = _finding(falsification, failure, scene, run_command(cell, row), cause)
        _write_page(results, folder / REPLAY, finding, irsim.Rendering(scene, MINIMAL))
    with atomic_text(folder / REPORT) as file:
        file.write(finding.as_markdown(REPORT))


def _finding(
    falsification: Falsification, failure: Failure, scene: irsim.Scenario, command: str, cause: str
) -> Finding:
    """Return the failure in words; `scene`: the smallest one."""
    space, least = falsification.space, failure.least
    when = f"at run {failure.run} of the search" if failure.run else "at the benign point, before the search"
    commands = [("The run on the smallest scene", command)]
    commands += [("The whole search", falsification.command)] if falsification.command else []
    return Finding(
        title=f"{falsification.subject.label} on {falsification.name}: {falsification.broken(failure.rule)}",
        verdict=(
            *_verdict(falsification, failure.rule, scene),
            ("Fresh seeds", _sensitivity(failure.least_sensitivity)),
            *((("Cause", cause),) if cause else ()),
        ),
        way=(
            ("Found", f"{when}, with scene seed {space.scenario.seed}"),
            (
                "Run again",
                "repeated bit for bit"
                if failure.repeats
                else "NOT repeated: the tracker is not deterministic, so the scene was not shrunk",
            ),
            ("As found", _sensitivity(failure.sensitivity)),
            ("Shrunk", _sensitivity(failure.least_sensitivity)),
            ("Frames", f"{scene.frames} of {space.scenario.frames}"),
            ("Switched off", ", ".join(least.without) or "nothing"),
        ),
        knobs=tuple(
            (knob.key, short(knob.benign), short(failure.found.point[knob.key]), short(least.point[knob.key]))
            for knob in space.knobs
        ),
        commands=tuple(commands),
        files=(
            (f"{MINIMAL}.yaml", "the smallest scene, which expects only this rule"),
            (f"{MINIMAL}.mcap", f"the frames of {MINIMAL}.yaml, with their truth"),
            (REPLAY, "the run frame by frame, with this report"),
            (REPORT, "this report as Markdown"),
            (JOURNAL, "all trials, from which the same search resumes"),
        ),
    )


def _verdict(falsification: Falsification, rule: int | str, scene: irsim.Scenario) -> Rows:
    """Return requirement, result and margin of the rule, by a run on the smallest scene."""
    verdict, traces = falsification.trials.examine(scene)
    if isinstance(rule, str):
        return ("Required", IMPLICIT[rule][1]), ("Result", verdict.raised or "no exception and no crash")
    broken = falsification.subject.rules[rule]
    if not traces:
        return (("Result", verdict.raised or "no target to start on"),)
    explanation = explain(broken, traces[rule])
    margin = f"{explanation.margin:.3g}, broken below 0"
    return ("Required", explanation.asked), ("Result", explanation.reached), ("Margin", margin)


def _sensitivity(sensitivity: SeedSensitivity | None) -> str:
    return sensitivity.in_words() if sensitivity else "unknown: the search was interrupted"


def short(value: object) -> str:
    """Return a value as text, a number with six digits."""
    return f"{value:.6g}" if isinstance(value, float) else json.dumps(value)


def _of_the_subject(results: Results) -> list[RunRecord]:
    """Return the run of the tracker or detector, without that of the ideal matched filter beside a detector."""
    return [cell for cell in results.cells() if cell.label != CEILING]


def _write_page(results: Results, out: Path, finding: Finding, source: Source) -> None:
    """Write the page of the finding with a replay, from a results file with one run and its open source."""
    cells = _of_the_subject(results)
    by_label = styles([cell.label for cell in cells])
    (run,) = measured(results, cells)
    shown = section(run, source_figures(run), by_label, Budget(), source)
    tasks = task_chapters(results, cells, by_label)
    page = render(
        "finding.html.j2",
        finding=finding,
        beside=finding.beside(out.name),
        section=shown,
        tasks=tasks,
        label=cells[0].label,
        styles=by_label,
        failures=failures(cells),
        has_replay=shown.pictures.replay is not None
        or any(each.replay for chapter in tasks for each in chapter.section.identities),
        versions=versions(results.runs()),
    )
    with atomic_text(out) as file:
        file.write(page)
