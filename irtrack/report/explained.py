"""Explained losses of a results file: their causes, the table of causes by tracker, and pictures where twins part."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import irsim
from irsim import IrsimError
from irsim.types import Box
from irtrack.bench import Results, RunRecord, SourceRow
from irtrack.explain import Explanation
from irtrack.explain.explain import scenario_source
from irtrack.report.frames import crop_picture
from irtrack.report.line_styles import LineStyle

MOST_PICTURES = 8
"""Largest number of losses with pictures, which are rendered for the page."""

COLUMNS = 8
"""Largest number of causes in the table by tracker."""


@dataclass(frozen=True)
class ExplainedLoss:
    """Explained loss of a run.

    pictures   scene and twin where the tracks part, as SVG elements; None where they cannot be rendered
    """

    label: str
    source: str
    found: Explanation
    pictures: tuple[str, str] | None


@dataclass(frozen=True)
class CauseRow:
    """Causes of the losses of a tracker: number of explained losses, and by cause its mean share and the number of
    losses in which it is named; `others` the same for losses without a named cause, by verdict."""

    label: str
    losses: int
    shares: Mapping[str, tuple[float, int]]
    others: Mapping[str, int]


def explained_losses(
    results: Results, cells: Sequence[RunRecord], styles: Mapping[str, LineStyle]
) -> tuple[ExplainedLoss, ...]:
    """Return the losses that `irtrack explain` has explained; the first of them with pictures."""
    rows = results.sources()
    found: list[ExplainedLoss] = []
    for cell in cells:
        values = results.explanation(cell.key)
        if values is not None:
            explanation = Explanation.from_dict(values)
            pictures = None
            if len(found) < MOST_PICTURES:
                pictures = _pictures(explanation, rows[cell.source, cell.key.source_hash], styles[cell.label])
            found.append(ExplainedLoss(cell.label, cell.source, explanation, pictures))
    return tuple(found)


def cause_table(losses: Sequence[ExplainedLoss]) -> tuple[tuple[str, ...], tuple[CauseRow, ...]]:
    """Return the causes of largest shares, and the row of each tracker."""
    total: defaultdict[str, float] = defaultdict(float)
    by_label: defaultdict[str, list[Explanation]] = defaultdict(list)
    for loss in losses:
        by_label[loss.label].append(loss.found)
        for share in loss.found.shares:
            total[share.cause] += max(share.value, 0.0) + share.named
    causes = tuple(sorted(total, key=lambda cause: (-total[cause], cause))[:COLUMNS])
    return causes, tuple(_cause_row(label, causes, found) for label, found in sorted(by_label.items()))


def _cause_row(label: str, causes: Sequence[str], found: Sequence[Explanation]) -> CauseRow:
    shares = {}
    for cause in causes:
        own = [share for each in found for share in each.shares if share.cause == cause]
        if own:
            shares[cause] = sum(share.value for share in own) / len(found), sum(share.named for share in own)
    others: defaultdict[str, int] = defaultdict(int)
    for each in found:
        others[each.verdict] += not each.named
    return CauseRow(label, len(found), shares, {name: count for name, count in others.items() if count})


def _pictures(found: Explanation, row: SourceRow, style: LineStyle) -> tuple[str, str] | None:
    """Return the scene and the twin without the first cause, in the frame in which the tracks part."""
    parting = found.parting
    if parting is None:
        return None
    try:
        if row.kind == "recording":
            scene = scenario_source(row.text)
        else:
            scene = irsim.Rendering(irsim.loads(row.text, row.name, trusted=False), row.name)
        twins = irsim.Twins(scene.scenario, found.target, found.first, [share.cause for share in found.shares])
        pictures = []
        boxes = [box for box in parting.boxes if box is not None]
        for removed, own, truth in (((), *parting.boxes[:2]), (parting.removed, *parting.boxes[2:])):
            twin = irsim.Rendering(twins.scenario_of(removed))
            image = twin.frame(_number(twin, parting.time_s), "display").image
            pictures.append(crop_picture(image, truth, {found.tracker: (style, own)}, _around(truth, boxes)))
    except (IrsimError, ValueError):  # the scene has changed, or the twin lost this frame
        return None
    return pictures[0], pictures[1]


def _number(twin: irsim.Rendering, time_s: float) -> int:
    """Return the number of the frame at a time; ValueError where it is lost."""
    return list(twin.arrivals).index(round(time_s * twin.rate_hz))


def _around(truth: Box | None, boxes: Sequence[Box]) -> list[Box]:
    """Return all boxes, the true one, on which the size of the picture depends, first."""
    return [*([truth] if truth else []), *boxes]
