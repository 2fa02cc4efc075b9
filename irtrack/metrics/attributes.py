"""What makes a frame hard, told from the truth, and how tracks fare in such frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from irsim.types import SHOWN, Floats, Truth
from irtrack.metrics.lost import OFF_IN_A_ROW
from irtrack.metrics.statistics import share

if TYPE_CHECKING:
    from irtrack.metrics.trace import Trace

TURNS_DEG = 2.0
"""Turning of a target's attitude in a frame from which on its outline is taken to deform, degrees."""
GROWS = 0.03
"""Change of a side of its box in a frame from which on it does, as a share."""
TURN_PX = 0.5
"""Change of the apparent velocity in a frame from which on a target manoeuvres, px per frame."""
LOW_SCR = 3.0
"""A signal-to-clutter ratio below this is low: Rose (Adv. Electron. 1 (1948) 131) found that eyes need 3 to 7."""
NEAR = 3.0
"""Another target nearer than this many diagonals of the target's box is clutter. The limits but
LOW_SCR are chosen here: no benchmark prints one for each frame."""


@dataclass(frozen=True, eq=False)
class History:
    """The truth of one target over n frames; nan or False where it is absent or the truth does not say.

    present, in_view, crossing (n,) bool;  visible (n,);  velocity (n, 2) px per frame;  attitude (n, 3)
    degrees;  size (n, 2) px;  scr (n,);  nearest (n,) distance of the nearest other target in diagonals of its box
    """

    present: np.ndarray
    in_view: np.ndarray
    crossing: np.ndarray
    visible: Floats
    velocity: Floats
    attitude: Floats
    size: Floats
    scr: Floats
    nearest: Floats

    @classmethod
    def of(cls, truths: Sequence[Truth], target: str | None) -> History:
        """Of consecutive truths."""
        n = len(truths)
        seen = [None if target is None else truth.target(target) for truth in truths]
        unknown2, unknown3 = (np.nan, np.nan), (np.nan, np.nan, np.nan)
        nearest = np.full(n, np.nan)
        for k, (truth, one) in enumerate(zip(truths, seen, strict=True)):
            if one is not None:
                gaps = [np.hypot(*np.subtract(each.center, one.center)) for each in truth.targets if each.id != one.id]
                nearest[k] = min(gaps, default=np.inf) / one.box.diagonal
        return cls(
            present=np.array([one is not None for one in seen], dtype=bool),
            in_view=np.array([one is not None and one.in_view is not False for one in seen], dtype=bool),
            crossing=np.array([one is not None and bool(one.crossing) for one in seen], dtype=bool),
            visible=np.array(
                [np.nan if one is None or one.visible is None else one.visible for one in seen], dtype=np.float64
            ),
            velocity=np.array(
                [unknown2 if one is None else one.velocity or unknown2 for one in seen], dtype=np.float64
            ).reshape(n, 2),
            attitude=np.array(
                [unknown3 if one is None else one.attitude or unknown3 for one in seen], dtype=np.float64
            ).reshape(n, 3),
            size=np.array(
                [unknown2 if one is None else (one.box.w, one.box.h) for one in seen], dtype=np.float64
            ).reshape(n, 2),
            scr=np.array([np.nan if one is None or one.scr is None else one.scr for one in seen], dtype=np.float64),
            nearest=nearest,
        )


def _hidden(history: History) -> np.ndarray:
    return np.asarray(history.visible < SHOWN)


def _crossing(history: History) -> np.ndarray:
    return history.crossing


def _manoeuvring(history: History) -> np.ndarray:
    return np.asarray(np.hypot(*_change(history.velocity).T) >= TURN_PX)


def _deforming(history: History) -> np.ndarray:
    turned = (_change(history.attitude) + 180.0) % 360.0 - 180.0
    grown = np.abs(_change(np.log(history.size)))
    return np.asarray((np.abs(turned) >= TURNS_DEG).any(axis=1) | (grown >= GROWS).any(axis=1))


def _low_scr(history: History) -> np.ndarray:
    return np.asarray(np.abs(history.scr) < LOW_SCR)


def _clutter(history: History) -> np.ndarray:
    return np.asarray(history.nearest < NEAR)


def _out_of_view(history: History) -> np.ndarray:
    return np.asarray(~(history.present & history.in_view))


def _change(values: Floats) -> Floats:
    """(n, d): from the frame before; nothing in the first."""
    return np.asarray(np.diff(values, axis=0, prepend=values[:1]))


@dataclass(frozen=True)
class Attribute:
    """What a frame is marked for: a rule in words, and as a function of the truth's history, (n,) bool."""

    rule: str
    of: Callable[[History], np.ndarray]


ATTRIBUTES: dict[str, Attribute] = {
    "hidden": Attribute(f"less than {SHOWN:.0%} of the target is visible", _hidden),
    "crossing": Attribute("another target's box meets its own", _crossing),
    "manoeuvring": Attribute(f"its apparent velocity changes by {TURN_PX:g} px a frame or more", _manoeuvring),
    "deforming": Attribute(f"it turns by {TURNS_DEG:g} degrees or a side changes by {GROWS:.0%} or more", _deforming),
    "low SCR": Attribute(f"its signal-to-clutter ratio is below {LOW_SCR:g}", _low_scr),
    "clutter": Attribute(f"another target is nearer than {NEAR:g} diagonals of its box", _clutter),
    "out of view": Attribute("it is absent, or its centre is out of the frame", _out_of_view),
}


def marks(truths: Sequence[Truth], target: str | None) -> np.ndarray:
    """(n, len(ATTRIBUTES)) bool: what each frame is marked for."""
    history = History.of(truths, target)
    found = [attribute.of(history) for attribute in ATTRIBUTES.values()]
    return np.stack(found, axis=1) if truths else np.zeros((0, len(ATTRIBUTES)), dtype=bool)


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
