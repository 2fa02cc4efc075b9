"""Lost runs by severity: of each tracker one table, with a row a source and a column a severity.

Sources that differ by one more cause, as those of `suites/occlusion-suite` do, make it a table of two causes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irtrack.metrics import Breaking
from irtrack.report.figure_data import SeverityFigures


@dataclass(frozen=True)
class Losses:
    """The runs of one cell of the table, and those of them that were lost or failed."""

    runs: int
    lost: int

    @property
    def share(self) -> float:
        return self.lost / self.runs


@dataclass(frozen=True)
class LossRow:
    """A source: its runs at each severity of the table, None at one that it was not run at; where half are lost."""

    family: str
    cells: tuple[Losses | None, ...]
    breaks: str


@dataclass(frozen=True)
class LossTable:
    """A tracker: the severities at which any of the sources was run, rising, and a row for each source."""

    label: str
    severities: tuple[int, ...]
    rows: tuple[LossRow, ...]


def loss_tables(families: Sequence[SeverityFigures]) -> tuple[LossTable, ...]:
    """A table for each tracker, by label; none where a single source was run: its failure curve says it all."""
    if len(families) < 2:
        return ()
    points = [point for each in families for point in each.breaking.values()]
    severities = sorted({int(severity) for point in points for severity in point.severities})
    labels = sorted({label for each in families for label in each.breaking})
    return tuple(
        LossTable(
            label,
            tuple(severities),
            tuple(_row(each.family, each.breaking[label], severities) for each in families if label in each.breaking),
        )
        for label in labels
    )


def _row(family: str, point: Breaking, severities: Sequence[int]) -> LossRow:
    found = {
        int(severity): Losses(int(runs), int(lost))
        for severity, runs, lost in zip(point.severities, point.runs, point.lost, strict=True)
    }
    return LossRow(family, tuple(map(found.get, severities)), point.in_words())
