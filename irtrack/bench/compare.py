"""Comparison of two sets of results on the same scenes: better, worse, tie or too few; gates; JUnit XML."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

from irsim.config.base import suggestion
from irtrack.bench import ALL_SOURCES, Pair, Results, RunRecord, difference, pairs, value
from irtrack.errors import InputError
from irtrack.metrics import LEAST_SCENES, Difference, scenes_for
from irtrack.metrics.tasks import ALL_FIGURES

OTHER_NAMES = {"auc": "success_auc", "success": "success_auc", "error": "error_held", "rmse": "rmse_held"}
"""Other common names of figures -> their names here."""

USUAL = ("lost", "off_share", "error_held", "success_auc", "ms_median")
"""Metrics compared by default."""

COMPARED = tuple(name for name, figure in ALL_FIGURES.items() if figure.better is not None)
"""Figures of which either a smaller or a larger value is better."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """Comparison of one metric of one tracker on one source (or on all), over the runs that old and new results share.

    old, new     means over the paired runs;  difference  mean of new minus old, with its interval over scenes
    """

    source: str
    label: str
    figure: str
    old: float
    new: float
    difference: Difference

    @property
    def verdict(self) -> Literal["better", "worse", "tie", "too few"]:
        """Verdict: 'tie' where the interval contains zero, 'too few' where there are too few runs for an interval."""
        if self.difference.is_open:
            return "too few"
        if self.difference.is_tie:
            return "tie"
        return "worse" if (self.difference.mean > 0) == (ALL_FIGURES[self.figure].better == "less") else "better"

    @property
    def worsening(self) -> tuple[float, float]:
        """Ends of the interval of the worsening, the smaller first; below zero where the new results are better."""
        d = self.difference
        return (d.low, d.high) if ALL_FIGURES[self.figure].better == "less" else (-d.high, -d.low)

    def is_worse_by(self, margin: float) -> bool:
        """Return whether the whole interval is worse by more than `margin`."""
        return self.worsening[0] > margin

    def may_be_worse_by(self, margin: float) -> bool:
        """Return whether only a part of the interval is worse by more than `margin`."""
        least, most = self.worsening
        return not self.difference.is_open and least <= margin < most


def compare(old: Iterable[RunRecord], new: Iterable[RunRecord], figures: Sequence[str] = USUAL) -> list[Comparison]:
    """Return a comparison of each metric for each source and label in both, and over all sources of a label.

    Runs are paired by source, target, start, input and seeds, so that both results are of the same frames. A failed run
    counts as lost and has no other metric. InputError for an unknown metric, or where no run is in both.
    """
    for name in figures:
        check_figure(name)
    pairs = _pairs(old, new)
    if not pairs:
        raise InputError("the two have no run in common; allowed: results of the same scenes, seeds and labels")
    comparisons = []
    for (source, label), members in pairs.items():
        for name in figures:
            found = difference(members, name)
            if found is not None:
                known = [(value(a, name), value(b, name)) for a, b in members]
                finite = [(a, b) for a, b in known if math.isfinite(a) and math.isfinite(b)]
                before, after = (sum(values) / len(finite) for values in zip(*finite, strict=True))
                comparisons.append(Comparison(source, label, name, before, after, found))
    return comparisons


def check_figure(name: str) -> None:
    """Raise InputError where no metric has this name, or the metric has no better direction."""
    if name not in COMPARED:
        raise InputError(f"figure '{name}': allowed: {', '.join(COMPARED)}{suggestion(name, COMPARED, OTHER_NAMES)}")


def cells_of(results: str | Path, label: str | None = None) -> list[RunRecord]:
    """Return the newest run records of a results file, of one label where given; InputError where there are none."""
    with Results(results) as opened:
        cells = opened.cells()
    labels = sorted({cell.label for cell in cells})
    if label is not None:
        cells = [cell for cell in cells if cell.label == label]
    if not cells:
        wanted = "no runs" if label is None else f"no tracker is labelled '{label}'"
        hint = "" if label is None else suggestion(label, labels)
        raise InputError(f"{results}: {wanted}; allowed: {', '.join(labels) or 'a file with runs'}{hint}")
    return cells


def under_one_label(cells: Iterable[RunRecord], label: str) -> list[RunRecord]:
    """Return the records with their label replaced by `label`, to compare two trackers of one file."""
    return [replace(cell, label=label) for cell in cells]


def _pairs(old: Iterable[RunRecord], new: Iterable[RunRecord]) -> dict[tuple[str, str], list[Pair]]:
    """Return the paired runs by (source, label); last, for each label with several sources, those over all sources."""
    before, after = _by_place(old), _by_place(new)
    found = {place: both for place in after if (both := pairs(before.get(place, ()), after[place]))}
    for label in sorted({label for _, label in found}):
        of_label = [both for (_, each), both in found.items() if each == label]
        if len(of_label) > 1:
            found[ALL_SOURCES, label] = [pair for both in of_label for pair in both]
    return found


def _by_place(cells: Iterable[RunRecord]) -> dict[tuple[str, str], list[RunRecord]]:
    found: dict[tuple[str, str], list[RunRecord]] = {}
    for cell in cells:
        found.setdefault((cell.source, cell.label), []).append(cell)
    return found


@dataclass(frozen=True, slots=True)
class Gate:
    """Condition that a metric is not worse by more than `margin`."""

    figure: str
    margin: float

    @classmethod
    def parse(cls, text: str) -> Gate:
        """Return the gate of 'METRIC:MARGIN', e.g. 'lost:0.05'; InputError for anything else."""
        figure, _, margin = text.partition(":")
        check_figure(figure)
        try:
            value = float(margin or "0")
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value >= 0):
            raise InputError(f"'{text}': allowed: METRIC:MARGIN, the margin a number of 0 or more, e.g. {figure}:0.05")
        return cls(figure, value)

    def failures(self, comparisons: Iterable[Comparison]) -> list[Comparison]:
        """Return the comparisons that are worse by more than the margin."""
        return [each for each in comparisons if each.figure == self.figure and each.is_worse_by(self.margin)]

    def doubts(self, comparisons: Iterable[Comparison]) -> list[str]:
        """Return a line for each comparison that passes although its interval reaches beyond the margin."""
        of_figure = [each for each in comparisons if each.figure == self.figure]
        return [self._doubt(each) for each in of_figure if each.may_be_worse_by(self.margin)]

    def _doubt(self, each: Comparison) -> str:
        """Return a line such as 't on sky: lost: a worsening of up to 0.7 is not excluded by these 6 seeds'."""
        d = each.difference
        have = d.scenes if d.scenes > 1 else d.pairs
        need = scenes_for(d, self.margin) if self.margin > 0 else 0
        about = round(need, 2 - len(str(need)))  # two digits
        more = f"; about {about} would resolve {self.margin:g}" if need > have else ""
        unit = "scenes" if each.source == ALL_SOURCES else "seeds"
        return (
            f"{each.label} on {each.source}: {each.figure}: a worsening of up to {each.worsening[1]:.2g} is not "
            f"excluded by these {have} {unit}{more}"
        )

    def require_enough(self, comparisons: Iterable[Comparison]) -> None:
        """Raise InputError where every comparison of this gate's metric has too few runs to be judged."""
        of_figure = [each for each in comparisons if each.figure == self.figure]
        if all(each.verdict == "too few" for each in of_figure):
            raise InputError(
                f"{self.figure}: too few runs to tell whether it is worse; allowed: at least {LEAST_SCENES} "
                "on different frames"
            )


def junit(comparisons: Sequence[Comparison], gates: Sequence[Gate]) -> str:
    """Return JUnit XML: a test case for every gate, source and label; its output holds the warnings of `doubts`."""
    suite = ElementTree.Element("testsuite", name="irtrack compare")
    failed = 0
    for gate in gates:
        worse = gate.failures(comparisons)
        for each in comparisons:
            if each.figure != gate.figure:
                continue
            case = ElementTree.SubElement(
                suite, "testcase", classname=f"{each.source}.{each.label}", name=f"{gate.figure}:{gate.margin:g}"
            )
            if each.verdict == "too few":
                ElementTree.SubElement(case, "skipped", message=in_words(each))
            if each in worse:
                failed += 1
                ElementTree.SubElement(case, "failure", message=in_words(each))
            for doubt in gate.doubts([each]):
                ElementTree.SubElement(case, "system-out").text = doubt
    suite.set("tests", str(len(suite)))
    suite.set("failures", str(failed))
    ElementTree.indent(suite)
    return ElementTree.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"


def in_words(each: Comparison) -> str:
    """Return 'kalman on sky: lost 0.1 -> 0.4, +0.3 [0.1, 0.5]: worse'."""
    d = each.difference
    return (
        f"{each.label} on {each.source}: {each.figure} {each.old:.4g} -> {each.new:.4g}, "
        f"{d.mean:+.3g} [{d.low:.3g}, {d.high:.3g}]: {each.verdict}"
    )
