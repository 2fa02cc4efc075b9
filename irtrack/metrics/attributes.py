"""Attributes of hard frames, computed from the ground truth, and metrics of tracks in frames with an attribute."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from irsim.types import SHOWN, Floats, TargetTruth, Truth
from irtrack.metrics.lost import OFF_IN_A_ROW
from irtrack.metrics.statistics import share

if TYPE_CHECKING:
    from irtrack.metrics.trace import Trace

TURNS_DEG = 2.0
"""Least change of attitude in a frame that counts as deformation, degrees."""
GROWS = 0.03
"""Least change of a side of the box in a frame that counts as deformation, as a share."""
TURN_PX = 0.5
"""Least change of the apparent velocity that counts as a manoeuvre, px per frame."""
LOW_SCR = 3.0
"""Limit of a low signal-to-clutter ratio: Rose (Adv. Electron. 1 (1948) 131) found that eyes need 3 to 7."""
NEAR = 3.0
"""Distance of another target, in diagonals of the target's box, below which the other target is clutter. All limits but
`LOW_SCR` are chosen here, since no benchmark prints limits for single frames."""


@dataclass(frozen=True, eq=False)
class History:
    """Ground truth of one target over n frames; nan or False where the target is absent or a value unknown.

    in_view, crossing (n,) bool;  visible (n,);  velocity (n, 2) px per frame;  attitude (n, 3)
    degrees;  size (n, 2) px;  scr (n,);  nearest (n,) distance of the nearest other target in diagonals of its box
    """

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
        """Return the history of a target from the truths of consecutive frames."""
        seen = [None if target is None else truth.target(target) for truth in truths]
        nearest = np.full(len(truths), np.nan)
        for k, (truth, one) in enumerate(zip(truths, seen, strict=True)):
            if one is not None:
                gaps = [np.hypot(*np.subtract(each.center, one.center)) for each in truth.targets if each.id != one.id]
                nearest[k] = min(gaps, default=np.inf) / one.box.diagonal

        def column(of: Callable[[TargetTruth], Any], size: int = 1) -> Floats:
            unknown = (np.nan,) * size
            rows = [unknown if one is None or (value := of(one)) is None else value for one in seen]
            return np.array(rows, dtype=np.float64).reshape(len(seen), size)

        return cls(
            in_view=np.array([one is not None and one.in_view is not False for one in seen], dtype=bool),
            crossing=np.array([one is not None and bool(one.crossing) for one in seen], dtype=bool),
            visible=column(lambda one: None if one.visible is None else (one.visible,))[:, 0],
            velocity=column(lambda one: one.velocity, 2),
            attitude=column(lambda one: one.attitude, 3),
            size=column(lambda one: (one.box.w, one.box.h), 2),
            scr=column(lambda one: None if one.scr is None else (one.scr,))[:, 0],
            nearest=nearest,
        )


def _manoeuvring(history: History) -> np.ndarray:
    return np.asarray(np.hypot(*_change(history.velocity).T) >= TURN_PX)


def _deforming(history: History) -> np.ndarray:
    turned = (_change(history.attitude) + 180.0) % 360.0 - 180.0
    grown = np.abs(_change(np.log(history.size)))
    return np.asarray((np.abs(turned) >= TURNS_DEG).any(axis=1) | (grown >= GROWS).any(axis=1))


def _change(values: Floats) -> Floats:
    """Return the change from the previous frame, (n, d); 0 in the first frame."""
    return np.asarray(np.diff(values, axis=0, prepend=values[:1]))


@dataclass(frozen=True)
class Attribute:
    """Attribute of frames: its definition in words, and the function from a history to (n,) bool."""

    rule: str
    of: Callable[[History], np.ndarray]


ATTRIBUTES: dict[str, Attribute] = {
    "hidden": Attribute(f"less than {SHOWN:.0%} of the target is visible", lambda history: history.visible < SHOWN),
    "crossing": Attribute("another target's box meets its own", lambda history: history.crossing),
    "manoeuvring": Attribute(f"its apparent velocity changes by {TURN_PX:g} px a frame or more", _manoeuvring),
    "deforming": Attribute(f"it turns by {TURNS_DEG:g} degrees or a side changes by {GROWS:.0%} or more", _deforming),
    "low SCR": Attribute(
        f"its signal-to-clutter ratio is below {LOW_SCR:g}", lambda history: np.abs(history.scr) < LOW_SCR
    ),
    "clutter": Attribute(
        f"another target is nearer than {NEAR:g} diagonals of its box", lambda history: history.nearest < NEAR
    ),
    "out of view": Attribute("it is absent, or its centre is out of the frame", lambda history: ~history.in_view),
}


def marks(truths: Sequence[Truth], target: str | None) -> np.ndarray:
    """Return whether each frame has each attribute, (n, len(ATTRIBUTES)) bool."""
    history = History.of(truths, target)
    found = [np.asarray(attribute.of(history), dtype=bool) for attribute in ATTRIBUTES.values()]
    return np.stack(found, axis=1) if truths else np.zeros((0, len(ATTRIBUTES)), dtype=bool)


@dataclass(frozen=True, slots=True)
class AttributeRow:
    """Metrics of tracks in the frames with an attribute; None where no frame defines the metric.

    frames      number of frames with the attribute after the start, in all tracks;  counted  those with a visible
                target
    off_share   share of the counted frames that are off target
    error       mean centre error over the frames with the attribute before the loss in which the target is present, px
    losses      number of losses dated to a frame with the attribute, or up to `OFF_IN_A_ROW` frames later
    tracks      number of tracks that have a frame with the attribute
    """

    attribute: str
    frames: int
    counted: int
    off_share: float | None
    error: float | None
    losses: int
    tracks: int


def by_attribute(traces: Sequence[Trace]) -> list[AttributeRow]:
    """Return a row for each of `ATTRIBUTES`, over all traces."""
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
