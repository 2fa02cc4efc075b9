"""The page, and the Markdown, of one run that breaks a rule: what was asked, what was reached, how it was found."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from irsim.recording.output import atomic_text
from irsim.types import Source
from irtrack.bench import Results
from irtrack.report.figures import failures, source_figures
from irtrack.report.measured import measured
from irtrack.report.page import rendered, versions
from irtrack.report.palette import styles
from irtrack.report.sections import Room, section


@dataclass(frozen=True)
class Finding:
    """What is told of the run, in words.

    verdict    (what, said): the rule, what it asks, what was reached
    way        (what, said): how it was found and made small
    knobs      (key, benign, found, smallest) of each key that varies
    commands   (what it does, command)
    files      (name, what it is) of those that lie beside the page
    """

    title: str
    verdict: tuple[tuple[str, str], ...]
    way: tuple[tuple[str, str], ...]
    knobs: tuple[tuple[str, str, str, str], ...]
    commands: tuple[tuple[str, str], ...]
    files: tuple[tuple[str, str], ...]

    def beside(self, name: str) -> list[tuple[str, str]]:
        """The other files, for the one of that name."""
        return [file for file in self.files if file[0] != name]

    def as_markdown(self, name: str) -> str:
        """All of it for a file of that name, which a pull request can show."""
        lines = [f"# {self.title}", "", *_listed(self.verdict), "", *_listed(self.way), ""]
        lines += ["| key | benign | found | smallest |", "| --- | --- | --- | --- |"]
        lines += [f"| `{key}` | {' | '.join(values)} |" for key, *values in self.knobs]
        lines += ["", "```sh", *(line for what, command in self.commands for line in (f"# {what}", command)), "```", ""]
        lines += [f"- `{file}`: {what}" for file, what in self.beside(name)]
        return "\n".join(lines) + "\n"


def _listed(facts: tuple[tuple[str, str], ...]) -> list[str]:
    return [f"- {what}: {said}" for what, said in facts]


def write_finding(results: Results, out: Path, finding: Finding, source: Source) -> None:
    """Write the page of a results file with one run in it, whose source is at hand."""
    cells = results.cells()
    by_label = styles([cell.label for cell in cells])
    (run,) = measured(results, cells)
    shown = section(run, source_figures(run), by_label, Room(), source)
    page = rendered(
        "finding.html.j2",
        finding=finding,
        beside=finding.beside(out.name),
        section=shown,
        label=cells[0].label,
        styles=by_label,
        failures=failures(cells),
        has_replay=shown.pictures.replay is not None,
        versions=versions(results.runs()),
    )
    with atomic_text(out) as file:
        file.write(page)
