"""How tracks fare in frames of each attribute."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtrack.metrics.attributes import ATTRIBUTES
from irtrack.metrics.interval import share
from irtrack.metrics.loss import OFF_IN_A_ROW
from irtrack.metrics.trace import Trace


@dataclass(frozen=True, slots=True)
class AttributeRow:
    """What tracks do in the frames that are marked for an attribute; None where no frame says anything.

    frames      marked frames after the start, in all tracks;  counted  those of them with a visible target
    off_share   share of the counted ones that are off
    error       mean centre error over the marked frames before the loss in which the target is present, px
    losses      losses dated to a marked frame, or to within `OFF_IN_A_ROW` frames after one
    tracks      tracks with a marked frame
    """

    attribute: str
    frames: int
    counted: int
    off_share: float | None
    error: float | None
    losses: int
    tracks: int


def by_attribute(traces: Sequence[Trace]) -> list[AttributeRow]:
    """A row for each of `ATTRIBUTES`, over all traces."""
    return [_row(name, column, traces) for column, name in enumerate(ATTRIBUTES)]


def _row(name: str, column: int, traces: Sequence[Trace]) -> AttributeRow:
    frames = losses = tracks = 0
    off, errors = [np.zeros(0, dtype=bool)], [np.zeros(0)]
    for trace in traces:
        marked = trace.marks[:, column].copy()
        marked[:1] = False
        frames += int(marked.sum())
        tracks += bool(marked.any())
        off.append(trace.off[marked & trace.counted])
        errors.append(trace.errors[marked & trace.held])
        if trace.lost_position is not None:
            losses += bool(marked[max(trace.lost_position - OFF_IN_A_ROW, 0) : trace.lost_position + 1].any())
    all_off, all_errors = np.concatenate(off), np.concatenate(errors)
    return AttributeRow(
        attribute=name,
        frames=frames,
        counted=len(all_off),
        off_share=share(all_off) if len(all_off) else None,
        error=float(all_errors.mean()) if len(all_errors) else None,
        losses=losses,
        tracks=tracks,
    )
